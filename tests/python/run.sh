#!/bin/sh
# run.sh PYTHON ...: the command, or exit code 77 where PYTHON has no pytest.
"$1" -c 'import pytest' 2>/dev/null || {
  echo "SKIPPED: $1 has no pytest (Debian: python3-pytest)"
  exit 77
}
exec "$@"
