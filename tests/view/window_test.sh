#!/usr/bin/env bash
# The window under a display server without a screen: keys, strokes, the wheel and panels by a real pointer.
#   window_test.sh PROGRAM MESHES FOLDER
set -euo pipefail
program=$1 meshes=$2 folder=$3
rm -rf "$folder" && mkdir -p "$folder" && cd "$folder"
export XDG_CONFIG_HOME=$folder/config

fail() { echo "window_test: $1" >&2; cat log >&2 || true; exit 1; }

# pause SECONDS: as long on a machine at rest, longer on one that is slow or busy.
slowness=1
pause() { sleep "$(awk "BEGIN { print $1 * $slowness }")"; }
begin=$(date +%s%N)
"$program" view "$meshes/pear.obj" --frames 30 --screenshot first.png >log 2>&1 || fail "there is no picture"
slowness=$(((($(date +%s%N) - begin) / 1000000 + 2999) / 3000))

# start NAME WORD...: starts the viewer and waits for its window.
start() {
  shift
  "$program" view "$@" --width 900 --height 600 >log 2>&1 &
  pid=$!
  for _ in $(seq 200); do
    id=$(xdotool search --onlyvisible --name Splitcubes 2>/dev/null | head -n 1 || true)
    [[ -n $id ]] && break
    kill -0 "$pid" 2>/dev/null || fail "the viewer has ended"
    sleep 0.1
  done
  [[ -n $id ]] || fail "there is no window"
  pause 2
}
stop() {
  xdotool key ctrl+q
  wait "$pid" || fail "the viewer has failed"
}

# click X Y
click() {
  xdotool mousemove "$1" "$2"
  sleep 0.3
  xdotool mousedown 1
  sleep 0.3
  xdotool mouseup 1
  sleep 0.3
}

start stroke "$meshes/pear.obj" --record-input stroke.jsonl --screenshot stroke.png
xdotool mousemove 450 300 key space
sleep 0.5
xdotool mousemove 440 120
sleep 0.3
xdotool mousedown 1
for k in $(seq 0 30); do xdotool mousemove 445 $((120 + 12 * k)); sleep 0.02; done
sleep 0.5
xdotool mouseup 1
sleep 0.5
xdotool key z
stop
[[ -s stroke.png ]] || fail "there is no picture"
# The stroke began where the button went down, and kept its positions.
grep -q '"kind":"press","x":440.0,"y":120.0' stroke.jsonl || fail "the press has another position"
(($(grep -c '"kind":"move"' stroke.jsonl) >= 15)) || fail "positions of the stroke are lost"
[[ -f $folder/config/splitcubes/viewer.json ]] || fail "settings are not kept"

# What was recorded can be replayed without a window, and cuts.
replayed() { "$program" view "$meshes/pear.obj" --width 900 --height 600 --replay-input "$1"; }
grep -v '"kind":"press"' stroke.jsonl >uncut.jsonl
cut=$(replayed stroke.jsonl) uncut=$(replayed uncut.jsonl)
[[ ${cut%%,*} == "${uncut%%,*}" && $cut != "$uncut" ]] || fail "the stroke does nothing: $cut"
[[ $(replayed stroke.jsonl) == "$cut" ]] || fail "a replay ends in another state"

start panel "$meshes/pear.obj" --record-input panel.jsonl --screenshot panel.png
# A click on the second tool's button selects it, and does not reach the body.
click 180 36
xdotool mousemove 450 300
sleep 0.3
xdotool click 4
sleep 0.3
stop
grep -q '"kind":"key","name":"2"' panel.jsonl || fail "the button of a tool does nothing"
if grep -q '"kind":"press"' panel.jsonl; then fail "a click on a panel reached the body"; fi
grep -q '"kind":"wheel"' panel.jsonl || fail "the wheel does nothing"

# Without a file there is the gallery; its first picture is the liver. A film of what comes is saved.
export XDG_CACHE_HOME=$folder/cache SPLITCUBES_SCENES=$folder/scenes
mkdir -p "$folder/scenes/meshes" && cp "$meshes/pear.obj" "$folder/scenes/meshes/" && cp "$meshes/../schema.json" "$folder/scenes/"
start gallery --record-input gallery.jsonl
click 110 120
pause 2
xdotool key space
pause 1
xdotool key F11
pause 1
xdotool key F11
pause 1
stop
grep -q '"kind":"act","name":"open","text":".*pear.obj"' gallery.jsonl || fail "a click in the gallery opens nothing"
grep -q 'saved .*film-1.mp4' log || fail "no film is saved"
[[ -s splitcubes-film-1.mp4 ]] || fail "there is no film"
[[ -n $(find "$folder/cache" -name '*.png') ]] || fail "the gallery keeps no picture"

# A file that cannot be opened is said in one line.
echo "no mesh" >wrong.obj
for file in wrong.obj nothing.json "$folder"; do
  code=0
  "$program" view "$file" --frames 3000 >log 2>&1 || code=$?
  [[ $code == 2 && $(wc -l <log) == 1 ]] || fail "$file ends the viewer with $code"
done
echo "window_test: passed"
