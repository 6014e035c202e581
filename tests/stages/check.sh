#!/usr/bin/env bash
# check.sh [STAGE...] [--all] [--long]: what ./dev test leaves out. Tidy, sanitizers and fuzzers cover a
# part of the tree (see coverage.py) within their budgets; with --all everything, however long it takes
# (an hour and a half on two cores); with --long sanitizers also run studies and tests of two seconds
# and more, which go the ways of the others over whole scenes (hours, with --all).
source "$(dirname "${BASH_SOURCE[0]}")/run.sh"
all=() chosen=()
for word in "$@"; do
  case $word in
    --all) all=(--all) ;;
    --long) export VANTAGE_LONG=1 ;;
    -*) die "unknown option $word; ./dev check [STAGE...] [--all] [--long]" ;;
    *) chosen+=("$word") ;;
  esac
done
readarray -t every < <(sed '1,/^# .\/dev check/d; /^#/d; s/ .*//' "$stages/stages.txt")
((${#chosen[@]})) || chosen=("${every[@]}")
for name in "${chosen[@]}"; do
  [[ " ${every[*]} " == *" $name "* ]] || die "no stage is called $name; there are: ${every[*]}"
done
# 40 times its budget: only what hangs is stopped.
if ((${#all[@]} > 0)) || [[ ${VANTAGE_LONG:-0} == 1 ]]; then export VANTAGE_SLACK=40; fi

for name in "${chosen[@]}"; do
  case $name in
    seeds | tidy | asan | tsan) stage "$name" "$stages/$name.sh" "${all[@]}" || true ;;
    fuzz) stage fuzz "$stages/fuzz.sh" --stage "${all[@]}" || true ;;
    *) stage "$name" || true ;;
  esac
done
finish check
