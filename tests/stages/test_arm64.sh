#!/usr/bin/env bash
# test_arm64.sh: the tests of build/arm64 that build_arm64.sh builds, under qemu: formats, sums and goldens,
# which hold plans, models, registrations and views to the bit as x86-64 has them; and the server, which has
# to answer a client.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
sysroot=$root/build/arm64-sysroot
run=(/usr/bin/qemu-aarch64-static -L "$sysroot")
status=0
for name in core/bytes core/e57 core/golden core/model/snapshot core/registration core/sensor; do
  say "$name"
  program=build/arm64/tests/$name/${name//\//_}_test
  VANTAGE_SHARED_DATA=${VANTAGE_SHARED_DATA:-$root/../shared/data} \
    "${run[@]}" "$program" --gtest_brief=1 "--gtest_filter=${VANTAGE_ARM64_FILTER:--*Seeds*:*Scenes*}" || status=1
done
say "a server and a client"
folder=$(mktemp -d)
trap 'kill "$server" 2>/dev/null; rm -rf "$folder"' EXIT
"${run[@]}" build/arm64/server/vantaged --in-memory --listen "unix:$folder/s" >"$folder/log" 2>&1 &
server=$!
for _ in $(seq 300); do
  [[ ! -S $folder/s ]] || break
  sleep 0.2
done
"${run[@]}" build/arm64/client/cli/vantage --server "unix:$folder/s" health || status=1
exit "$status"
