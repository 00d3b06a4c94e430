#!/bin/sh
# clang-tidy (.clang-tidy says which checks) and cppcheck over model/ and contact/; 1 if either finds
# something. Debian: clang-tidy, cppcheck.
#   scripts/lint.sh [BUILD]    BUILD: a configured build folder, default build/release
set -eu
cd "$(dirname "$0")/.."

build=${1:-build/release}
[ -f "$build/compile_commands.json" ] || cmake --preset release
failed=0
run-clang-tidy -quiet -extra-arg=-Wno-unknown-warning-option -p "$build" "$PWD/(model|contact)/[^/]*\.cc" 2>/dev/null >"$build/tidy.log" || true
if grep -E "(warning|error):" "$build/tidy.log" | sort -u; then failed=1; fi
# What is left out: styles (inconclusive by nature), and what needs the headers of other libraries.
cppcheck --quiet --std=c++20 --language=c++ --enable=warning,performance,portability \
  --inline-suppr --suppress=missingIncludeSystem --error-exitcode=1 \
  model contact || failed=1
exit $failed
