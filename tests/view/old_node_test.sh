#!/bin/sh
# Packing the page needs node 18 or later: checks the messages for an older and a missing node. old_node_test.sh CMAKE
set -eu
here=$(cd "$(dirname "$0")" && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
printf '#!/bin/sh\necho v16.20.2\n' > "$folder/node"
chmod +x "$folder/node"
pack() { # NODE NPM
  "$1" -DNODE="$2" -DNPM="$3" -DPAGE="$here/../../apps/view/page" -DWORK="$folder/page" -DOUTPUT="$folder/program.cc" \
    -P "$here/../../apps/view/bundle.cmake" 2>&1
}
expect() {  # WORDS: expected in the build's messages and in the program, whose page is empty
  grep -q "$1" "$folder/said" || { echo "the build does not say: $1"; cat "$folder/said"; exit 1; }
  grep -q "program_missing() { return \"$1" "$folder/program.cc" || { echo "the program does not say: $1"; exit 1; }
  grep -q 'program() { return ""; }' "$folder/program.cc"
}
pack "$1" "$folder/node" /bin/true > "$folder/said"
expect "node 16.20.2 is older than 18"
pack "$1" "" "" > "$folder/said"
expect "node or npm was missing"
[ ! -d "$folder/page/node_modules" ]
