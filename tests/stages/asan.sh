#!/usr/bin/env bash
# asan.sh [--all]: tests under clang's address and undefined-behaviour sanitizers; and builds the
# fuzzers that fuzz.sh runs.
source "$(dirname "${BASH_SOURCE[0]}")/sanitizers.sh"
"$stages/install.sh" sanitizers
readarray -t units < <(asan_units)
chosen=$("$stages/coverage.py" --seconds "$asan_seconds" "$@" "${units[@]}")
readarray -t units <<<"$chosen"
built asan "${units[@]}"
sanitized asan "${units[@]}"
