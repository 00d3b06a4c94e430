#!/bin/sh
# Installs what Counterpoint needs on Debian 12, builds it, and runs it once. Safe to repeat.
#   scripts/setup.sh               packages, release build, main job
#   scripts/setup.sh --build-only  packages and release build
set -eu
cd "$(dirname "$0")/.."

packages="g++ cmake ninja-build libeigen3-dev libfcl-dev libccd-dev liburdfdom-dev
liburdfdom-headers-dev libassimp-dev zlib1g-dev libyaml-cpp-dev libtinyxml2-dev libqhull-dev libpng-dev libfmt-dev
libconsole-bridge-dev libcli11-dev nlohmann-json3-dev libgtest-dev libbenchmark-dev"

missing=""
for package in $packages; do
  dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q '^install ok installed$' ||
    missing="$missing $package"
done
if [ -n "$missing" ]; then
  echo "Installing:$missing"
  as_root=""
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || {
      echo "error: run this as root, or install by hand:$missing" >&2
      exit 2
    }
    as_root=sudo
  fi
  $as_root apt-get update
  # shellcheck disable=SC2086  # a list of words
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends $missing
fi

cmake --preset release
cmake --build --preset release
[ "${1:-}" = --build-only ] && exit 0

# The main job: a humanoid falls; the forces behind the fall are recovered from its motion.
mkdir -p out
build/release/bin/counterpoint simulate data/scenes/humanoid_drop.yaml --output out/fall.csv \
  --json out/fall.json
build/release/bin/counterpoint inverse data/scenes/humanoid_drop.yaml out/fall.csv \
  --output out/forces.csv --contacts out/contacts.csv --json out/inverse.json
echo "Written: out/fall.csv (motion), out/forces.csv and out/contacts.csv (what moved it)"
