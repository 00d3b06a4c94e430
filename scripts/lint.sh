#!/bin/sh
# Runs cppcheck and clang-tidy (checks in .clang-tidy) over the code; exits with 1 if either finds
# something. Debian: clang-tidy, cppcheck.
#   scripts/lint.sh [FOLDER...]    FOLDER: for clang-tidy, default all
# clang-tidy reads all files of a library or program at a time (build/lint): most of its time goes to
# the headers.
set -eu
cd "$(dirname "$0")/.."
for tool in cppcheck clang-tidy; do
  command -v $tool >/dev/null || { echo "error: $tool is missing (Debian: $tool)" >&2; exit 2; }
done

build=build/lint
cmake --preset release -B $build -DCOUNTERPOINT_UNITY=ON -DCOUNTERPOINT_UNITY_BATCH=1000 \
  -DCOUNTERPOINT_PRECOMPILED_HEADERS=OFF -DCMAKE_CXX_COMPILER_LAUNCHER= >/dev/null
failed=0
# Left out: style checks (inconclusive by nature), checks that need the headers of other libraries,
# and missing returns (the compiler checks them and knows functions that never return).
mkdir -p $build/cppcheck
cppcheck --quiet --std=c++20 --language=c++ --enable=warning,performance,portability \
  -I include --inline-suppr --suppress=missingIncludeSystem --suppress=missingReturn \
  -j "$(nproc)" --cppcheck-build-dir=$build/cppcheck --error-exitcode=1 \
  model collision contact engine apps || failed=1

folders=$(echo "${*:-model collision contact engine apps}" | tr ' ' '|')
# The largest come first. The page of replays (program.cc) is a list of numbers.
files=$(grep -o '"file": "[^"]*"' $build/compile_commands.json | cut -d '"' -f 4 | sort -u |
  grep -E "^$PWD/($build/)?($folders)/" | grep -v /program.cc | xargs ls -S)
# -w: the compilers' own warnings are theirs to give.
echo "$files" | xargs -P "$(nproc)" -n 1 clang-tidy -quiet -extra-arg=-w -p $build \
  >$build/tidy.log 2>$build/tidy_progress.log || failed=1
if grep -E "(warning|error):" $build/tidy.log | sort -u; then failed=1; fi
[ $failed -eq 0 ] || echo "lint.sh found something; more of it: $build/tidy.log" >&2
exit $failed
