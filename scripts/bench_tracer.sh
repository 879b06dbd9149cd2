#!/usr/bin/env bash
# Measures the tracer on this machine: frames, stages, features, instructions. See --help.
set -euo pipefail

root=$(cd "$(dirname "$0")/.." && pwd)
export PYTHONDONTWRITEBYTECODE=1

usage() {
    cat <<'TEXT'
usage: scripts/bench_tracer.sh [OPTION ...]

Measures the tracer alone, without a farm, and prints tables in Markdown: whole frames of the project's scenes (and of
w1.toml, w2.toml and w3.toml where they exist) at 1 and 4 samples on 1 and 2 threads; the time of each stage; the cost of each
feature of a scene, and that an unused feature costs nothing; and, where valgrind is installed, instructions per ray, which do
not depend on other load of the machine. Valgrind hides AVX-512, so instructions are those of AVX2.

  --short            fewer scenes (room, textured, w1) and repeats: some minutes
  --no-instructions  do not run valgrind
  --workloads DIR    folder of w1.toml, w2.toml and w3.toml (default ../shared/workloads, seen from this repository)
  --csv FILE         write all figures to FILE as well
  --keep DIR         keep the files of criterion and callgrind in DIR, a new or empty folder
  --help             this text

Needs Rust and python3. Exit status: 0 measured; 1 failure; 2 wrong use; 77 a program is missing.
TEXT
}

say() { printf '%s\n' "$*" >&2; }
fail() { say "bench_tracer.sh: $1"; exit "${2:-1}"; }

short=no instructions=yes csv="" keep=""
while [ $# -gt 0 ]; do
    case $1 in
        --help) usage; exit 0 ;;
        --short) short=yes; shift; continue ;;
        --no-instructions) instructions=no; shift; continue ;;
        --workloads | --csv | --keep) ;;
        *) usage >&2; fail "unknown option \"$1\"" 2 ;;
    esac
    [ $# -ge 2 ] || fail "$1: a value is expected" 2
    case $1 in
        --workloads)
            [ -d "$2" ] || fail "--workloads: \"$2\" is no folder" 2
            RAYFARM_WORKLOADS=$(cd "$2" && pwd)
            export RAYFARM_WORKLOADS
            ;;
        --csv) csv=$2 ;;
        --keep) keep=$2 ;;
    esac
    shift 2
done

command -v cargo >/dev/null || fail "cargo is missing: see https://rustup.rs" 77
command -v python3 >/dev/null || fail "python3 is missing" 77
if [ "$instructions" = yes ] && ! command -v valgrind >/dev/null; then
    say "valgrind is not installed: instructions are not counted"
    instructions=no
fi

# Before the builds of this script load the machine.
load=$(cut -d ' ' -f 1 /proc/loadavg 2>/dev/null || echo unknown)
if [ "$load" != unknown ] && awk -v load="$load" 'BEGIN { exit !(load > 0.5) }'; then
    say "the machine is busy (load $load): all figures but instructions are too slow"
fi

if [ -n "$keep" ]; then
    mkdir -p "$keep"
    work=$(cd "$keep" && pwd)
    [ -z "$(ls -A "$work")" ] || fail "--keep: \"$keep\" is not empty" 2
else
    work=$(mktemp -d)
    trap 'rm -rf "$work"' EXIT
fi
trap 'say "interrupted"; exit 130' INT TERM

if [ "$short" = yes ]; then
    criterion=(--warm-up-time 0.3 --measurement-time 1 --sample-size 10)
    scenes=(room textured w1)
    stage_frames=7
else
    criterion=(--warm-up-time 1 --measurement-time 5 --sample-size 20)
    scenes=()
    stage_frames=21
fi
only=$(IFS='|'; echo "${scenes[*]}")

# --- measuring --------------------------------------------------------------------------------------------------------

# Read before the build: commits may be added while it runs.
commit=$(git -C "$root" describe --always --dirty 2>/dev/null || echo unknown)
say "building"
(cd "$root" && cargo bench --package rayfarm-tracer --no-run >&2)

# Further options of cargo.
options=()

# bench NAME ARGUMENT...: runs a benchmark of tracer/benches. The profile keeps names and lines, which callgrind and perf need.
bench() { (cd "$root" && cargo bench --quiet --profile profiling "${options[@]}" --package rayfarm-tracer --bench "$1" -- "${@:2}"); }

export CRITERION_HOME=$work/criterion
say "whole frames"
bench frames "${criterion[@]}" "^frames/(${only:-.*})/" >&2
say "stages"
bench stages --frames "$stage_frames" "${scenes[@]}" >"$work/stages.tsv"
say "features"
bench features "${criterion[@]}" >&2

say "trees over patterns"
bench builds >&2 || say "a pattern takes too long, or the machine is busy"

if [ "$instructions" = yes ]; then
    say "instructions: some minutes"
    # Cargo itself runs the program under valgrind.
    callgrind="'--tool=callgrind', '--toggle-collect=*counted_frame', '--dump-after=*counted_frame'"
    options=(--config "target.'cfg(all())'.runner = ['valgrind', '--quiet', $callgrind, '--callgrind-out-file=$work/callgrind']")
    bench instructions "${scenes[@]}" >"$work/instructions.tsv"
fi

# --- the tables -------------------------------------------------------------------------------------------------------

cpu=$(lscpu 2>/dev/null | sed -n 's/^Model name: *//p' | head -n 1)
cpu="${cpu:-$(uname -m)}, $(nproc) cores"
today=$(date +%F)
echo "$cpu; rayfarm $commit; $today; load before $load"
python3 "$root/scripts/bench/report.py" "$work" ${csv:+--csv "$csv"} \
    --note "cpu=$cpu" --note "commit=$commit" --note "date=$today" --note "load=$load"
