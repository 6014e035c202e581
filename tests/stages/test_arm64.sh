#!/usr/bin/env bash
# test_arm64.sh: a part of the tests of build/arm64, under qemu: what reads and writes bytes, and a whole job
# through a server. Goldens are not among them: on ARM they differ in their last digits (CONTRIBUTING.md,
# 'Other processors').
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
run=(/usr/bin/qemu-aarch64-static -L "$root/build/arm64-sysroot")
status=0 server=
for name in core/bytes core/e57; do
  say "$name"
  VANTAGE_SHARED_DATA=${VANTAGE_SHARED_DATA:-$root/../shared/data} \
    "${run[@]}" "build/arm64/tests/$name/${name//\//_}_test" --gtest_brief=1 || status=1
done

say "two scans and a plan, through a server"
folder=$(mktemp -d)
trap '[[ -z $server ]] || kill "$server"; rm -rf "$folder"' EXIT
"${run[@]}" build/arm64/server/vantaged --in-memory --listen "unix:$folder/s" >"$folder/log" 2>&1 &
server=$!
client=("${run[@]}" build/arm64/client/cli/vantage --server "unix:$folder/s")
for _ in $(seq 300); do
  [[ ! -S $folder/s ]] || break
  sleep 0.2
done
# By work, not by time: qemu takes tens of times as long.
"${client[@]}" --timeout 300 simulate --scene two-rooms --step 3 --density 50 --scans 2 --work 300000 \
  --session flat --no-hints || status=1
"${client[@]}" scan list flat | tee "$folder/scans"
[[ $(grep -c ' merged ' "$folder/scans") == 2 ]] || {
  tail -n 20 "$folder/log"
  status=1
}
exit "$status"
