#!/bin/sh
# cppcheck and clang-tidy (.clang-tidy says which checks) over the code; 1 if either finds something.
# Debian: clang-tidy, cppcheck.
#   scripts/lint.sh [BUILD] [FOLDER...]    BUILD: a configured build folder that compiles file by file, default
#                                          build/lint, which is made; FOLDER: for clang-tidy, default all
set -eu
cd "$(dirname "$0")/.."

build=${1:-build/lint}
[ $# -eq 0 ] || shift
[ -f "$build/compile_commands.json" ] ||
  cmake --preset release -B "$build" -DCOUNTERPOINT_UNITY=OFF -DCOUNTERPOINT_PRECOMPILED_HEADERS=OFF >/dev/null
# Many files at a time hide behind the names of these, and clang-tidy would find none of them.
if grep -q '/Unity/unity_' "$build/compile_commands.json"; then
  echo "error: $build compiles many files at a time (COUNTERPOINT_UNITY); take another folder, or none" >&2
  exit 2
fi
failed=0
# What is left out: styles (inconclusive by nature), what needs the headers of other libraries, ends of functions (the
# compiler sees them, and knows what never returns), and views of strings that outlive the call they are passed to.
cppcheck --quiet --std=c++20 --language=c++ --enable=warning,performance,portability \
  -I include --inline-suppr --suppress=missingIncludeSystem --suppress=missingReturn \
  --suppress=invalidLifetime:include/counterpoint/engine/io/bytes.h \
  --suppress=danglingTemporaryLifetime:include/counterpoint/engine/io/bytes.h --error-exitcode=1 \
  model collision contact engine apps || failed=1
for folder in ${*:-model collision contact engine apps}; do
  log="$build/tidy_$folder.log"
  run-clang-tidy -quiet -extra-arg=-Wno-unknown-warning-option -p "$build" "$PWD/$folder/.*\.cc" \
    2>/dev/null >"$log" || true
  if grep -E "(warning|error):" "$log" | sort -u; then failed=1; fi
done
exit $failed
