#!/bin/sh
# Installs artefacts in bare Debian systems and tries them there, without sources or compilers.
#   scripts/smoke.sh ROOTS ARTEFACT...
#   scripts/smoke.sh /tmp/roots build/packages/counterpoint-* build/packages/*.deb
# ROOTS: folder of the systems, bookworm and trixie; missing ones are made there by debootstrap, with
# python3 and numpy alone. SUITES="bookworm" chooses. Each trial works in a copy of a system. Needs
# root. The last line counts what passed, failed and was skipped; exit code 1 if something failed.
set -eu
cd "$(dirname "$0")/.."
[ $# -ge 2 ] || { sed -n '2,8s/^# \{0,1\}//p' scripts/smoke.sh >&2; exit 2; }
[ "$(id -u)" -eq 0 ] || { echo "error: chroot needs root; run this as root" >&2; exit 2; }
mkdir -p "$1"
roots=$(realpath "$1")
shift
for artefact in "$@"; do
  [ -f "$artefact" ] || { echo "error: $artefact: there is no such file; scripts/package.sh and scripts/wheel.sh make them" >&2; exit 2; }
done
# shellcheck disable=SC1091  # a file of this system
host=$(. /etc/os-release && echo "$VERSION_CODENAME")
trial=$roots/trial
log=$roots/trial.log
clear_trial() {
  ! mountpoint -q "$trial/proc" || umount "$trial/proc"
  rm -rf --one-file-system "$trial"
}
trap clear_trial EXIT
passed=0 failed=0 skipped=0
skip() { echo "SKIPPED $1"; skipped=$((skipped + 1)); }

inside() { chroot "$trial" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive sh -euc "$1"; }

# try NAME COMMANDS: runs COMMANDS in the trial's system.
try() {
  if inside "$2" > "$log" 2>&1 < /dev/null; then
    echo "ok      $suite: $1${3:+: $(tail -1 "$log")}"
    passed=$((passed + 1))
  else
    echo "FAILED  $suite: $1"
    tail -15 "$log" | sed 's/^/        /'
    failed=$((failed + 1))
  fi
}

fresh() {
  clear_trial
  cp -a "$roots/$suite" "$trial"
  mount -t proc proc "$trial/proc"  # the loader finds libraries beside a program by it
  cp /etc/resolv.conf "$trial/etc/"
  mkdir -p "$trial/opt/try/tests"
}

# try_command COMMAND: a version, a motion through HDF5, its inverse, a mesh, an SDF, a page.
try_command() {
  try "$1 --version" "$1 --version --json - 2>/dev/null | grep '\"version\"'" shown
  try "simulate, convert, inverse" "cd /tmp; $1 simulate humanoid_drop --duration 0.2 --output fall.h5 --view fall.html
    $1 convert fall.h5 fall.csv; $1 inverse humanoid_drop fall.csv --output u.csv; test -s fall.html; test -s u.csv"
  try "meshes" "$1 simulate hollow/nut_on_bolt --duration 0.01"
  try "SDF" "echo '<sdf version=\"1.9\"><model name=\"m\"><link name=\"l\"/></model></sdf>' > /tmp/m.sdf; $1 inspect /tmp/m.sdf"
}

# try_template FOLDER PREFIX: builds the template project against an installation.
try_template() {
  try "template project" "apt-get -qq install -y --no-install-recommends cmake g++ make
    cmake -S $1 -B /tmp/template -DCMAKE_PREFIX_PATH=$2; cmake --build /tmp/template
    /tmp/template/fall $2/share/counterpoint/scenes/cube_drop.yaml" shown
}

# shellcheck disable=SC2016  # for the shell inside
readme='sed -n "/^\`\`\`python/,/^\`\`\`/p" /opt/try/README.md | sed "1d;\$d" > /tmp/readme.py'

try_tarball() {
  fresh
  tar -xf "$1" -C "$trial/opt"
  prefix=/opt/$(basename "$1" .tar.xz)
  try_command "$prefix/bin/counterpoint"
  if [ "$suite" = "$host" ]; then
    depends=$(sed -n 's/^ *"\(libeigen3-dev.*\)".*/\1/p' cmake/CounterpointPackages.cmake | tr -d ,)
    try "packages behind the libraries" "apt-get -qq update; apt-get -qq install -y --no-install-recommends $depends"
    try_template "$prefix/share/doc/counterpoint/examples/template" "$prefix"
  else
    skip "$suite: template project against the tarball, whose static libraries are for $host"
  fi
}

try_wheel() {
  fresh
  tag=$(inside 'python3 -c "import sys; print(\"cp%d%d\" % sys.version_info[:2])"')
  case "$1" in
    *-"$tag"-*) ;;
    *) skip "$suite: $(basename "$1") is for another Python than its $tag"; return ;;
  esac
  cp "$1" "$trial/opt/"
  cp -r README.md data "$trial/opt/try/"
  try "pip install $(basename "$1")" "apt-get -qq update; apt-get -qq install -y --no-install-recommends python3-venv
    python3 -m venv --system-site-packages /opt/venv; /opt/venv/bin/pip install --no-index /opt/$(basename "$1")"
  try "README's example" "cd /opt/try; $readme; /opt/venv/bin/python /tmp/readme.py" shown
  mkdir -p "$trial/opt/try/apps"
  cp -r tests/python "$trial/opt/try/tests/"
  cp -r apps/python "$trial/opt/try/apps/"
  cp -r docs "$trial/opt/try/"
  try "tests of the Python module" "apt-get -qq install -y --no-install-recommends python3-pytest
    cd /opt/try; /opt/venv/bin/python -m pytest -q -p no:cacheprovider tests/python" shown
}

try_packages() {
  fresh
  mkdir -p "$trial/opt/debs"
  cp "$@" "$trial/opt/debs/"
  cp -r README.md data "$trial/opt/try/"
  try "apt-get install of $# packages" "apt-get -qq update; apt-get -qq install -y --no-install-recommends /opt/debs/*.deb"
  try_command counterpoint
  try "README's example with python3-counterpoint" "cd /opt/try; $readme; python3 /tmp/readme.py" shown
  try "documents" "test -s /usr/share/doc/counterpoint/docs/README.md; man -w counterpoint 2>/dev/null || test -s /usr/share/man/man1/counterpoint.1.gz"
  try_template /usr/share/doc/counterpoint/examples/template /usr
  try "apt-get purge" "apt-get -qq purge -y counterpoint libcounterpoint* python3-counterpoint; ! test -e /usr/share/counterpoint"
}

debs=$(for artefact in "$@"; do case "$artefact" in *.deb) echo "$artefact" ;; esac; done)
if [ -n "$debs" ] && command -v lintian >/dev/null; then
  # shellcheck disable=SC2086  # a list of files without spaces
  if lintian --fail-on error $debs > "$log" 2>&1; then
    echo "ok      lintian"
    passed=$((passed + 1))
  else
    echo "FAILED  lintian"
    grep '^E:' "$log"
    failed=$((failed + 1))
  fi
elif [ -n "$debs" ]; then
  skip "lintian, which is missing (apt-get install lintian)"
fi
for suite in ${SUITES:-bookworm trixie}; do
  if [ ! -d "$roots/$suite" ]; then
    command -v debootstrap >/dev/null || { skip "$suite: debootstrap is missing (apt-get install debootstrap)"; continue; }
    debootstrap --variant=minbase --include=python3,python3-numpy "$suite" "$roots/$suite" > "$log" 2>&1 < /dev/null ||
      { skip "$suite: debootstrap could not make it: $(tail -1 "$log")"; rm -rf "${roots:?}/$suite"; continue; }
  fi
  for artefact in "$@"; do
    case "$artefact" in
      *.tar.xz) try_tarball "$artefact" ;;
      *.whl) try_wheel "$artefact" ;;
      *.deb) ;;
      *) skip "$artefact is no .tar.xz, .whl or .deb" ;;
    esac
  done
  [ -n "$debs" ] || continue
  if [ "$suite" = "$host" ]; then
    # shellcheck disable=SC2086
    try_packages $debs
  else
    skip "$suite: Debian packages, which are for $host"
  fi
done
echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
