#!/bin/sh
# make_root.sh ROOT: a root with the installed server and nothing that it doesn't load. No shell, no
# package manager: what of a package is copied stands in ROOT/var/lib/dpkg, where scanners look.
set -eu
root=$1
binary=/usr/bin/vantaged

# The packages of the server, of each library that it loads, and of what names the distribution.
# A library that is not found ends this: ldd says 'not found', and no file has that name.
libraries=$(ldd "$binary" | awk '/not found/ {print $1, "is missing" >"/dev/stderr"; exit 1}
  $2 == "=>" {print $3} $1 ~ "^/" {print $1}')
owner() {
  # dpkg knows files by the path they were unpacked to, before /lib became a link to /usr/lib.
  real=$(readlink -f "$1")
  for path in "$1" "$real" "${real#/usr}"; do
    if found=$(dpkg-query -S "$path" 2>/dev/null); then
      echo "${found%%:*}"
      return
    fi
  done
  echo "no package owns $1" >&2
  return 1
}
packages=$(
  echo vantage-server
  echo base-files
  for library in $libraries; do owner "$library"; done
)
# Packages of one source may have their licence in one of them.
packages=$(for package in $packages; do
  echo "$package"
  [ ! -L "/usr/share/doc/$package" ] || basename "$(readlink "/usr/share/doc/$package")"
done | sort -u)

# What is read by people or by other programs is left out; licences stay.
wanted() {
  grep -E '^/usr/share/doc/[^/]+(/copyright)?$|^/usr/share/common-licenses/|^/etc/|^/usr/share/vantage/|^/(usr/)?(bin|lib|lib64)/' |
    grep -vE '/(gconv|audit|cmake|pkgconfig|systemd|sysusers.d)/|^/etc/(vantage/haproxy|profile|update-motd|dpkg|default|motd|issue)' || true
}

admin=$root/var/lib/dpkg
mkdir -p "$admin/info" "$root/usr/bin" "$root/usr/lib" "$root/usr/lib64"
for link in bin lib lib64; do ln -s "usr/$link" "$root/$link"; done
: >"$admin/status"
for package in $packages; do
  list=$(dpkg-query -L "$package" | sort -u | wanted)
  for file in $list; do
    [ -d "$file" ] && [ ! -L "$file" ] && continue
    to=$root$file
    mkdir -p "$(dirname "$to")"
    # Linked where it can be: the layer that this is made in need not have it twice.
    cp -dpl "$file" "$to" 2>/dev/null || cp -dp "$file" "$to"
    echo "$file"
  done >"$admin/info/$package.list"
  dpkg-query -s "$package" >>"$admin/status"
  echo >>"$admin/status"
done

# Where a link of /etc/alternatives leads to a library (BLAS), no package has that link: here it is
# one of the package that has the library.
for library in $libraries; do
  [ -e "$root$library" ] && continue
  ln -s "$(readlink -f "$library")" "$root$library"
  echo "$library" >>"$admin/info/$(owner "$library").list"
done

# Programs of base-files and others: none but the server.
find "$root/usr/bin" -type f ! -name vantaged -delete
mkdir -p "$root/etc" "$root/tmp" "$root/proc" "$root/sys" "$root/dev"
printf 'root:x:0:0::/nonexistent:/nologin\nvantage:x:10001:10001::/data:/nologin\n' >"$root/etc/passwd"
printf 'root:x:0:\nvantage:x:10001:\n' >"$root/etc/group"
echo 'include /etc/ld.so.conf.d/*.conf' >"$root/etc/ld.so.conf"
echo 'hosts: files dns' >"$root/etc/nsswitch.conf"
ldconfig -r "$root"
rm -rf "$root/var/cache"

# It starts, from these files alone.
chroot "$root" /usr/bin/vantaged --version
