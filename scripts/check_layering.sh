#!/usr/bin/env bash
# Checks walls between crates that Cargo does not enforce. Cargo refuses uses of crates that a Cargo.toml does not list. This
# script checks:
# - the dependency lists themselves: tracer and protocol do not depend on each other, the scheduler has no async runtime and no tracer;
# - parts of the standard library: sockets, clocks and threads;
# - folders inside a crate: the accounting of the farm is pure.
set -euo pipefail
cd "$(dirname "$0")/.."

failed=0

# forbid FOLDER PATTERN REASON: no line of code under FOLDER may match; comments may.
forbid() {
    local found
    found=$(grep -rnE --include='*.rs' "$2" "$1" | grep -vE '^[^:]+:[0-9]+:[[:space:]]*//' || true)
    if [ -n "$found" ]; then
        printf '%s\n  ^ %s\n' "$found" "$3"
        failed=1
    fi
}

# forbid_dependency CRATE_FOLDER PATTERN REASON: no dependency, also not for tests, may match.
forbid_dependency() {
    local found
    found=$(grep -nE "^($2)([.[:space:]]|=)" "$1/Cargo.toml" || true)
    if [ -n "$found" ]; then
        printf '%s/Cargo.toml:%s\n  ^ %s\n' "$1" "$found" "$3"
        failed=1
    fi
}

forbid_dependency tracer 'rayfarm-(protocol|scheduler|farm|master|worker)|tokio|minifb' \
    'tracer: no sockets, no async runtime, no window, no other crate of the farm but text'
forbid_dependency protocol 'rayfarm-(tracer|scheduler|farm|master|worker)|image|glam' \
    'protocol: carries scenes and pixels as bytes and interprets neither'
forbid_dependency protocol/text 'rayfarm-.*' \
    'text: depends on no other crate of the farm'
forbid_dependency worker 'rayfarm-(scheduler|farm|master)|minifb' \
    'worker: depends on tracer and protocol only'
forbid_dependency master/scheduler 'rayfarm-(tracer|farm|master|worker)|tokio.*|minifb' \
    'scheduler: pure; pixels bypass it'
forbid_dependency master/farm 'rayfarm-master|clap|minifb' \
    'farm: no command line and no display'

forbid tracer/src 'std::net' 'tracer: no sockets'
forbid master/scheduler/src 'Instant::now|SystemTime|std::net|std::thread' 'scheduler: time is passed in'
forbid master/farm/src/accounting '\btokio\b|Instant::now|SystemTime|std::net|rayfarm_tracer' \
    'accounting: pure; time is passed in'

[ "$failed" = 0 ] && echo "the walls hold"
exit "$failed"
