#!/usr/bin/env bash
# Installs what is needed, builds the program, runs the scenes and renders them.
# Everything lands in demo/: per scene a folder with the surface mesh of each
# frame and a picture of each, and a film beside it.
#
#   ./run-demo.sh [SCENE...]     names of files in scenes/, without .json; without any, three that show cuts
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
cd "$root"
scenes=("$@")
if ((${#scenes[@]} == 0)); then scenes=(cylinder_from_block long_incision pear_halves); fi
for scene in "${scenes[@]}"; do
  if [[ ! -f scenes/$scene.json ]]; then
    echo "run-demo: there is no scenes/$scene.json" >&2
    exit 2
  fi
done

tools/install-dependencies.sh
options=()
if command -v ccache >/dev/null; then options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi
cmake --preset release "${options[@]}"
cmake --build build/release -j "$(nproc)" --target splitcubes_app

program=build/release/bin/splitcubes
mkdir -p demo
for scene in "${scenes[@]}"; do
  echo "== $scene"
  rm -rf "demo/$scene" "demo/$scene.mp4" "demo/$scene-pictures"
  "$program" run "scenes/$scene.json" -o "demo/$scene"
  "$program" render "demo/$scene" -o "demo/$scene.mp4"
  "$program" render "demo/$scene" -o "demo/$scene-pictures"
done

count() {  # count FOLDER PATTERN
  find "$1" -name "$2" 2>/dev/null | wc -l
}
echo
for scene in "${scenes[@]}"; do
  echo "$scene:"
  echo "  film      $root/demo/$scene.mp4"
  echo "  pictures  $root/demo/$scene-pictures ($(count "demo/$scene-pictures" '*.png'))"
  echo "  meshes    $root/demo/$scene ($(count "demo/$scene" '*.ply'))"
done
