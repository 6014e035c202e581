# shellcheck shell=bash
# Sourced by the stages that run under clang's sanitizers: what they cover, how they build and run it.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"

# What a sanitizer reports names functions and lines.
symbolizer=/usr/bin/llvm-symbolizer-14
export ASAN_OPTIONS=external_symbolizer_path=$symbolizer:detect_stack_use_after_return=1
# What Debian's libraries do to memory of ours is seen, what they synchronise is not.
export TSAN_OPTIONS=external_symbolizer_path=$symbolizer:halt_on_error=1:second_deadlock_stack=1:ignore_noninstrumented_modules=1
export UBSAN_OPTIONS=external_symbolizer_path=$symbolizer:print_stacktrace=1
export LSAN_OPTIONS=suppressions=$root/tests/support/lsan.supp:print_suppressions=0

# The folders of tests of the server that call no gRPC: its library is not instrumented.
server_rooms=(tests/server/{auth,conversion,execution,session,store,telemetry})

# rooms FOLDER...: those of the folders of tests, and of the folders in them, that have tests. Each is a
# unit without the folders in it.
rooms() {
  our_files "${@/%//*_test.cc}" | sed 's,/[^/]*$,,' | sort -u
}

# Seconds of one core that asan.sh spends; fuzz.sh runs the fuzzers among what that covers.
# shellcheck disable=SC2034
asan_seconds=600

# What the address sanitizer sees: the arithmetic behind every answer, what reads untrusted bytes, and
# the fuzzers.
asan_units() {
  rooms tests/core "${server_rooms[@]}"
  our_files 'tests/fuzz/*_fuzzer.cc'
}

# built PRESET UNIT...: builds the units, folders of tests or fuzzers.
built() {
  local preset=$1 unit name targets=()
  shift
  for unit in "$@"; do
    case $unit in
      *.cc) targets+=("$(basename "$unit" .cc)") ;;
      *)
        name=${unit#tests/}
        targets+=("${name//\//_}_test")
        ;;
    esac
  done
  "$stages/build.sh" "$preset" "${targets[@]}"
}

# without_long UNIT: what ctest is to leave out of a unit, beside what repeats over numbered seeds: the
# tests of long_tests.txt in it.
without_long() {
  awk -v unit="${1#tests/}/" '
    index($0, unit) == 1 && substr($0, length(unit) + 1) ~ /^[A-Z]/ {
      gsub(/[.]/, "[.]")
      names = names (names == "" ? "" : "|") $0
    }
    END { if (names != "") printf "|^(%s)(/|$)", names }' "$stages/long_tests.txt"
}

# sanitized PRESET UNIT... : runs the tests of the units that are folders; studies, which repeat what
# they do over many scenes, and long tests where VANTAGE_LONG is 1 only. Of numbered seeds and scenes
# two are enough, here as in ./dev test: the others go the same ways.
wrapper=()
sanitized() {
  local preset=$1 unit status=0 long=${VANTAGE_LONG:-0} labels='integration|study'
  shift
  [[ $long != 1 ]] || labels=integration
  for unit in "$@"; do
    [[ -d $unit ]] || continue
    echo "---- $unit"
    # Names of suites and of their instances begin with a capital, those of folders do not.
    "${wrapper[@]}" "$stages/unit.sh" --test-dir "build/$preset/$unit" --no-tests=ignore \
      -LE "$labels" -R "^${unit#tests/}/[A-Z]" \
      -E "$further_seeds$([[ $long == 1 ]] || without_long "$unit")" || status=1
  done
  [[ $long == 1 ]] ||
    echo "note: studies and long tests (tests/stages/long_tests.txt) are left out: --long has them"
  return "$status"
}
