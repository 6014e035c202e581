#!/usr/bin/env bash
# build.sh PRESET [TARGET...]: builds the targets, or everything, into build/PRESET.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"

preset=$1
shift
log=$logs/build-$preset.log
# One ccache for every checkout: paths below the repository count as relative.
export CCACHE_BASEDIR=$root CCACHE_NOHASHDIR=1

# How far ninja is, every quarter of a minute, until this script ends it or ends itself.
report_progress() {
  local last="" now
  while sleep 15 >/dev/null 2>&1 && kill -0 $$; do
    now=$(grep -ao '^\[[0-9]*/[0-9]*\]' "$log" | tail -n 1) || continue
    [[ $now == "$last" ]] || say "compiling $now"
    last=$now
  done
}

# A job for each core, and 2 GB of memory for each job.
jobs=$(awk -v cores="$(nproc)" '/^MemAvailable/ { fit = int($2 / 2e6) }
  END { print fit < 1 ? 1 : fit < cores ? fit : cores }' /proc/meminfo)

quietly "configure-$preset" cmake --preset "$preset"
: >"$log"
report_progress &
reporter=$!
status=0
# All that is wrong at once: -k 0.
quietly "build-$preset" cmake --build "build/$preset" -j "${VANTAGE_JOBS:-$jobs}" \
  --target "${@:-all}" -- -k 0 || status=$?
kill "$reporter" 2>/dev/null || true
exit "$status"
