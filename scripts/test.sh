#!/bin/sh
# Builds, installing what is missing, and runs every test.
set -eu
cd "$(dirname "$0")/.."
scripts/setup.sh --for-tests
ctest --preset release
