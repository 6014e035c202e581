#!/usr/bin/env bash
# install.sh PURPOSE...: the Debian packages, and what comes from npm, that each purpose needs. Only
# what is missing, so that a second run is silent.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"

declare -A packages=(
  # What core needs by itself: -DVANTAGE_SERVICE=OFF.
  [core]="g++ cmake ninja-build ccache
    libabsl-dev libeigen3-dev libceres-dev liboctomap-dev libembree-dev libtbb-dev libboost-dev
    libssl-dev libzstd-dev liblzf-dev libpugixml-dev libassimp-dev libdxflib-dev libpng-dev libcli11-dev pkg-config libgtest-dev libgmock-dev libbenchmark-dev
    libpcl-common1.13 libpcl-kdtree1.13 libpcl-search1.13 libpcl-octree1.13
    libpcl-sample-consensus1.13 libpcl-features1.13 libpcl-filters1.13 libpcl-segmentation1.13
    libpcl-registration1.13"
  [service]="libgrpc++-dev libprotobuf-dev protobuf-compiler protobuf-compiler-grpc
    libsqlite3-dev libmicrohttpd-dev libqrencode-dev zlib1g-dev nlohmann-json3-dev libtomlplusplus-dev libcpp-jwt-dev libcairo2-dev fonts-dejavu-core"
  [study]="coinor-cbc" # the fewest positions, by integer programming
  # HAProxy: who calls is known behind it.
  [test]="coinor-cbc python3-grpcio haproxy openssl zsh fish"
  [format]="git clang-format-14"
  [shell]="git shellcheck"
  [tidy]="git clang-14 clang-tidy-14 python3"
  [sanitizers]="git clang-14 libclang-rt-14-dev llvm-14 python3"
  [attack]="python3-grpcio haproxy openssl"
  # The wheel and its types; vantage_core, which the packages have, too; an example that plots.
  [python]="protobuf-compiler protobuf-compiler-grpc python3-pip python3-venv python3-setuptools python3-wheel
    python3-grpcio python3-protobuf python3-numpy python3-matplotlib mypy pybind11-dev python3-dev"
  # 64-bit ARM: the compiler, and what runs its programs.
  [arm64]="g++-aarch64-linux-gnu qemu-user-static"
  [package]="help2man dpkg-dev file pybind11-dev python3-dev"
  # What really runs the image, and checks what it is deployed with.
  [containers]="podman runc debootstrap haproxy openssl python3-grpcio python3-yaml"
  [deploy]="haproxy openssl docker-compose python3-yaml systemd"
  [pages]="openssl curl python3 jq help2man man-db groff-base" # what the commands of the pages use besides
  [npm]="nodejs npm"
  # The page in browsers: in Chromium, and in the engine of many tablets, which needs a display.
  [web]="chromium fonts-dejavu-core"
  [webkit]="webkit2gtk-driver xvfb"
)
buf_version=1.75.0
kubernetes_types=(typescript@5.6.3 kubernetes-types@1.30.0)

as_root() {
  local become=()
  if ((EUID != 0)); then
    command -v sudo >/dev/null || die "installing packages needs root or sudo: $*"
    become=(sudo)
  fi
  "${become[@]}" env DEBIAN_FRONTEND=noninteractive "$@"
}

apt_get() {
  # dpkg syncs every file by itself unless told otherwise, which is half of the time.
  as_root apt-get -q -y -o DPkg::Lock::Timeout=600 -o Dpkg::Options::=--force-unsafe-io \
    -o Acquire::Retries=3 "$@"
}

apt_update() {
  # The lock on the package lists knows no time-out, so another apt-get is waited for here.
  local try
  for try in 1 2 3 4 5 6; do
    apt_get update && return
    echo "apt-get update failed, try $try of 6"
    sleep 10
  done
  return 1
}

apt_install() {
  # Lists of the last hour do: the stages of one run install one after the other.
  if [[ -z $(find /var/lib/apt/lists -maxdepth 1 -name '*Packages*' -cmin -60 2>/dev/null) ]]; then
    apt_update || return
  fi
  apt_get install --no-install-recommends "$@" && return
  # An installation that was cut off before, by a stage's limit or by hand, is ended first.
  as_root dpkg --configure -a --force-unsafe-io
  apt_update && apt_get install --no-install-recommends "$@"
}

install_packages() {
  local purpose name missing=()
  for purpose in "$@"; do
    for name in ${packages[$purpose]}; do
      [[ $(dpkg-query -W -f='${db:Status-Status}' "$name" 2>/dev/null) == installed ]] ||
        missing+=("$name")
    done
  done
  ((${#missing[@]})) || return 0
  say "installing for $*: ${missing[*]}"
  quietly "apt-$1" apt_install "${missing[@]}"
}

# libpcl-dev depends on VTK and Qt (2.9 GB); its headers and FLANN's need neither.
unpack_pcl_headers() {
  local to=$root/build/pcl deb
  [[ -e $to/.done ]] && return
  say "unpacking PCL's headers into build/pcl"
  rm -rf "$to"
  mkdir -p "$to/deb"
  (
    cd "$to/deb"
    download=(apt-get -q -o Acquire::Retries=3 download libpcl-dev libflann-dev)
    # Root's downloads are handed to the user _apt, who may not be able to write here.
    ((EUID != 0)) || download+=(-o APT::Sandbox::User=root)
    quietly pcl-headers "${download[@]}" || {
      quietly apt-update apt_update
      quietly pcl-headers "${download[@]}"
    }
    for deb in *.deb; do dpkg-deb -x "$deb" "$to"; done
  )
  rm -rf "$to/deb"
  touch "$to/.done"
}

# What is compiled against for 64-bit ARM, into build/arm64-sysroot. It is unpacked, not installed: dpkg
# knows nothing of it, and this machine's packages stay as they are. A list of its own, since apt's is
# of this machine's architecture.
unpack_arm64() {
  local to=$root/build/arm64-sysroot deb mirror name link
  # What is needed may have changed since.
  local wanted="${packages[core]} ${packages[service]}"
  [[ -e $to/.done && $(<"$to/.done") == "$wanted" ]] && return
  say "unpacking the libraries for arm64 into build/arm64-sysroot"
  rm -rf "$to"
  mkdir -p "$to/apt/lists/partial" "$to/apt/cache/archives/partial"
  : >"$to/apt/status"
  mirror=${VANTAGE_DEBIAN_MIRROR:-http://deb.debian.org/debian}
  echo "deb [arch=arm64] $mirror bookworm main" >"$to/apt/sources.list"
  local apt=(apt-get -q -y -o APT::Architecture=arm64 -o APT::Architectures=arm64
    -o Dir::State="$to/apt" -o Dir::State::status="$to/apt/status" -o Dir::Cache="$to/apt/cache"
    -o Dir::Etc::sourcelist="$to/apt/sources.list" -o Dir::Etc::sourceparts=/dev/null
    -o Acquire::Retries=3 -o APT::Sandbox::User=root -o Debug::NoLocking=1)
  # Of those for this machine, what is a library, and headers of such.
  local libraries=()
  for name in $wanted libc6-dev libstdc++-12-dev; do
    [[ $name == lib* || $name == *-dev ]] && libraries+=("$name")
  done
  quietly arm64-update "${apt[@]}" update
  quietly arm64-download "${apt[@]}" install --download-only --no-install-recommends \
    "${libraries[@]}"
  for deb in "$to"/apt/cache/archives/*.deb; do dpkg-deb -x "$deb" "$to"; done
  # What packages do when they are installed: which BLAS and LAPACK there is.
  for name in libblas.so libblas.so.3 liblapack.so liblapack.so.3; do
    ln -sf "atlas/$name" "$to/usr/lib/aarch64-linux-gnu/$name"
  done
  # Links that say where something is installed lead to what was unpacked.
  find "$to" -type l -lname '/*' | while read -r link; do
    ln -sfnr "$to$(readlink "$link")" "$link"
  done
  # Some name what they are linked with, or themselves, by where it is installed.
  sed -i "s|\([;:\"]\)/usr/lib/|\1$to/usr/lib/|g" \
    "$to"/usr/lib/*/cmake/{Ceres,draco,assimp-5.2}/*.cmake
  # What generates code runs on this machine, and gRPC's CMake package looks for it there.
  mkdir -p "$to/usr/bin"
  ln -sf /usr/bin/grpc_*_plugin "$to/usr/bin/"
  rm -rf "$to/apt"
  echo "$wanted" >"$to/.done"
}

# from_npm FOLDER PACKAGE@VERSION...: into build/FOLDER. Fails where npm cannot be had or reached.
from_npm() {
  local to=build/$1 name missing=()
  shift
  for name in "$@"; do
    [[ $(sed -n 's/^  "version": "\(.*\)",$/\1/p' "$to/node_modules/${name%@*}/package.json" \
      2>/dev/null) == "${name##*@}" ]] || missing+=("$name")
  done
  ((${#missing[@]})) || return 0
  command -v npm >/dev/null || install_packages npm || return
  say "installing from npm into $to: ${missing[*]}"
  mkdir -p "$to"
  # Where the registry is not reached, that is soon clear.
  quietly "npm-${to##*/}" timeout 60 npm install --prefix "$to" --no-save --no-audit --no-fund \
    --fetch-retries=2 --fetch-retry-mintimeout=1000 --fetch-retry-maxtimeout=3000 \
    --fetch-timeout=15000 "$@"
}

# What the page is built with, as its lock file has it. Fails where npm cannot be had or reached.
install_page_packages() {
  local to=client/web
  [[ $to/node_modules/.package-lock.json -nt $to/package-lock.json ]] && return
  command -v npm >/dev/null || install_packages npm || return
  say "installing from npm into $to"
  quietly npm-web timeout 300 npm ci --prefix "$to" --no-audit --no-fund \
    --fetch-retries=2 --fetch-retry-mintimeout=1000 --fetch-retry-maxtimeout=3000 \
    --fetch-timeout=30000
  touch "$to/node_modules/.package-lock.json"
}

install() {
  case $1 in
    core)
      install_packages core
      # The headers; the libraries are packages.
      unpack_pcl_headers
      ;;
    build)
      install_packages core service
      unpack_pcl_headers
      ;;
    bench) install build ;;
    test | study | package | tidy | sanitizers | attack | pages)
      install build
      install_packages "$1"
      ;;
    arm64)
      install_packages arm64
      unpack_arm64
      ;;
    containers)
      install package
      install_packages containers
      ;;
    format | shell | python) install_packages "$1" ;;
    page) install_page_packages ;;
    web)
      install_page_packages
      install_packages web
      # Its test says by itself that it was skipped.
      install_packages webkit || say "WebKit cannot be had"
      ;;
    proto) from_npm node "@bufbuild/buf@$buf_version" ;;
    deploy)
      install_packages deploy
      # Its test of types says by itself that it was skipped.
      from_npm node-deploy "${kubernetes_types[@]}" || say "no types from npm"
      ;;
    *) die "install for what? ${!packages[*]}, bench, page or proto; not '$1'" ;;
  esac
}

for purpose in "$@"; do install "$purpose"; done
