#!/usr/bin/env bash
# The page of calls (server/calls.md), run as it stands.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
"$stages/install.sh" build
"$stages/install.sh" proto || {
  echo "skipped: no buf, npm cannot be had or reached"
  exit "$skipped"
}
"$stages/build.sh" release vantaged vantage
PATH=$root/build/release/server:$root/build/release/client/cli:$root/build/node/node_modules/.bin:$PATH \
  exec python3 -B "$stages/page_lines.py" --methods "$root/server/rpc/call/rules.h" "$root/server/calls.md"
