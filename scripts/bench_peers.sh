#!/usr/bin/env bash
# Compares rayfarm with Embree: the same scenes, rendered in turn on this machine. See --help.
set -euo pipefail

root=$(cd "$(dirname "$0")/.." && pwd)
peers=$root/scripts/peers
export PYTHONDONTWRITEBYTECODE=1

# Paths have peers and options of their own.
if [ "${1:-}" = --path ]; then
    shift
    exec "$peers/bench_paths.sh" "$@"
fi

usage() {
    cat <<'TEXT'
usage: scripts/bench_peers.sh [OPTION ...]

Renders the same scenes with rayfarm and with a small tracer on Embree 3 (packets of 16 rays, coherent), in turn, checks that
both give the same picture, and prints milliseconds per frame and their ratio. The times exclude the building of trees.

  --workloads DIR  folder of w1.toml, w2.toml and w3.toml (default ../shared/workloads, seen from here).
                   Where it does not exist, models/room.toml and models/instances.toml are rendered, reduced to features of both tracers:
                   flat normals, one material a model, one point light
  --scene FILE     render this scene instead, reduced in the same way; may be given several times
  --rounds N       measurements of both tracers (default 5)
  --frames N       frames a round (default 20)
  --threads LIST   thread counts (default "1 2")
  --rays           measure rays as well, on one thread: 1,000,000 single random rays, and the secondary rays of a scene, single
                   and sixteen together, compared with rtcIntersect1 and rtcOccluded1. Their scenes are models/showroom.toml
                   and w2 with a mirror for a ground and one glass model
  --only-rays      measure nothing else
  --csv FILE       write the table to FILE as well
  --path OPTION .. as the first option: compare the path integrator with Mitsuba and Cycles instead; --path --help
  --keep DIR       keep scenes, pictures and all figures in DIR
  --help           this text

Needs Rust, python3 3.11, g++ and Embree 3 (libembree-dev of Debian 12, installed where apt-get exists and the user is root).
Exit status: 0 measured; 1 failure, or the pictures differ; 2 wrong use; 77 a program is missing.
TEXT
}

say() { printf '%s\n' "$*" >&2; }
fail() { say "bench_peers.sh: $1"; exit "${2:-1}"; }

workloads=$root/../shared/workloads
scenes=() rounds=5 frames=20 thread_counts="1 2" csv="" keep=""
measure_frames=yes measure_rays=no
rays=1000000 seed=1 bounced_count=200000

number() { [[ $2 =~ ^[1-9][0-9]*$ ]] || fail "$1: a number from 1 is expected, not \"$2\"" 2; }

while [ $# -gt 0 ]; do
    case $1 in
        --help) usage; exit 0 ;;
        --rays) measure_rays=yes; shift; continue ;;
        --only-rays) measure_rays=yes; measure_frames=no; shift; continue ;;
        --workloads | --scene | --rounds | --frames | --threads | --csv | --keep) ;;
        *) usage >&2; fail "unknown option \"$1\"" 2 ;;
    esac
    [ $# -ge 2 ] || fail "$1: a value is expected" 2
    case $1 in
        --workloads) workloads=$2 ;;
        --scene) scenes+=("$2") ;;
        --rounds) number "$1" "$2"; rounds=$2 ;;
        --frames) number "$1" "$2"; frames=$2 ;;
        --threads) for count in $2; do number "$1" "$count"; done; thread_counts=$2 ;;
        --csv) csv=$2 ;;
        --keep) keep=$2 ;;
    esac
    shift 2
done

# --- requirements -----------------------------------------------------------------------------------------------------

have_embree() { echo '#include <embree3/rtcore.h>' | g++ -E -x c++ - >/dev/null 2>&1; }

need() {
    local missing=()
    command -v g++ >/dev/null || missing+=(g++)
    have_embree || missing+=(libembree-dev)
    if [ ${#missing[@]} -gt 0 ]; then
        if command -v apt-get >/dev/null && [ "$(id -u)" = 0 ]; then
            say "installing ${missing[*]}"
            { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "${missing[@]}"; } >&2 ||
                fail "apt-get could not install ${missing[*]}" 77
        fi
        command -v g++ >/dev/null || fail "g++ is missing: install it (Debian: apt-get install g++)" 77
        have_embree || fail "Embree 3 is missing: install its headers (Debian 12: apt-get install libembree-dev)" 77
    fi
    command -v cargo >/dev/null || fail "cargo is missing: see https://rustup.rs" 77
    python3 -c 'import tomllib' 2>/dev/null || fail "python3 from 3.11 on is missing" 77
}

need

# Before the builds of this script load the machine.
load=$(cut -d ' ' -f 1 /proc/loadavg 2>/dev/null || echo unknown)
if [ "$load" != unknown ] && awk -v load="$load" 'BEGIN { exit !(load > 0.5) }'; then
    say "the machine is busy (load $load): all figures are too slow, above all those of several threads"
fi

if [ -n "$keep" ]; then
    mkdir -p "$keep"
    work=$(cd "$keep" && pwd)
else
    work=$(mktemp -d)
    trap 'rm -rf "$work"' EXIT
fi
trap 'say "interrupted"; exit 130' INT TERM

# --- building both ----------------------------------------------------------------------------------------------------

# Read before the build: commits may be added while it runs.
commit=$(git -C "$root" describe --always --dirty 2>/dev/null || echo unknown)
say "building rayfarm"
(cd "$root" && cargo build --release --package rayfarm-master >&2)
target=$(cd "$root" && cargo metadata --format-version 1 --no-deps |
    python3 -c 'import json, sys; print(json.load(sys.stdin)["target_directory"])')
rayfarm=$target/release/rayfarm-master
single_rays=$target/release/examples/single_rays
bounced_rays=$target/release/examples/bounced_rays
if [ "$measure_rays" = yes ]; then
    (cd "$root" && cargo build --release --package rayfarm-tracer --example single_rays --example bounced_rays >&2)
fi

say "building the tracer on Embree"
embree=$work/embree_tracer
g++ -std=c++17 -O3 -march=native -mprefer-vector-width=512 -ffast-math -Wall -Wextra \
    "$peers/embree_tracer.cpp" -o "$embree" -lembree3 -pthread

# --- the scenes -------------------------------------------------------------------------------------------------------

names=()

# prepare NAME SCENE OPTION...: writes NAME.toml and NAME.txt, and adds NAME to names.
prepare() {
    local name=$1 scene=$2
    shift 2
    say "preparing $name"
    python3 "$peers/prepare_scene.py" "$scene" "$work/$name" "$@"
    compile_models "$name"
    names+=("$name")
}

# Compiles baked models: reading a large OBJ takes seconds and is not measured.
compile_models() {
    local obj
    for obj in "$work/$1"-*.obj; do
        # The name of a scene may begin with that of another scene.
        grep -qF "\"$obj\"" "$work/$1.toml" || continue
        "$rayfarm" compile "$obj" -o "${obj%.obj}.mesh" --quiet >&2
        sed -i "s|\"$obj\"|\"${obj%.obj}.mesh\"|" "$work/$1.toml"
    done
}

# four_samples NAME: the same scene with four rays a pixel.
four_samples() {
    sed 's/^samples = .*/samples = 4/' "$work/$1.toml" >"$work/$1-4-samples.toml"
    sed 's/^\(size .*\) [0-9]*$/\1 4/' "$work/$1.txt" >"$work/$1-4-samples.txt"
    names+=("$1-4-samples")
}

if [ ${#scenes[@]} -eq 0 ] && [ -d "$workloads" ]; then
    prepare w1 "$workloads/w1.toml"
    prepare w2 "$workloads/w2.toml"
    prepare w2-one-mesh "$workloads/w2.toml" --bake
    prepare w3 "$workloads/w3.toml"
    four_samples w2
    four_samples w2-one-mesh
    ray_names=(w1 w2 w2-one-mesh)
else
    if [ ${#scenes[@]} -eq 0 ]; then
        say "no workloads in $workloads: rendering scenes of this project (see --workloads)"
        scenes=("$root/models/room.toml" "$root/models/instances.toml")
    fi
    for scene in "${scenes[@]}"; do
        name=$(basename "$scene" .toml)
        prepare "$name" "$scene" --plain
        prepare "$name-one-mesh" "$scene" --plain --bake
    done
    ray_names=("${names[@]}")
fi

# bounced NAME SCENE: writes the secondary rays of a scene, which are traced in the prepared scene NAME.
bounced_names=()
bounced() {
    say "writing the secondary rays of $1"
    "$bounced_rays" dump "$2" "$work/$1.rays" --rays "$bounced_count" >&2
    "$bounced_rays" time "$work/$1.toml" "$work/$1.rays" --hits "$work/$1.rayfarm.hits" >/dev/null
    "$embree" "$work/$1.txt" --ray-file "$work/$1.rays" --hits "$work/$1.embree.hits" >/dev/null
    python3 "$peers/compare_hits.py" "$work/$1.rayfarm.hits" "$work/$1.embree.hits" >&2
    bounced_names+=("$1")
}

if [ "$measure_rays" = yes ]; then
    python3 "$peers/prepare_scene.py" "$root/models/showroom.toml" "$work/showroom-rays" --plain
    bounced showroom-rays "$root/models/showroom.toml"
    if [ -d "$workloads" ]; then
        python3 "$peers/prepare_scene.py" "$workloads/w2.toml" "$work/w2-rays" --bounces
        bounced w2-rays "$work/w2-rays.toml"
    fi
fi

# --- the same picture -------------------------------------------------------------------------------------------------

if [ "$measure_frames" = yes ]; then
    for name in "${names[@]}"; do
        "$rayfarm" render "$work/$name.toml" -o "$work/$name.rayfarm.ppm" --quiet >&2
        "$embree" "$work/$name.txt" --frames 1 --out "$work/$name.embree.ppm" >/dev/null
        say "comparing the pictures of $name"
        python3 "$peers/compare_pictures.py" "$work/$name.rayfarm.ppm" "$work/$name.embree.ppm" >&2
    done
fi

# --- measuring, in turn -----------------------------------------------------------------------------------------------

runs=$work/runs.tsv
: >"$runs"

# record PART NAME THREADS ROUND TRACER COMMAND...: adds the command's line of JSON, with its key.
record() {
    local json
    json=$("${@:6}")
    printf '%s\t%s\t%s\t%s\t%s\t%s\n' "${@:1:5}" "$json" >>"$runs"
}

for ((round = 1; round <= rounds; ++round)); do
    if [ "$measure_frames" = yes ]; then
        for name in "${names[@]}"; do
            for threads in $thread_counts; do
                say "round $round of $rounds: $name, threads: $threads"
                record frames "$name" "$threads" "$round" rayfarm \
                    "$rayfarm" bench "$work/$name.toml" --threads "$threads" --frames "$frames" --json
                record frames "$name" "$threads" "$round" embree \
                    "$embree" "$work/$name.txt" --threads "$threads" --frames "$frames"
            done
        done
    fi
    if [ "$measure_rays" = yes ]; then
        for name in "${ray_names[@]}"; do
            say "round $round of $rounds: $name, single rays"
            record rays "$name" 1 "$round" rayfarm "$single_rays" "$work/$name.toml" --rays "$rays" --seed "$seed"
            record rays "$name" 1 "$round" embree "$embree" "$work/$name.txt" --rays "$rays" --seed "$seed"
        done
        for name in "${bounced_names[@]}"; do
            say "round $round of $rounds: $name, secondary rays"
            record bounces "$name" 1 "$round" rayfarm "$bounced_rays" time "$work/$name.toml" "$work/$name.rays"
            record bounces "$name" 1 "$round" embree "$embree" "$work/$name.txt" --ray-file "$work/$name.rays"
        done
    fi
done

# --- the table --------------------------------------------------------------------------------------------------------

cpu=$(lscpu 2>/dev/null | sed -n 's/^Model name: *//p' | head -n 1)
cpu="${cpu:-$(uname -m)}, $(nproc) cores"
version=$("$embree" --version)
today=$(date +%F)
echo "$cpu; rayfarm $commit; Embree $version; $today; load before $load; medians of $rounds rounds"
python3 "$peers/report.py" "$runs" ${csv:+--csv "$csv"} \
    --note "cpu=$cpu" --note "commit=$commit" --note "embree_version=$version" --note "date=$today" --note "load=$load"
