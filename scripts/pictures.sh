#!/bin/sh
# Draws the pictures of replays in docs/images with `counterpoint view` and Chromium.
#   scripts/pictures.sh [--data FOLDER] [--command build/release/bin/counterpoint]
# FOLDER contains cube_toss/toss_*.csv; without it the picture of a recorded toss is not updated.
set -eu
cd "$(dirname "$0")/.."
command=build/release/bin/counterpoint
data=
while [ $# -gt 0 ]; do
  case "$1" in
    --data) data=$2 ;;
    --command) command=$2 ;;
    *) echo "usage: scripts/pictures.sh [--data FOLDER] [--command FILE]" >&2; exit 2 ;;
  esac
  shift 2
done
images=docs/images
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# draw NAME SCENE DURATION TIME LINK: writes docs/images/replay_NAME.png
draw() {
  "$command" simulate "$2" --duration "$3" --output "$work/$1.csv" > /dev/null
  "$command" view "$2" "$work/$1.csv" --forces --output "$work/$1.html" --png "$4" --size 960x540 --link "$5" > /dev/null
  mv "$work/$1_$4.png" "$images/replay_$1.png"
  echo "$images/replay_$1.png"
}

draw humanoid data/scenes/humanoid_drop.yaml 1.5 0.9 'cam=-50,14,2.6,0.1,0,0.35'
draw quadruped data/scenes/quadruped_drop.yaml 1.2 1 'cam=-50,16,1.35,0,0,0.1'
draw stack data/scenes/hard/tower_10.yaml 0.5 0.4 'cam=-60,10,3.9,0,0,1'
draw pile data/scenes/piles/pile_64.yaml 1.6 1.5 'cam=-50,26,3,0,0,0.1'
draw bin data/scenes/piles/bin_64.yaml 1.6 1.5 'cam=-50,72,2.6,0,0,0.2'
chromium=${COUNTERPOINT_CHROMIUM:-$(command -v chromium || command -v chromium-browser || command -v google-chrome)}
# whole NAME PAGE FRAGMENT: writes docs/images/replay_NAME.png of the whole page with its legend
whole() {
  root=
  [ "$(id -u)" -ne 0 ] || root=--no-sandbox
  "$chromium" --headless $root --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --hide-scrollbars \
    --user-data-dir="$work/profile" --window-size=1100,620 --screenshot="$images/replay_$1.png" "file://$2#$3" 2> /dev/null
  echo "$images/replay_$1.png"
}

"$command" hard-cases --only gripper --no-peers --report "$work/hard" --views > /dev/null
whole gripper "$work/hard/gripper.html" 't=2&cam=-82,16,0.55,0,0,1'

node=$(command -v node)
"$node" scripts/live_picture.mjs "$command" "$chromium" "$images/live_humanoid.png"
echo "$images/live_humanoid.png"

[ -n "$data" ] || { echo "without --data: the recorded toss is left as it is"; exit 0; }
# The toss with the worst prediction among the available ones; the recording is the ghost.
"$command" compare data/scenes/cube_toss.yaml "$data"/cube_toss/toss_*.csv --columns data/maps/cube_toss.yaml \
  --view "$work/toss.html" > /dev/null
whole toss "$work/toss.html" 't=0.25'
