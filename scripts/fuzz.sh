#!/bin/sh
# Builds the fuzz targets with Clang and runs each for a while:
#   scripts/fuzz.sh [SECONDS] [TARGET...]
# Exits with 1 if an input crashes, hangs or leaks; the input is written to out/fuzz/.
set -eu
cd "$(dirname "$0")/.."

seconds=${1:-60}
[ $# -eq 0 ] || shift
targets=${*:-$(ls tests/fuzz/corpus)}

cmake -G Ninja -B build/fuzz -S . -DCMAKE_BUILD_TYPE=RelWithDebInfo \
  "-DCMAKE_CXX_FLAGS_RELWITHDEBINFO=-O1 -g1" -DCMAKE_CXX_COMPILER=clang++ \
  -DCOUNTERPOINT_BUILD_FUZZERS=ON
cmake --build build/fuzz --target counterpoint_fuzz
failed=0
for target in $targets; do
  mkdir -p "out/fuzz/$target"
  longest=16384
  [ "$target" != hdf5 ] || longest=100000  # a block of rows takes 64 kB
  FUZZ_TARGET=$target ASAN_OPTIONS=detect_leaks=0 build/fuzz/bin/counterpoint_fuzz "out/fuzz/$target" "tests/fuzz/corpus/$target" \
    "-dict=tests/fuzz/dictionaries/$target.dict" "-artifact_prefix=out/fuzz/$target-" \
    "-max_total_time=$seconds" -timeout=20 -rss_limit_mb=4096 "-max_len=$longest" -print_final_stats=1 \
    >"out/fuzz/$target.log" 2>&1 || { failed=1; echo "$target: found something"; }
  grep -E "cov: " "out/fuzz/$target.log" | tail -n 1
done
exit $failed
