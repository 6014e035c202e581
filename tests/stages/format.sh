#!/usr/bin/env bash
# format.sh [--fix]: the sources as clang-format wants them; shows what is not, or rewrites it.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
"$stages/install.sh" format
how=(--dry-run --Werror)
[[ ${1:-} != --fix ]] || how=(-i)
our_files '*.cc' '*.h' | xargs -P "$(nproc)" -n 40 clang-format-14 "${how[@]}"
