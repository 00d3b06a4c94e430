#!/bin/sh
# Builds with the address and undefined behaviour sanitizers (preset asan, with Eigen's assertions)
# and runs tests:
#   scripts/sanitize.sh                      all tests; most of an hour on two cores, not part of CI
#   scripts/sanitize.sh --inputs             code that reads files (tests of model/, fuzz corpora);
#                                            part of CI
#   scripts/sanitize.sh model_test 'Urdf*'   one executable, with a GoogleTest filter
set -eu
cd "$(dirname "$0")/.."

# Leaks are not reported, because FCL, assimp and qhull of the system hold memory until the end.
export ASAN_OPTIONS=detect_leaks=0:strict_string_checks=1
export UBSAN_OPTIONS=print_stacktrace=1
# Same as in scripts/setup.sh: a new build folder uses unity builds.
unity=""
[ -e build/asan/CMakeCache.txt ] || unity=-DCOUNTERPOINT_UNITY=ON
# shellcheck disable=SC2086  # one word or none
cmake --preset asan $unity
case "${1:-}" in
  "")
    cmake --build --preset asan
    exec ctest --preset asan
    ;;
  --inputs)
    cmake --build --preset asan --target model_test tests/fuzz/all
    build/asan/bin/model_test --gtest_brief=1
    exec ctest --preset asan -R '^fuzz\.'
    ;;
  *)
    cmake --build --preset asan --target "$1"
    exec "build/asan/bin/$1" "--gtest_filter=${2:-*}"
    ;;
esac
