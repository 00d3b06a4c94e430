#!/bin/sh
# Builds everything with GCC 12 and Clang 14, portable and native, with warnings as errors, and runs
# every test with each: once a week, hours on two cores. The builds stay in build/weekly.
#   scripts/release/compilers.sh                      all four
#   scripts/release/compilers.sh clang++-14 native    one
set -eu
cd "$(dirname "$0")/../.."
case "${2:-release}" in release | native) ;; *) echo "error: '$2' is no kind; release or native is expected" >&2; exit 2 ;; esac
compilers=${1:-g++-12 clang++-14}
kinds=${2:-release native}
for compiler in $compilers; do
  command -v "$compiler" >/dev/null || { echo "error: $compiler is missing (apt-get install g++-12 clang-14)" >&2; exit 2; }
done
passed=0 failed=0
for compiler in $compilers; do
  for kind in $kinds; do
    build=build/weekly/$compiler-$kind
    echo "== $compiler, $kind: $build"
    if cmake --preset "$kind" -B "$build" -DCMAKE_CXX_COMPILER="$compiler" -DCOUNTERPOINT_UNITY=ON >/dev/null &&
      cmake --build "$build" && ctest --test-dir "$build" --output-on-failure -j 2; then
      passed=$((passed + 1))
    else
      echo "FAILED: $compiler, $kind"
      failed=$((failed + 1))
    fi
  done
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
