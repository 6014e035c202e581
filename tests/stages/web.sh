#!/usr/bin/env bash
# The page: format, types, unit tests, and whole jobs in a browser against a real server. Skipped where npm cannot
# be had or reached, or where there is no server to talk to.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
"$stages/install.sh" web || {
  echo "skipped: npm or a browser cannot be had or reached"
  exit "$skipped"
}
"$stages/build_web.sh"
# What is loaded before the first picture, compressed, must stay small: tablets at the end of a Wi-Fi.
node client/web/tests/first_load.mjs build/web
# Whose code it has, and under which licences, goes along.
(cd client/web && node tests/licences.mjs ../../build/web)
(cd client/web && npm run format && npm run check && npm run test)
server=$root/build/release/server/vantaged
[[ -x $server ]] || {
  echo "note: no $server, so no browser was started: ./dev build vantaged"
  exit 0
}
(cd client/web && VANTAGE_SERVER_BINARY=$server npm run test:browser)
