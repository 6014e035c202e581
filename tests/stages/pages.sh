#!/usr/bin/env bash
# The tutorial and the pages for surveyors, integrators and operators, every command as it stands; and
# the manual pages of all commands, by the program itself, as groff reads them.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
"$stages/install.sh" build pages
"$stages/build.sh" release vantaged vantage
vantage=$root/build/release/client/cli/vantage
manual=$root/build/log/man1
quietly manual deploy/man/command_pages.sh "$vantage" "$(command -v help2man)" 0 "$manual"
pages=("$manual"/*.1.gz)
commands=$("$vantage" completion commands | wc -l)
((${#pages[@]} == commands)) || die "${#pages[@]} manual pages of $commands commands"
for page in "${pages[@]}"; do
  said=$(zcat "$page" | MANWIDTH=80 man --warnings -l - 2>&1 >/dev/null)
  [[ -z $said ]] || die "${page##*/}: $said"
done
echo "$commands manual pages"
PATH=$root/build/release/server:$root/build/release/client/cli:$PATH \
  exec python3 -B "$stages/page_lines.py" client/tutorial.md client/surveyor.md client/integrator.md \
  deploy/operator.md
