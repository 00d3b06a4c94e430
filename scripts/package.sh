#!/bin/sh
# Writes the Debian packages counterpoint, libcounterpoint-dev and python3-counterpoint into
# build/packages, from the build of the release preset.
set -eu
cd "$(dirname "$0")/.."
for tool in dpkg-shlibdeps file; do
  command -v $tool >/dev/null || { echo "error: $tool is missing (apt-get install dpkg-dev file)" >&2; exit 2; }
done
# Built without MPI, which would become a dependency. Afterwards the build is configured with MPI
# (if it is found) and with its previous prefix again.
prefix=$(sed -n 's/^CMAKE_INSTALL_PREFIX:PATH=//p' build/release/CMakeCache.txt 2>/dev/null || true)
trap 'cmake --preset release -DCOUNTERPOINT_MPI=AUTO "-DCMAKE_INSTALL_PREFIX=${prefix:-/usr/local}" >/dev/null' EXIT
cmake --preset release -DCMAKE_INSTALL_PREFIX=/usr -DCMAKE_INSTALL_LIBDIR=lib -DCOUNTERPOINT_MPI=OFF >/dev/null
cmake --build --preset release --target counterpoint
if cmake --build --preset release --target help | grep -q "^counterpoint_python:"; then
  cmake --build --preset release --target counterpoint_python
fi
cpack --config build/release/CPackConfig.cmake -B build/packages
ls -l build/packages/*.deb
