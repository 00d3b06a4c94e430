#!/bin/sh
# Builds with the address and undefined behaviour sanitizers and runs tests under them:
#   scripts/sanitize.sh                      those of model/ and contact/, and the fuzz corpora
#   scripts/sanitize.sh model_test 'Urdf*'   one executable, with a GoogleTest filter
# Not part of CI: with two cores the build alone takes longer than its tests.
set -eu
cd "$(dirname "$0")/.."

# FCL, assimp and qhull come from the system; what they hold until the end is not ours to free.
export ASAN_OPTIONS=detect_leaks=0:strict_string_checks=1
export UBSAN_OPTIONS=print_stacktrace=1
cmake --preset asan
if [ $# -gt 0 ]; then
  cmake --build --preset asan --target "$1"
  exec "build/asan/bin/$1" "--gtest_filter=${2:-*}"
fi
cmake --build --preset asan --target model_test contact_test tests/fuzz/all
build/asan/bin/model_test
build/asan/bin/contact_test
ctest --test-dir build/asan -R '^fuzz\.' --output-on-failure
