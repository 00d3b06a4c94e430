#!/bin/sh
# cppcheck and clang-tidy (.clang-tidy says which checks) over the code; 1 if either finds something.
# Debian: clang-tidy, cppcheck.
#   scripts/lint.sh [BUILD] [FOLDER...]    BUILD: a configured build folder, default build/release;
#                                          FOLDER: for clang-tidy, default all
set -eu
cd "$(dirname "$0")/.."

build=${1:-build/release}
[ $# -eq 0 ] || shift
[ -f "$build/compile_commands.json" ] || cmake --preset release
failed=0
# What is left out: styles (inconclusive by nature), and what needs the headers of other libraries.
cppcheck --quiet --std=c++20 --language=c++ --enable=warning,performance,portability \
  -I include --inline-suppr --suppress=missingIncludeSystem --error-exitcode=1 \
  model collision contact engine apps || failed=1
for folder in ${*:-model collision contact engine apps}; do
  log="$build/tidy_$folder.log"
  run-clang-tidy -quiet -extra-arg=-Wno-unknown-warning-option -p "$build" "$PWD/$folder/.*\.cc" \
    2>/dev/null >"$log" || true
  if grep -E "(warning|error):" "$log" | sort -u; then failed=1; fi
done
exit $failed
