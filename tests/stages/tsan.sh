#!/usr/bin/env bash
# tsan.sh [--all]: tests under clang's thread sanitizer, where it tells the truth: nothing here calls
# gRPC.
source "$(dirname "${BASH_SOURCE[0]}")/sanitizers.sh"
"$stages/install.sh" sanitizers
readarray -t units < <(rooms tests/core "${server_rooms[@]}")
chosen=$("$stages/coverage.py" --seconds 380 "$@" "${units[@]}")
readarray -t units <<<"$chosen"
built tsan "${units[@]}"
# Clang 14's thread sanitizer trips over kernels that randomise addresses widely.
setarch -R true 2>/dev/null && wrapper=(setarch -R)
sanitized tsan "$@" "${units[@]}"
