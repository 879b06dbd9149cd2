#!/usr/bin/env bash
# Installs Mitsuba, Blender and Embree's path tracer for `bench_peers.sh --path`, builds rayfarm, and starts path/bench.py. Options: see
# there.
set -euo pipefail

root=$(cd "$(dirname "$0")/../.." && pwd)
work=${RAYFARM_PEERS_WORK:-$root/target/peers}
mitsuba_version=3.9.1
blender_version=5.0.1
export PYTHONDONTWRITEBYTECODE=1

say() { printf '%s\n' "$*" >&2; }
fail() { say "bench_peers.sh: $1"; exit "${2:-1}"; }

command -v cargo >/dev/null || fail "cargo is missing: see https://rustup.rs" 77
python3 -c 'import tomllib, venv' 2>/dev/null || fail "python3 from 3.11 on with venv is missing" 77
mkdir -p "$work"

# install FOLDER PACKAGE...: a virtual environment with some packages; nothing is done where they are there already.
install() {
    local python=$work/$1/bin/python3
    [ -x "$python" ] || python3 -m venv "$work/$1" >&2
    "$python" -m pip install --quiet --disable-pip-version-check "${@:2}" >&2
}

say "installing Mitsuba $mitsuba_version"
install mitsuba "mitsuba==$mitsuba_version" numpy || fail "Mitsuba $mitsuba_version cannot be installed from PyPI" 77
if ! ls /usr/lib/*/libLLVM*.so* >/dev/null 2>&1 && command -v apt-get >/dev/null && [ "$(id -u)" = 0 ]; then
    say "installing libllvm19"
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq libllvm19 >&2 ||
        say "LLVM is missing: Mitsuba's scalar variant is measured, which is slower"
fi

blender=()
say "installing Blender $blender_version"
if install blender "bpy==$blender_version"; then
    blender=(--blender "$work/blender/bin/python3")
else
    say "Cycles is skipped: bpy $blender_version cannot be installed for $(python3 --version), it needs Python 3.11"
fi

embree=()
if ! command -v pathtracer >/dev/null && command -v apt-get >/dev/null && [ "$(id -u)" = 0 ]; then
    say "installing embree-tools"
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq embree-tools >&2 || true
fi
if command -v pathtracer >/dev/null; then
    embree=(--embree)
else
    say "Embree's path tracer is skipped: it is in the package embree-tools of Debian"
fi

scenes=()
case " $* " in
    *" --scene "*) ;;
    *" --sky "*) scenes=(--scene "$root/models/product.toml" --scene "$root/models/room.toml") ;;
    *) scenes=(--scene "$root/models/box.toml") ;;
esac

say "building rayfarm"
(cd "$root" && cargo build --release --package rayfarm-master >&2)
target=$(cd "$root" && cargo metadata --format-version 1 --no-deps |
    python3 -c 'import json, sys; print(json.load(sys.stdin)["target_directory"])')
"$work/mitsuba/bin/python3" "$root/scripts/peers/path/bench.py" --rayfarm "$target/release/rayfarm-master" \
    --mitsuba "$work/mitsuba/bin/python3" "${blender[@]}" "${embree[@]}" --work "$work" "${scenes[@]}" "$@"
