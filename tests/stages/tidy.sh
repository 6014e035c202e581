#!/usr/bin/env bash
# tidy.sh [--all]: clang-tidy; see tidy.py.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
"$stages/install.sh" tidy
quietly configure-tidy cmake --preset tidy -DVANTAGE_UNITY=OFF -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON
# The headers that are generated are those of the build.
"$stages/build.sh" release vantage_proto
readarray -t files < <(our_files '*.cc')
"$stages/coverage.py" --most 120 "$@" "${files[@]}" | "$stages/tidy.py"
