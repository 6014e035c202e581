#!/usr/bin/env bash
# test.sh [FILTER]: installs and builds what the tests need, and runs them. FILTER: a folder of tests or
# what it tests (core/planning), of which only that is built, and run as without a filter; or else a
# regular expression for the tests' names, all of which are run. Ends with 2 when there was nothing to run, because it could not be built.
source "$(dirname "${BASH_SOURCE[0]}")/run.sh"
filter=${1:-} preset=${VANTAGE_PRESET:-release}
folder=${filter%/}
folder=tests/${folder#tests/}
[[ -n $filter && -e $folder/CMakeLists.txt ]] || folder=

targets=(vantage_tests)
[[ -z $folder ]] || targets=("$folder/all")
if ! stage install "$stages/install.sh" test || ! stage build "$stages/build.sh" "$preset" "${targets[@]}"; then
  finish test || exit 2
fi
if [[ -n $folder ]]; then
  stage unit "$stages/unit.sh" --test-dir "build/$preset/$folder" -E "$further_seeds" || true
elif [[ -n $filter ]]; then
  stage unit "$stages/unit.sh" --test-dir "build/$preset" -R "$filter" || true
else
  stage unit || true
  stage integration || true
fi
finish test
