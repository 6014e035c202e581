#!/usr/bin/env bash
# Starts the server on a free port and lets a simulated scanner digitise the furnished flat until the
# planner says that another scan is not worth it. Arguments go to 'vantage simulate': demo.sh --seed 7
# --scans 5. The scanner is a Leica RTC360 unless they name another --preset; --step 0.25 makes its
# scans so coarse that surface is under-sampled; --worth 3 ends sooner. Leaves a page with all pictures;
# in a terminal the server stays, with the page for tablets, until Enter is pressed.
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

# The page for tablets is npm's to build; the demonstration goes without, too.
web=() link=
[[ ! -e $root/build/web/index.html ]] ||
  web=(--web 127.0.0.1:0 --web-root "$root/build/web" --web-port-file "$scratch/web-port")
"$build/server/vantaged" --listen 127.0.0.1:0 --port-file "$scratch/port" --data "$scratch/data" \
  "${web[@]}" >"$scratch/log" 2>&1 &
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
[[ ! -s $scratch/web-port ]] || link=http://127.0.0.1:$(<"$scratch/web-port")/#/demo/plan

echo "The server runs at $address. A scanner is now told, scan after scan, where to stand."
[[ -z $link ]] || echo "A crew's tablet shows the job as it goes: $link"
mkdir -p "$pictures"
rm -f "$pictures"/cycle-*.png "$pictures/index.html"
job=(--until-done --session demo --page-link "$link")
[[ " $* " != *" --scanners "* ]] || job=(--session demo)
VANTAGE_SERVER=$address "$build/client/cli/vantage" simulate --no-hints --preset leica-rtc360 \
  --pictures "$pictures" --compare "$root/tests/integration/demo_oracle.json" "${job[@]}" "$@"

if [[ -n $link && -t 0 && -t 1 ]]; then
  echo
  echo "The server stays until you press Enter. Its page for tablets, with the job: $link"
  read -r || true
elif [[ -z $link ]]; then
  echo
  echo "Once './dev build web' has built the page for tablets (it needs npm), the demonstration shows it, too."
fi
cat <<TEXT

The server of this demonstration has ended. To go on, start one that stays and try:
  $build/server/vantaged &
  $build/client/cli/vantage doctor
  $build/client/cli/vantage simulate --seed 8 --session flat8 --pictures $pictures-8
  $build/client/cli/vantage plan flat8 --budget 5
  $build/client/cli/vantage export flat8 --format surface-ply -o flat8.ply
  $build/client/cli/vantage --help
TEXT
