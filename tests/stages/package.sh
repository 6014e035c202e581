#!/usr/bin/env bash
# package.sh [FOLDER]: Debian packages of server, client and libraries.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
to=${1:-build/package}
"$stages/install.sh" package
# The page that tablets open. Without npm there are packages all the same.
if "$stages/install.sh" page; then
  "$stages/build_web.sh"
elif [[ -e build/web/index.html ]]; then
  say "npm cannot be had or reached: the packages have the page as it was built before"
else
  say "npm cannot be had or reached: the packages have no page"
fi
say "building the packages"
"$stages/build.sh" release installable
rm -rf "$to"
quietly package cpack --config build/release/CPackConfig.cmake -B "$PWD/build/cpack"
mkdir -p "$to"
mv build/cpack/*.deb "$to"
say "done: $(echo "$to"/*.deb)"
