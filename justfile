# Recipes for `just` (https://just.systems); `just` alone lists them. Each is one command that also works by hand.

# List the recipes.
default:
    @just --list

# Check formatting, lints, layering, circles, words and spelling; a minute once dependencies are built.
check:
    cargo fmt --all --check
    cargo clippy --workspace --all-targets -- -D warnings
    scripts/check_layering.sh
    scripts/check_circles.py
    scripts/check_words.py
    typos

# Run all tests.
test *arguments:
    cargo test --workspace {{ arguments }}

# Run all tests but the documentation's with nextest, each in its own process; `--profile ci` ends tests that hang.
nextest *arguments:
    cargo nextest run --workspace {{ arguments }}

# Measure the tracer: time and instructions per ray.
bench *arguments:
    scripts/bench_tracer.sh {{ arguments }}

# Measure the farm on this machine; half an hour.
bench-farm *arguments:
    python3 scripts/bench_farm.py {{ arguments }}

# Build the documentation of all crates; warnings are errors.
doc *arguments:
    RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps {{ arguments }}

# Open a window with the sitting room.
room *arguments:
    cargo run --release -- view models/room.toml {{ arguments }}

# Render a scene to a picture.
render scene output *arguments:
    cargo run --release -- render {{ scene }} -o {{ output }} {{ arguments }}

# Count the words of scripts/words.txt by folder.
words *arguments:
    scripts/check_words.py --report {{ arguments }}

# Write completions and manual pages below `folder`.
man folder="target/man":
    cargo run --release -- man {{ folder }}/man1
    cargo run --release -- completions bash > {{ folder }}/rayfarm-master.bash
    cargo run --release -- completions bash --program worker > {{ folder }}/rayfarm-worker.bash

# Run each fuzz target for some seconds; needs cargo-fuzz (see scripts/fuzz.sh).
fuzz *arguments:
    scripts/fuzz.sh {{ arguments }}

# Check licences and banned crates of all dependencies.
deny:
    scripts/check_dependencies.py

# All that CI runs.
ci:
    .ci/run
