#!/bin/sh
# run.sh PYTHON ...: runs the command; exit code 77 if PYTHON has no pytest.
"$1" -c 'import pytest' 2>/dev/null || {
  echo "SKIPPED: $1 has no pytest (Debian: python3-pytest)"
  exit 77
}
exec "$@"
