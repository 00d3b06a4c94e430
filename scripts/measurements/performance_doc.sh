#!/bin/sh
# Compares Counterpoint with Pinocchio and MuJoCo (docs/measurements/performance.md): builds the
# benchmark with Clang for this processor and with link-time optimization, as MuJoCo is built by
# default, runs it, and writes its figures and picture.
#   scripts/measurements/performance_doc.sh ROBOTS [PREFIX]
# TABLES in the environment, separated by commas: algorithms, steps (default both), derivatives,
# scale, piles, robots, softness. ROBOTS: folder below which the URDFs of robots are searched.
# PREFIX: where the other engines are installed.
set -eu
[ $# -ge 1 ] || { echo "usage: scripts/measurements/performance_doc.sh ROBOTS [PREFIX]" >&2; exit 2; }
robots=$(realpath "$1")
prefix=${2:+$(realpath "$2")}
cd "$(dirname "$0")/../.."
cmake -G Ninja -B build/peers -S . -DCMAKE_BUILD_TYPE=Release -DCMAKE_C_COMPILER=clang \
  -DCMAKE_CXX_COMPILER=clang++ -DCOUNTERPOINT_NATIVE=ON -DCMAKE_INTERPROCEDURAL_OPTIMIZATION=ON \
  -DCOUNTERPOINT_BUILD_BENCHMARKS=ON -DCOUNTERPOINT_BUILD_TESTS=OFF ${prefix:+-DCMAKE_PREFIX_PATH="$prefix"}
cmake --build build/peers --target counterpoint_bench_peers
mkdir -p out
build/peers/bin/counterpoint_bench_peers --robots "$robots" --tables "${TABLES:-algorithms,steps}" --csv out/performance.csv \
  --svg out/performance.svg | tee out/performance.txt
