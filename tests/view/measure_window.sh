#!/usr/bin/env bash
# Measures the window at the published size: ten seconds of cutting at 1280 x 720, the software rasteriser on
# one thread. Prints what the viewer prints at its end. Needs xvfb-run and xdotool.
#   measure_window.sh PROGRAM SCENE
set -euo pipefail
program=$1 scene=$2
if [[ -z ${MEASURED_DISPLAY:-} ]]; then
  MEASURED_DISPLAY=1 exec xvfb-run -a -s "-screen 0 1280x800x24 -noreset" "$0" "$@"
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
export XDG_CONFIG_HOME=$folder LP_NUM_THREADS=1
"$program" view "$scene" --frames 100000 &
pid=$!
sleep 4
xdotool mousemove 640 400 key space
end=$((SECONDS + 10))
column=560
while ((SECONDS < end)); do
  xdotool mousemove "$column" 150
  sleep 0.1
  xdotool mousedown 1
  for k in $(seq 0 24); do xdotool mousemove "$column" $((150 + 20 * k)); sleep 0.03; done
  xdotool mouseup 1
  sleep 0.4
  column=$((column + 37))
done
xdotool key ctrl+q
wait "$pid"
