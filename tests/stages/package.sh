#!/usr/bin/env bash
# package.sh [FOLDER]: Debian packages of server and client.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
to=${1:-build/package}
"$stages/install.sh" package
say "building the packages"
"$stages/build.sh" release installable
rm -rf "$to"
quietly package cpack --config build/release/CPackConfig.cmake -B "$PWD/build/cpack"
mkdir -p "$to"
mv build/cpack/*.deb "$to"
say "done: $(echo "$to"/*.deb)"
