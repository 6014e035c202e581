#!/usr/bin/env bash
# fuzz.sh [NAME] [--minutes N | --runs N]: one fuzzer or all of them, two at a time, since each has one
# thread; from the seeds in tests/fuzz/corpus. What is found is kept in build/fuzz.
# fuzz.sh --stage [--all]: for two minutes in all, less where time is short, those that asan.sh has built.
source "$(dirname "${BASH_SOURCE[0]}")/sanitizers.sh"

# fuzz_one NAME LIMIT
fuzz_one() {
  local name=$1 limit=$2 found="build/fuzz/$1" seeds status=0
  mkdir -p "$found/corpus"
  seeds=(tests/fuzz/corpus/"${name%_fuzzer}"/)
  [[ -d ${seeds[0]} ]] || seeds=()
  "build/asan/tests/fuzz/$name" "$limit" -timeout=20 -rss_limit_mb=4096 -print_final_stats=1 \
    -artifact_prefix="$found/" "$found/corpus" "${seeds[@]}" >"$found/log" 2>&1 || status=$?
  ((status == 0)) || tail -n 100 "$found/log"
  awk -v name="$name" -v status="$status" '/stat::number_of_executed_units/ { runs = $2 }
    END { printf "%s: %d runs, %s\n", name, runs, status == 0 ? "nothing found" : "FOUND SOMETHING" }' \
    "$found/log"
  return "$status"
}

if [[ ${1:-} == --one ]]; then
  fuzz_one "$2" "$3"
  exit
fi

readarray -t chosen < <(our_files 'tests/fuzz/*_fuzzer.cc')
limit=-max_total_time=60
if [[ ${1:-} == --stage ]]; then
  shift
  readarray -t units < <(asan_units)
  covered=$("$stages/coverage.py" --seconds "$asan_seconds" "$@" "${units[@]}")
  turn=$(grep '_fuzzer.cc$' <<<"$covered") || {
    echo "skipped: no fuzzer's turn"
    exit "$skipped"
  }
  readarray -t chosen <<<"$turn"
  each=$((120 * 2 * ${VANTAGE_SHARE:-100} / 100 / ${#chosen[@]}))
  limit=-max_total_time=$((each > 60 ? 60 : each))
fi
while (($#)); do
  case $1 in
    --minutes)
      limit=-max_total_time=$(awk -v m="${2:?how many?}" 'BEGIN { s = int(60 * m + 0.5); print s < 1 ? 1 : s }')
      shift
      ;;
    --runs)
      limit=-runs=${2:?how many?}
      shift
      ;;
    --all) ;;
    -*) die "unknown option $1; ./dev fuzz [NAME] [--minutes N] [--runs N]" ;;
    *)
      chosen=("tests/fuzz/${1%_fuzzer}_fuzzer.cc")
      [[ -e ${chosen[0]} ]] || die "no fuzzer is called $1; there are: $(cd tests/fuzz && echo *_fuzzer.cc)"
      ;;
  esac
  shift
done
"$stages/install.sh" sanitizers
say "building the fuzzers"
built asan "${chosen[@]}"
names=("${chosen[@]##*/}")
say "${names[*]%.cc}: ${limit#-}"
printf '%s\n' "${names[@]%.cc}" | xargs -P "$(nproc)" -I NAME "$stages/fuzz.sh" --one NAME "$limit"
