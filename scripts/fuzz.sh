#!/usr/bin/env bash
# Runs fuzz targets of tests/fuzz, each for some seconds: scripts/fuzz.sh [SECONDS [TARGET...]]; 60 s and all of them otherwise.
#
# Needs cargo-fuzz (`cargo install cargo-fuzz --locked`) and a C++ compiler. libFuzzer's instrumentation needs options of the
# compiler that are not stable; RUSTC_BOOTSTRAP lets a stable one take them, so that no nightly is needed.
# Inputs that fail are written to tests/fuzz/artifacts, inputs that reach new code to target/fuzz/corpus.
set -euo pipefail
cd "$(dirname "$0")/.."
export RUSTC_BOOTSTRAP=1

seconds=${1:-60}
shift || true
targets=("$@")
if [ ${#targets[@]} = 0 ]; then
    for file in tests/fuzz/fuzz_targets/*.rs; do targets+=("$(basename "$file" .rs)"); done
fi

# seeds TARGET FOLDER: inputs to begin with, where the project has some.
seeds() {
    case $1 in
        scene) find models -name '*.toml' -size -64k -exec cp {} "$2" \; ;;
        obj) find models -name '*.obj' -size -64k -exec cp {} "$2" \; ;;
    esac
}

for target in "${targets[@]}"; do
    corpus=target/fuzz/corpus/$target
    mkdir -p "$corpus"
    seeds "$target" "$corpus"
    printf '%s: ' "$target"
    log=target/fuzz/$target.log
    if ! cargo fuzz run --fuzz-dir tests/fuzz --target-dir target/fuzz "$target" "$corpus" -- \
        -max_total_time="$seconds" -timeout=20 -rss_limit_mb=4096 -print_final_stats=1 >"$log" 2>&1; then
        tail -n 60 "$log"
        exit 1
    fi
    grep -o 'number_of_executed_units: [0-9]*' "$log"
done
