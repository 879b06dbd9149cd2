#!/usr/bin/env bash
# The walls between the rooms, checked by a machine:
# - tracer and protocol know neither each other nor master nor worker; the tracer no sockets, the protocol no pixels;
# - the scheduler knows neither clock, socket, async runtime, window nor image; nor does the accounting.
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

forbid tracer/src 'rayfarm_(protocol|master|worker)|\b(tokio|minifb)::|std::net' \
    'tracer: no sockets, no async, no window, no other crate of the farm but text'
forbid protocol/text/src 'rayfarm_' \
    'text: knows no other crate of the farm'
forbid protocol/src 'rayfarm_(tracer|master|worker)|\b(image|glam)::' \
    'protocol: carries scenes and pixels as bytes and interprets neither'
forbid worker/src 'rayfarm_master|minifb::' \
    'worker: knows tracer and protocol only'
forbid master/src/scheduler '\btokio\b|Instant::now|SystemTime|std::net|minifb|rayfarm_tracer|std::thread' \
    'scheduler: pure; time is passed in, pixels bypass it'
forbid master/src/accounting '\btokio\b|Instant::now|SystemTime|std::net|minifb|rayfarm_tracer' \
    'accounting: time is passed in; it is told what happens, and asks nobody'

[ "$failed" = 0 ] && echo "the walls stand"
exit "$failed"
