#!/bin/sh
# Installs missing packages, builds and runs every test; skipped tests are listed at the end with
# their reason.
set -eu
cd "$(dirname "$0")/.."
scripts/setup.sh --for-tests
status=0
ctest --preset release || status=$?
python3 tests/skipped_tests.py build/release/Testing/Temporary/LastTest.log
exit $status
