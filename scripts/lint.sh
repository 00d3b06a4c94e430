#!/bin/sh
# Runs cppcheck and clang-tidy (checks in .clang-tidy) over the code; exits with 1 if either finds
# something. Debian: clang-tidy, cppcheck.
#   scripts/lint.sh [BUILD] [FOLDER...]    BUILD: a configured build folder without unity builds,
#                                          default build/lint, which is created; FOLDER: for
#                                          clang-tidy, default all
set -eu
cd "$(dirname "$0")/.."

build=${1:-build/lint}
[ $# -eq 0 ] || shift
[ -f "$build/compile_commands.json" ] ||
  cmake --preset release -B "$build" -DCOUNTERPOINT_UNITY=OFF -DCOUNTERPOINT_PRECOMPILED_HEADERS=OFF >/dev/null
# Unity builds list only their combined files, and clang-tidy would find none of the sources.
if grep -q '/Unity/unity_' "$build/compile_commands.json"; then
  echo "error: $build compiles many files at a time (COUNTERPOINT_UNITY); take another folder, or none" >&2
  exit 2
fi
failed=0
# Left out: style checks (inconclusive by nature), checks that need the headers of other libraries,
# missing returns (the compiler checks them and knows functions that never return), and string views
# that outlive the call they are passed to.
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
