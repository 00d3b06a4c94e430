#!/bin/sh
# Builds the wheel of the Python module into build/packages. It has every shared library inside and
# runs with the glibc of this system or a later one.
#   scripts/wheel.sh         for python3 of this system
#   scripts/wheel.sh ROOT    for python3 of the Debian or Ubuntu below ROOT, which has the packages
#                            libpython3-dev python3-numpy python3-numpy-dev pybind11-dev
set -eu
cd "$(dirname "$0")/.."
/usr/bin/python3 -c "import wheel" 2>/dev/null ||
  { echo "error: the module wheel is missing (apt-get install python3-wheel)" >&2; exit 2; }
build=$PWD/build/wheel
mkdir -p "$build"
if [ $# -eq 0 ]; then
  python=/usr/bin/python3
  set -- -DCOUNTERPOINT_PYTHON_STUBS=ON
else
  # The compiler is this system's; the other Python gives its headers and answers CMake's questions.
  # Type stubs are those of this system's Python, whose wheel is therefore built first.
  root=$(realpath "$1")
  python=$build/python-of-$(basename "$root")
  printf '#!/bin/sh\nexec chroot "%s" /usr/bin/python3 "$@"\n' "$root" > "$python"
  chmod +x "$python"
  headers=$build/headers-of-$(basename "$root")
  name=$("$python" -c 'import sys; print("python%d.%d" % sys.version_info[:2])')
  numpy=$root$("$python" -c 'import numpy, os; print(os.path.realpath(numpy.get_include()))')
  rm -rf "$headers"
  mkdir -p "$headers/lib/cmake" "$headers/include/x86_64-linux-gnu"
  cp -r "$root/usr/lib/cmake/pybind11" "$headers/lib/cmake/"
  cp -r "$root/usr/include/pybind11" "$root/usr/include/$name" "$headers/include/"
  cp -r "$root/usr/include/x86_64-linux-gnu/$name" "$headers/include/x86_64-linux-gnu/"
  set -- -DCOUNTERPOINT_PYTHON_STUBS=OFF "-DPython_INCLUDE_DIR=$headers/include/$name" \
    "-DPython_NumPy_INCLUDE_DIR=$numpy" "-Dpybind11_DIR=$headers/lib/cmake/pybind11"
fi
cmake --preset release -B "$build" -U 'Python_*' -U '_Python_*' -U 'PYTHON_*' -U 'PYBIND11_*' -U pybind11_DIR \
  -DCOUNTERPOINT_UNITY=ON -DCOUNTERPOINT_BUILD_TESTS=OFF -DCOUNTERPOINT_BUILD_BENCHMARKS=OFF \
  -DCOUNTERPOINT_MPI=OFF -DCOUNTERPOINT_BUILD_PYTHON=ON -DCOUNTERPOINT_PYTHON_INSTALL_DIR:STRING=. \
  "-DPython_EXECUTABLE=$python" "$@" >/dev/null
cmake --build "$build" --target counterpoint_python

version=$(sed -n 's/^version = "\(.*\)"/\1/p' pyproject.toml)
stage=$build/stage
rm -rf "$stage"
cmake --install "$build" --component python --prefix "$stage" --strip >/dev/null
# NumPy 2 needs pybind11 2.12; systems with NumPy 1 have an older one.
limit=$("$python" -c 'import numpy; print("<2" if numpy.__version__ < "2" else "")')
tag=$("$python" -c 'import sys; print("cp%d%d" % sys.version_info[:2])')
glibc=$(getconf GNU_LIBC_VERSION | sed 's/glibc //; s/\./_/')
info=$stage/counterpoint-$version.dist-info
mkdir -p "$info"
cat > "$info/METADATA" <<END
Metadata-Version: 2.1
Name: counterpoint
Version: $version
Summary: $(sed -n 's/^description = "\(.*\)"/\1/p' pyproject.toml)
License: Apache-2.0
Requires-Python: >=3.9
Requires-Dist: numpy>=1.21${limit:+,$limit}
END
cat > "$info/WHEEL" <<END
Wheel-Version: 1.0
Generator: scripts/wheel.sh
Root-Is-Purelib: false
Tag: $tag-$tag-manylinux_${glibc}_$(uname -m)
END
cp LICENSE "$info/"
scripts/release/bundle_libraries.sh "$stage/counterpoint.libs" "$stage"/counterpoint/*.so
mkdir -p build/packages
/usr/bin/python3 -m wheel pack "$stage" --dest-dir build/packages
