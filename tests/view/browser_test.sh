#!/bin/sh
# Replay pages in headless Chromium: browser_test.sh COUNTERPOINT [scene] [replay] [report] [live] [search]. Exit code 77: skipped, with the reason.
here=$(cd "$(dirname "$0")" && pwd)
skip() {
  echo "SKIPPED: $1"
  exit 77
}
node=$(command -v node) || skip "no node; install nodejs (Debian)"
chromium=${COUNTERPOINT_CHROMIUM:-$(command -v chromium || command -v chromium-browser || command -v google-chrome)}
[ -n "$chromium" ] || skip "no Chromium; install chromium (Debian)"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$1" simulate "$here/../../data/scenes/pendulum.yaml" --duration 0 --view "$folder/probe.html" >/dev/null 2>"$folder/why" ||
  { grep -q 'no replay page' "$folder/why" && skip "$(cat "$folder/why")"; cat "$folder/why"; exit 1; }
counterpoint=$1
shift
"$node" "$here/browser_test.mjs" "$counterpoint" "$chromium" "$folder" "$@"
