#!/usr/bin/env bash
# unit.sh [CTEST ARGS]: the unit tests of build/release but for what seeds.sh runs, or what ctest is
# told to run instead.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
(($#)) || set -- --test-dir "build/${VANTAGE_PRESET:-release}" -LE integration \
  -E "$further_seeds"
exec ctest --output-on-failure --no-tests=error -j "$(nproc)" "$@"
