#!/usr/bin/env bash
# tsan.sh [--all]: tests under clang's thread sanitizer, where it tells the truth: nothing here calls
# gRPC.
source "$(dirname "${BASH_SOURCE[0]}")/sanitizers.sh"
"$stages/install.sh" sanitizers
# Where threads meet: plans and sessions. With --all the rest of core/, too, which hands its loops to
# core/parallel.
cores=(tests/core/{parallel,planning})
[[ " $* " != *" --all "* ]] || cores=(tests/core)
readarray -t units < <(rooms "${cores[@]}" "${server_rooms[@]}")
chosen=$("$stages/coverage.py" --seconds 380 "$@" "${units[@]}")
readarray -t units <<<"$chosen"
built tsan "${units[@]}"
# Clang 14's thread sanitizer trips over kernels that randomise addresses widely.
setarch -R true 2>/dev/null && wrapper=(setarch -R)
sanitized tsan "${units[@]}"
