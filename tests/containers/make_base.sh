#!/usr/bin/env bash
# make_base.sh TAR: a bare Debian 12 as a tar file, from the distribution's own packages, for where no
# image registry is reached. 'podman import TAR NAME' or 'docker import TAR NAME' makes an image of it.
set -euo pipefail
tar=$1
mirror=${VANTAGE_DEBIAN_MIRROR:-http://deb.debian.org/debian}
security=${VANTAGE_DEBIAN_SECURITY:-http://deb.debian.org/debian-security}
root=$(mktemp -d)
trap 'rm -rf --one-file-system "$root"' EXIT

debootstrap --variant=minbase bookworm "$root" "$mirror"
printf 'deb %s main\n' "$mirror bookworm" "$mirror bookworm-updates" \
  "$security bookworm-security" >"$root/etc/apt/sources.list"
# As in the images of Debian: nothing starts when it is installed.
printf '#!/bin/sh\nexit 101\n' >"$root/usr/sbin/policy-rc.d"
chmod 755 "$root/usr/sbin/policy-rc.d"
rm -rf "$root"/var/cache/apt/*.bin "$root"/var/cache/apt/archives/*.deb "$root"/var/lib/apt/lists/*
mkdir -p "$(dirname "$tar")"
tar --numeric-owner -C "$root" -cf "$tar.new" .
mv "$tar.new" "$tar"
