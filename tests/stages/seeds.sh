#!/usr/bin/env bash
# seeds.sh [--all]: the seeds and scenes that ./dev test leaves out; where time is short a part of them
# in turn, by the number of commits.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
"$stages/install.sh" test
"$stages/build.sh" release vantage_tests
parts=$(((${VANTAGE_SHARE:-100} + 24) / 25))
[[ " $* " != *" --all "* ]] || parts=4
chosen=(-R "$further_seeds")
if ((parts < 4)); then
  numbers=$(ctest --test-dir build/release -N -R "$further_seeds" |
    awk -v parts="$parts" -v turn="$(git rev-list --count HEAD)" '
      match($0, /#[0-9]+/) && (n++ + turn) % 4 < parts {
        printf ",%d", substr($0, RSTART + 1, RLENGTH - 1)
      }')
  chosen=(-I ",0,$numbers")
  echo "coverage: $parts of four quarters, in turn, of what ./dev test leaves out: time is short"
fi
exec "$stages/unit.sh" --test-dir build/release "${chosen[@]}"
