#!/usr/bin/env bash
# Installs what is needed, builds the tests and runs them, stage by stage. A stage
# that fails does not stop the others; the exit code is 0 only when all passed. Each
# stage prints its time beside its budget, which holds for two cores without a
# compiler cache; installing packages is not counted.
#
#   ./run-tests.sh               the release build and its tests
#   ./run-tests.sh --all         all stages but tidy, as continuous integration does
#   ./run-tests.sh STAGE...      only these stages, of: release debug tsan fuzz format tidy
#
# Environment: FUZZ_SECONDS (30), per fuzzer; JOBS (cores); CI (set: no colours;
# progress of the builds is not shown); TIDY=1 adds the stage tidy to --all.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
cd "$root"
jobs=${JOBS:-$(nproc)}
fuzz_seconds=${FUZZ_SECONDS:-30}
# Seconds. The sum of all is the budget of --all.
declare -A budget=([release]=540 [debug]=900 [tsan]=420 [fuzz]=150 [format]=30 [tidy]=3600)
# A precompiled header is the same to the compiler cache when its contents are.
export CCACHE_SLOPPINESS=${CCACHE_SLOPPINESS:-pch_defines,time_macros}

usage() {
  sed -n '2,/^set /{/^set /!s/^# \{0,1\}//p;}' "${BASH_SOURCE[0]}"
}

stages=()
for argument in "$@"; do
  case $argument in
    --all)
      stages=(release debug tsan fuzz format)
      if [[ -n ${TIDY:-} ]]; then stages+=(tidy); fi
      ;;
    --quick) stages=(release) ;; # the default, under the name that it had in version 0.1
    release | debug | tsan | fuzz | format | tidy) stages+=("$argument") ;;
    -h | --help) usage; exit 0 ;;
    *) echo "run-tests: unknown argument '$argument'" >&2; usage >&2; exit 2 ;;
  esac
done
if ((${#stages[@]} == 0)); then stages=(release); fi

green='' red='' plain=''
if [[ -t 1 && -z ${CI:-} ]]; then green=$'\e[32m' red=$'\e[31m' plain=$'\e[0m'; fi

configure() {  # configure PRESET
  local options=()
  if command -v ccache >/dev/null; then options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi
  quietly "build/$1.configure.log" cmake --preset "$1" "${options[@]}"
}

# Where nobody watches, the output goes to a file and is shown only on failure.
quietly() {  # quietly LOG COMMAND...
  local log=$1
  shift
  if [[ -z ${CI:-} ]]; then
    "$@"
  elif ! "$@" >"$log" 2>&1; then
    tail -n 150 "$log"
    return 1
  fi
}

build() {  # build PRESET [target...]
  configure "$1" || return 1
  local targets=("${@:2}") start=$SECONDS
  if ((${#targets[@]} > 0)); then targets=(--target "${targets[@]}"); fi
  quietly "build/$1.build.log" cmake --build "build/$1" -j "$jobs" "${targets[@]}" || return 1
  echo "built $1 in $((SECONDS - start)) s"
}

run_tests() {  # run_tests PRESET [ctest options...]
  ctest --test-dir "build/$1" --output-on-failure -j "$jobs" "${@:2}"
}

stage_release() {
  build release && run_tests release
}

stage_debug() {
  # intercept_tls_get_addr: up to GCC 13 the runtime takes some blocks of thread-local
  # storage for ones of an old glibc, and the leak check then reads a wrong address.
  build debug && \
    ASAN_OPTIONS=${ASAN_OPTIONS:-detect_leaks=1:strict_string_checks=1:intercept_tls_get_addr=0} \
    UBSAN_OPTIONS=${UBSAN_OPTIONS:-print_stacktrace=1} \
    LSAN_OPTIONS=${LSAN_OPTIONS:-suppressions=$root/tools/leaks-of-others.txt:print_suppressions=0} \
    run_tests debug
}

stage_tsan() {
  # Races can only be where threads are: the modules that are given a Parallel.
  local modules=(core samples elasticity contact_response dynamics occlusion cutting splitting
    node_motion contact_detection fracture body_samples body world view)
  build tsan "${modules[@]/#/test_}" && TSAN_OPTIONS=${TSAN_OPTIONS:-halt_on_error=1} \
    run_tests tsan -L "^($(IFS='|'; echo "${modules[*]}"))\$"
}

run_fuzzer() {  # run_fuzzer NAME
  local name=$1 seeds=()
  mkdir -p "build/fuzz/corpus/$name"
  if [[ $name == fuzz_parse_scene ]]; then seeds=(scenes); fi
  if ! "build/debug/bin/$name" -max_total_time="$fuzz_seconds" -timeout=60 -rss_limit_mb=2048 \
    -print_final_stats=1 -artifact_prefix="build/fuzz/$name-" "build/fuzz/corpus/$name" "${seeds[@]}" \
    >"build/fuzz/$name.log" 2>&1; then
    tail -n 60 "build/fuzz/$name.log"
    echo "$name failed"
    return 1
  fi
  echo "$name: $(sed -n 's/.*number_of_executed_units: *//p' "build/fuzz/$name.log") inputs in $fuzz_seconds s"
}

stage_fuzz() {
  configure debug || return 1
  local fuzzers
  mapfile -t fuzzers < <(ninja -C build/debug -t targets all | sed -n 's/^\(fuzz_[a-z0-9_]*\): phony$/\1/p')
  if ((${#fuzzers[@]} == 0)); then
    echo "there is no fuzzer"
    return 1
  fi
  build debug "${fuzzers[@]}" || return 1
  export -f run_fuzzer
  export fuzz_seconds
  printf '%s\n' "${fuzzers[@]}" | xargs -n 1 -P "$jobs" bash -c 'run_fuzzer "$0"'
}

stage_format() {
  local folder folders=()
  for folder in src apps tests bench examples; do
    if [[ -d $folder ]]; then folders+=("$folder"); fi
  done
  find "${folders[@]}" -type f \( -name '*.cpp' -o -name '*.h' \) -print0 |
    xargs -0 -r -n 20 -P "$jobs" clang-format --dry-run -Werror
}

stage_tidy() {
  build release || return 1
  find src apps -type f -name '*.cpp' -print0 |
    xargs -0 -r -n 1 -P "$jobs" clang-tidy --quiet --warnings-as-errors='*' -p build/release
}

tools/install-dependencies.sh
mkdir -p build
failed=()
summary=
SECONDS=0
for stage in "${stages[@]}"; do
  echo "== $stage"
  start=$SECONDS
  # A function called in a condition runs without -e: stages chain their steps
  # with && and || return.
  if "stage_$stage"; then word="${green}passed${plain}"; else
    word="${red}failed${plain}"
    failed+=("$stage")
  fi
  line="$stage $word in $((SECONDS - start)) s of ${budget[$stage]}"
  echo "== $line"
  summary+="$line; "
done

echo
if ((${#failed[@]} == 0)); then
  echo "run-tests: all passed in $SECONDS s (${summary%; })"
else
  echo "run-tests: FAILED: ${failed[*]} (${summary%; })"
  exit 1
fi
