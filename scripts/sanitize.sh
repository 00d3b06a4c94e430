#!/bin/sh
# Builds with the address and undefined behaviour sanitizers (preset asan; Eigen's assertions are on
# there too) and runs tests under them:
#   scripts/sanitize.sh                      everything; most of an hour on two cores, not part of CI
#   scripts/sanitize.sh --inputs             what reads files: tests of model/, fuzz corpora; part of CI
#   scripts/sanitize.sh model_test 'Urdf*'   one executable, with a GoogleTest filter
set -eu
cd "$(dirname "$0")/.."

# FCL, assimp and qhull come from the system; what they hold until the end is not ours to free.
export ASAN_OPTIONS=detect_leaks=0:strict_string_checks=1
export UBSAN_OPTIONS=print_stacktrace=1
# As scripts/setup.sh: a build from nothing compiles many files at a time.
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
