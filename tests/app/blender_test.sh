#!/bin/sh
# Runs a scene, writes it as one animated GLB and opens that in Blender.
# blender_test.sh BLENDER PROGRAM SCENE FOLDER
set -eu
blender=$1 program=$2 scene=$3 folder=$4
rm -rf "$folder"
mkdir -p "$folder"
"$program" run "$scene" -o "$folder/run"
"$program" render "$folder/run" -o "$folder/run.glb"
"$blender" --background --factory-startup --python "$(dirname "$0")/blender_test.py" -- "$folder/run.glb" >"$folder/log" 2>&1 || true
cat "$folder/log"
grep -q '^SOUND$' "$folder/log"
