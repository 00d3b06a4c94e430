#!/bin/sh
# Writes into build/packages, from the build of the release preset: the Debian packages counterpoint,
# libcounterpoint0.1, libcounterpoint-dev, python3-counterpoint and counterpoint-doc; and a tarball
# with the command, the libraries and all that they need, to be unpacked anywhere.
set -eu
cd "$(dirname "$0")/.."
for tool in dpkg-shlibdeps file patchelf xz; do
  command -v $tool >/dev/null || { echo "error: $tool is missing (apt-get install dpkg-dev file patchelf xz-utils)" >&2; exit 2; }
done
# Built without MPI, which would become a dependency. Afterwards the build is configured with MPI
# (if it is found) and with its previous prefix again.
prefix=$(sed -n 's/^CMAKE_INSTALL_PREFIX:PATH=//p' build/release/CMakeCache.txt 2>/dev/null || true)
trap 'cmake --preset release -DCOUNTERPOINT_MPI=AUTO "-DCMAKE_INSTALL_PREFIX=${prefix:-/usr/local}" >/dev/null' EXIT
cmake --preset release -DCMAKE_INSTALL_PREFIX=/usr -DCOUNTERPOINT_MPI=OFF >/dev/null
cmake --build --preset release --target counterpoint counterpoint_live_shared
if ninja -C build/release -t query counterpoint_python >/dev/null 2>&1; then
  cmake --build --preset release --target counterpoint_python
fi
rm -f build/packages/*.deb build/packages/*.tar.xz
cpack --config build/release/CPackConfig.cmake -B build/packages
# The tarball has lib/ in place of Debian's lib/x86_64-linux-gnu/.
cmake --preset release -DCMAKE_INSTALL_PREFIX=/opt -DCMAKE_INSTALL_LIBDIR=lib >/dev/null
version=$(sed -n 's/^set(CPACK_PACKAGE_VERSION "\(.*\)")/\1/p' build/release/CPackConfig.cmake)
name=counterpoint-$version-linux-$(uname -m)
unpacked=$PWD/build/packages/$name
rm -rf "$unpacked"
for component in library command development documents; do
  cmake --install build/release --prefix "$unpacked" --component $component --strip >/dev/null
done
cp LICENSE "$unpacked/"
scripts/release/bundle_libraries.sh "$unpacked/lib/counterpoint" "$unpacked/bin/counterpoint" \
  "$unpacked"/lib/libcounterpoint_live.so.* "$unpacked"/lib/counterpoint/*.so
tar -C build/packages -cJf "build/packages/$name.tar.xz" "$name"
rm -r "$unpacked"
ls -l build/packages/*.deb "build/packages/$name.tar.xz"
