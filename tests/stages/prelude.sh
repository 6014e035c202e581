# shellcheck shell=bash
# Sourced first by ./dev and every stage: the folder, the clock, and how something is said.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root"
# shellcheck disable=SC2034
stages=$root/tests/stages
logs=$root/build/log
# Seconds count from the command that was given, not from the stage.
export VANTAGE_STARTED=${VANTAGE_STARTED:-$EPOCHSECONDS}
# Of tests that are repeated over numbered seeds or scenes all but the first two; of scenes the hall,
# and of steps of a scanner all but the first; and the tests of further_tests.txt: as ctest's -R and
# -E take it.
# shellcheck disable=SC2034
further_seeds='(^|[/.])((Seeds|Scenes)/.*[/ ]([2-9]|[1-9][0-9]+|Hall)|Steps/.*/[12])$'
further_seeds+=$(sed -n '/^[a-z]/ s/.*/|^&$/p' "$stages/further_tests.txt" | tr -d '\n')
# A stage that ends with this did not run, and says why.
# shellcheck disable=SC2034
skipped=77

say() { printf '[%4d s] %s\n' $((EPOCHSECONDS - VANTAGE_STARTED)) "$*"; }
die() {
  printf 'dev: %s\n' "$*" >&2
  exit 1
}

# quietly LOG COMMAND...: output goes to the log; its end is shown if the command fails.
quietly() {
  local log=$logs/$1.log status=0
  shift
  mkdir -p "$logs"
  "$@" >"$log" 2>&1 </dev/null || status=$?
  if ((status != 0)); then
    tail -n "${VANTAGE_LOG_LINES:-60}" "$log" >&2
    printf 'dev: failed (%d): %s\n     the whole log: %s\n' "$status" "$*" "$log" >&2
  fi
  return "$status"
}

# our_files PATTERN...: tracked or new, not deleted, not ignored.
our_files() {
  local file
  git ls-files --cached --others --exclude-standard -- "$@" | sort -u |
    while read -r file; do [[ ! -e $file ]] || echo "$file"; done
}
