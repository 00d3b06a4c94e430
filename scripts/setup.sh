#!/bin/sh
# Installs the dependencies of Counterpoint on Debian 12, builds it, and runs it once. Safe to
# repeat.
#   scripts/setup.sh               packages, the command, main job, the Python module
#   scripts/setup.sh --build-only  packages, and all targets: tests, benchmarks
#   scripts/setup.sh --for-tests   the same, and Chromium, in which the tests open replays
set -eu
cd "$(dirname "$0")/.."

packages="g++ cmake ninja-build libeigen3-dev libfcl-dev libccd-dev liburdfdom-dev
liburdfdom-headers-dev libassimp-dev zlib1g-dev libyaml-cpp-dev libtinyxml2-dev libqhull-dev libpng-dev libfmt-dev
libmeshoptimizer-dev libsleef-dev libconsole-bridge-dev libcereal-dev libcli11-dev libboost-dev nlohmann-json3-dev libgtest-dev libbenchmark-dev"

# Optional: HDF5, for trajectories in .h5 files; libsdformat, for Gazebo's files; MuJoCo, for the
# comparison in `counterpoint hard-cases`; node and npm, which bundle the page of `counterpoint
# view`; the dependencies of the Python module; for the tests Chromium, pytest, and Open MPI, which
# spreads tasks over machines. Versions from other sources are used if present.
optional="libhdf5-dev libsdformat-dev libmujoco-dev pybind11-dev python3-dev python3-numpy"
{ command -v node && command -v npm; } >/dev/null || optional="$optional nodejs npm"
if [ "${1:-}" = --for-tests ]; then
  optional="$optional python3-pytest libopenmpi-dev openmpi-bin clang-format clang-tidy cppcheck"
  command -v chromium >/dev/null || optional="$optional chromium"
fi

not_installed() {
  for package in "$@"; do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q '^install ok installed$' ||
      printf ' %s' "$package"
  done
}

as_root=""
[ "$(id -u)" -eq 0 ] || as_root=sudo
add_packages() {
  # shellcheck disable=SC2068,SC2086  # lists of words
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends $@
}

# shellcheck disable=SC2086
missing=$(not_installed $packages)
# shellcheck disable=SC2086
missing_optional=$(not_installed $optional)
if [ "${1:-}" = "" ] && [ -z "$missing" ] && [ -n "$missing_optional" ] && [ -n "$as_root" ] && ! sudo -n true 2>/dev/null; then
  echo "Going on without (not needed, and no root here):$missing_optional"
elif [ -n "$missing$missing_optional" ]; then
  if [ -n "$as_root" ] && ! command -v sudo >/dev/null; then
    echo "run this as root, or install by hand:$missing; if wanted:$missing_optional" >&2
    [ -z "$missing" ] || exit 2
  else
    echo "Installing:$missing$missing_optional"
    $as_root apt-get update || [ -z "$missing" ]
    [ -z "$missing" ] || add_packages "$missing"
    for package in $missing_optional; do
      add_packages "$package" || echo "Going on without: $package"
    done
  fi
fi

# A new build folder uses unity builds: it compiles 24 files of a library or the command at a time.
# An existing build folder keeps its own setting.
unity=""
[ -e build/release/CMakeCache.txt ] || unity=-DCOUNTERPOINT_UNITY=ON
# shellcheck disable=SC2086  # one word or none
cmake --preset release $unity

# build TARGET: builds with one line that counts files, after an estimate of 5 s of processor time
# per file, 25 s for a batch of 24 (GCC 12 at 2 GHz).
build() {
  cores=$(nproc)
  objects=$(ninja -C build/release -t commands "$1" | grep -o ' -o [^ ]*\.o ' | while read -r _ object; do
    [ -e "build/release/$object" ] || echo "$object"
  done)
  files=$(echo "$objects" | wc -l)
  units=$(echo "$objects" | grep -c /Unity/ || true)
  seconds=$((files * 5 + units * 20))
  if [ "$seconds" -gt 100 ]; then
    echo "Building $1: $files files, about $((seconds / cores / 60 + 1)) minutes on $cores cores"
  fi
  NINJA_STATUS="[%f of %t, %p, %es] " cmake --build --preset release --target "$1"
}

case "${1:-}" in
  --build-only | --for-tests)
    build all
    exit
    ;;
esac
build counterpoint

# The main job: a humanoid falls; the forces behind the fall are recovered from its motion.
mkdir -p out
counterpoint=build/release/bin/counterpoint
$counterpoint simulate humanoid_drop --output out/fall.csv --json out/fall.json
$counterpoint inverse humanoid_drop out/fall.csv --output out/forces.csv --contacts out/contacts.csv \
  --json out/inverse.json
if $counterpoint view humanoid_drop out/fall.csv --contacts out/contacts.csv --output out/fall.html; then
  replay="  open out/fall.html in a browser: the humanoid falls, arrows are contact forces
  $counterpoint simulate quadruped_drop --view out/drop.html"
else
  replay="  (no replay of it: see above)"
fi
# Builds the Python module if its dependencies are installed.
python=""
if ninja -C build/release -t query counterpoint_python >/dev/null 2>&1; then
  build counterpoint_python
  python="  export PYTHONPATH=$PWD/build/release/python; python3   docs/guide/python.md"
fi
cat <<END

Written: out/fall.csv (the motion), out/forces.csv and out/contacts.csv (the forces behind it)
Next
$replay
  $counterpoint list scenes                       what else there is to try
  docs/guide/first-simulation.md                               the same step by step
${python:-  (no Python module: python3-dev, python3-numpy or pybind11-dev is missing)}
  scripts/test.sh                                              builds the rest and tests it
END
