# shellcheck shell=bash
# Sourced by test.sh and check.sh: runs stages within their budgets and counts what they did.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
mkdir -p "$logs"

passed=0 failed=0 skipped_tests=0 rows=()
# A stage has a process group of its own, which the terminal does not interrupt.
running=
trap '[[ -z $running ]] || { kill "$running" 2>/dev/null && wait "$running"; }; exit 130' INT TERM HUP

# follow LOG PID: what a stage says as long as it runs, and every quarter of a minute how far ctest is.
follow() {
  local line next=0
  tail -n +1 -f -s 0.5 --pid="$2" "$1" | while IFS= read -r line; do
    if [[ $line =~ ^\[\ *[0-9]+\ s\]\  ]]; then
      echo "$line"
    elif [[ $line =~ ^\ *([0-9]+/[0-9]+)\ Test\  ]] && ((SECONDS >= next)); then
      say "test ${BASH_REMATCH[1]}"
      next=$((SECONDS + 15))
    fi
  done
}

# share_of_time NAME: in percent, what of its budget the stage and those after it can have, if this
# machine goes on as slowly as so far, until VANTAGE_DEADLINE.
share_of_time() {
  [[ -n ${VANTAGE_DEADLINE:-} ]] || { echo 100 && return; }
  awk -v name="$1" -v spent=$((EPOCHSECONDS - VANTAGE_STARTED)) \
    -v left=$((VANTAGE_DEADLINE - EPOCHSECONDS)) '
    /^[a-z]/ { if ($1 == name) reached = 1; if (reached) rest += $2; else before += $2 }
    END {
      pace = before > 0 && spent > before ? spent / before : 1
      # A quarter is kept, since no stage takes exactly what it is meant to.
      share = 75 * left / (rest * pace)
      print int(share < 0 ? 0 : share > 100 ? 100 : share)
    }' "$stages/stages.txt"
}

# True of the stages that cover less where time is short.
covers_less() { sed '1,/^# By what time is left/d' "$stages/stages.txt" | grep -q "^$1 "; }

# stage NAME [COMMAND...]: runs the command, by default tests/stages/NAME.sh, as the stage of that name.
# True if it passed or was skipped. VANTAGE_SLACK times its budget, fifteen minutes at least, or at VANTAGE_DEADLINE (seconds of
# the epoch), it is stopped.
stage() {
  local name=$1 budget what began=$EPOCHSECONDS log=$logs/stage-$1.log status=0 limit took counts result
  shift
  (($#)) || set -- "$stages/$name.sh"
  read -r budget what < <(sed -n "s/^$name  *//p" "$stages/stages.txt") || die "no stage is called $name"
  say "$name: $what (budget $budget s)"
  limit=$((budget * ${VANTAGE_SLACK:-3}))
  # What short stages install comes from a network that may be slow.
  ((limit > 900)) || limit=900
  ((limit < ${VANTAGE_DEADLINE:-9999999999} - began)) || limit=$((VANTAGE_DEADLINE - began))
  VANTAGE_SHARE=$(share_of_time "$name")
  export VANTAGE_SHARE
  if ((VANTAGE_SHARE < 25)) && covers_less "$name"; then
    status=$skipped
    echo "skipped: too little time is left for it on this machine; ./dev check $name runs it" >"$log"
  elif ((limit > 0)); then
    : >"$log"
    timeout -k 10 "$limit" "$@" >>"$log" 2>&1 </dev/null &
    running=$!
    follow "$log" "$running" &
    wait "$running" || status=$?
    running=
    wait
  else
    status=124
    echo "no time was left" >"$log"
  fi
  if ((status == 124 && EPOCHSECONDS >= ${VANTAGE_DEADLINE:-9999999999})) && covers_less "$name"; then
    status=$skipped
    echo "skipped: there was not time enough for it on this machine; ./dev check $name runs it" >>"$log"
  fi
  took=$((EPOCHSECONDS - began))
  # What a stage covered and what not, and why it did nothing.
  grep -aE '^(coverage|skipped|note): ' "$log" | sed 's/^/         /' || true
  case $status in
    0) result=ok ;;
    "$skipped") result=skipped ;;
    *)
      result=FAILED
      tail -n 120 "$log"
      ((status != 124)) || echo "stopped after $took s"
      say "$name: FAILED, the whole log: $log"
      ;;
  esac
  read -r -a counts < <(awk -v status="$status" -f "$stages/count.awk" "$log")
  ((passed += counts[0], failed += counts[1], skipped_tests += counts[2])) || true
  rows+=("$(printf '%-12s %6d s of %5d s  %-7s %5d passed %3d failed %3d skipped%s' "$name" \
    "$took" "$budget" "$result" "${counts[@]}" "$( ((took <= budget)) || echo '  OVER BUDGET')")")
  ((status == 0 || status == skipped))
}

# finish NAME: the table and the count, also kept in build/log/count-NAME.
finish() {
  echo
  printf '%s\n' "${rows[@]}"
  say "done"
  echo "$passed passed, $failed failed, $skipped_tests skipped" | tee "$logs/count-$1"
  ((failed == 0))
}
