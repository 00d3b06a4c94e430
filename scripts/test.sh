#!/bin/sh
# Builds, installing what is missing, and runs every test.
set -eu
cd "$(dirname "$0")/.."
scripts/setup.sh --build-only
ctest --preset release
