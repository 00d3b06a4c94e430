#!/bin/sh
# Formats every C++ file with .clang-format, or with --check only lists files that differ.
# Debian: clang-format (version 14; other versions format differently).
#   scripts/format.sh [--check]
set -eu
cd "$(dirname "$0")/.."
command -v clang-format >/dev/null || { echo "error: clang-format is missing (Debian: clang-format)" >&2; exit 2; }
if [ "${1:-}" != --check ]; then
  git ls-files '*.h' '*.cc' | xargs clang-format -i
  exit
fi
differ=$(git ls-files '*.h' '*.cc' | xargs clang-format --dry-run --Werror 2>&1 | sed -n 's/^\([^:]*\):.*error:.*/\1/p' | sort -u)
[ -z "$differ" ] || { echo "$differ"; echo "these files differ: run scripts/format.sh" >&2; exit 1; }
