#!/usr/bin/env bash
# Installs what is needed, builds the program, runs the scenes and renders them.
# Everything lands in demo/: per scene a folder with the surface mesh of each
# frame, a picture of each beside it, and a film. A scene that was run before
# replaces what it wrote then, and nothing else.
#
#   ./run-demo.sh [SCENE...]     names of files in scenes/, without .json; without any, three that show cuts
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
cd "$root"
scenes=("$@")
if ((${#scenes[@]} == 0)); then scenes=(long_incision cylinder_from_block pear_halves); fi
for scene in "${scenes[@]}"; do
  if [[ ! -f scenes/$scene.json ]]; then
    echo "run-demo: there is no scenes/$scene.json" >&2
    exit 2
  fi
done
# Seconds until the first film and pictures are there, on two cores without a compiler cache.
budget=240
# A precompiled header is the same to the compiler cache when its contents are.
export CCACHE_SLOPPINESS=${CCACHE_SLOPPINESS:-pch_defines,time_macros}

count() {  # count FOLDER PATTERN
  find "$1" -name "$2" 2>/dev/null | wc -l
}

show() {  # show SCENE
  echo "$1:"
  echo "  film      $root/demo/$1.mp4"
  echo "  pictures  $root/demo/$1-pictures ($(count "demo/$1-pictures" '*.png'))"
  echo "  meshes    $root/demo/$1 ($(count "demo/$1" '*.ply'))"
}

tools/install-dependencies.sh
SECONDS=0
options=()
if command -v ccache >/dev/null; then options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi
cmake --preset release "${options[@]}"
cmake --build build/release -j "$(nproc)" --target splitcubes_app
echo "built in $SECONDS s"

program=build/release/bin/splitcubes
mkdir -p demo
# All of demo/ is this script's own: --force, for what an earlier version left there.
first=1
for scene in "${scenes[@]}"; do
  echo "== $scene"
  "$program" run "scenes/$scene.json" -o "demo/$scene" --force
  "$program" render "demo/$scene" -o "demo/$scene.mp4" -o "demo/$scene-pictures" --force
  if ((first)); then
    echo "first pictures after $SECONDS s of $budget"
    first=0
  fi
  show "$scene"
done

echo
echo "run-demo: done in $SECONDS s"
for scene in "${scenes[@]}"; do show "$scene"; done
echo
echo "To cut by hand, in a window:  $root/$program view"
