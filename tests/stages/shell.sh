#!/usr/bin/env bash
# Every script is held against shellcheck; options are in .shellcheckrc.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
"$stages/install.sh" shell
our_files dev .ci/run '*.sh' | xargs shellcheck
