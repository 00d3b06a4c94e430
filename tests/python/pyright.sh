#!/bin/sh
# pyright.sh PYTHON BUILD: checks the stubs, the examples and pyright/expected_types.py with pyright's strict rules.
# pyright comes from npm, pinned in pyright/package-lock.json. Exit code 77: skipped, with the reason.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
skip() {
  echo "SKIPPED: $1"
  exit 77
}
command -v node >/dev/null && command -v npm >/dev/null || skip "no node or npm (Debian: nodejs npm)"
work=$2/pyright
mkdir -p "$work"
cp "$here/pyright/package.json" "$here/pyright/package-lock.json" "$work"
stamp=$work/node_modules/.lock-$(sha256sum <"$work/package-lock.json" | cut -c1-16)
if [ ! -e "$stamp" ]; then
  (cd "$work" && npm ci --ignore-scripts --no-audit --no-fund --loglevel=error) || skip "npm could not fetch pyright"
  touch "$stamp"
fi
# Uses copies, since pyright checks files below its project only and does not follow links.
rm -rf "$work/source"
mkdir -p "$work/source/counterpoint"
cp "$2"/python/counterpoint/*.pyi "$2"/python/counterpoint/py.typed "$work/source/counterpoint"
cp "$root"/apps/python/examples/*.py "$here/pyright/expected_types.py" "$work/source"
rm "$work/source/tables.py"  # pandas and matplotlib may be missing
cat >"$work/pyrightconfig.json" <<END
{"include": ["source"], "extraPaths": ["source"], "typeCheckingMode": "strict",
 "reportUnnecessaryTypeIgnoreComment": "error", "pythonVersion": "3.11"}
END
"$work/node_modules/.bin/pyright" --project "$work/pyrightconfig.json" --pythonpath "$1"
