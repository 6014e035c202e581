#!/usr/bin/env bash
# Starts the server on a free port and lets a simulated scanner digitise the furnished flat.
# Arguments go to 'vantage simulate': demo.sh --seed 7 --scans 5. The scanner is a Leica RTC360 unless
# they name another --preset; --step 0.25 makes its scans so coarse that surface is under-sampled.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
build=${VANTAGE_BUILD:-$root/build/release}
pictures=${VANTAGE_PICTURES:-$root/build/demo}
scratch=$(mktemp -d)
server=

finish() {
  if [[ -n $server ]] && kill -0 "$server" 2>/dev/null; then
    kill -TERM "$server"
    wait "$server" || true
  fi
  rm -rf "$scratch"
}
trap finish EXIT

"$build/server/vantaged" --listen 127.0.0.1:0 --port-file "$scratch/port" --data "$scratch/data" \
  >"$scratch/log" 2>&1 &
server=$!
for ((waited = 0; waited < 300; waited++)); do
  [[ -s $scratch/port ]] && break
  if ! kill -0 "$server" 2>/dev/null; then break; fi
  sleep 0.1
done
if [[ ! -s $scratch/port ]]; then
  echo "demo: the server did not start:" >&2
  cat "$scratch/log" >&2
  exit 1
fi
address=127.0.0.1:$(<"$scratch/port")

echo "The server runs at $address. A scanner is now told, scan after scan, where to stand."
mkdir -p "$pictures"
rm -f "$pictures"/cycle-*.png
VANTAGE_SERVER=$address "$build/client/cli/vantage" simulate --no-hints \
  --preset leica-rtc360 --pictures "$pictures" "$@"
cat <<TEXT

The server of this demonstration has ended. To go on, start one that stays and try:
  $build/server/vantaged &
  $build/client/cli/vantage simulate --seed 8 --session flat8 --pictures $pictures-8
  $build/client/cli/vantage plan flat8 --budget 5
  $build/client/cli/vantage export flat8 --format surface-ply -o flat8.ply
  $build/client/cli/vantage --help
TEXT
