#!/usr/bin/env bash
# Starts, lists and stops workers on a list of machines over ssh. See --help.
set -euo pipefail

root=$(cd "$(dirname "$0")/.." && pwd)

usage() {
    cat <<'TEXT'
usage: scripts/workers.sh start  HOSTS --master HOST:PORT [OPTION ...] [-- WORKER-OPTION ...]
       scripts/workers.sh status HOSTS [OPTION ...]
       scripts/workers.sh stop   HOSTS [OPTION ...]

Runs a rayfarm-worker on each machine that the file HOSTS names, one a line:

    [user@]host [threads [port]]      # what follows a # is a comment

threads is a number, or - for all cores; port is the one that ssh asks. A machine that is named twice gets two workers.
The machines need sh and a log-in over ssh that asks nothing (a key); not root, and nothing installed. What is put there
lies in ~/.rayfarm: the program, and for each worker NAME.pid and NAME.log. The program is copied where it is absent or
another one. Workers stay when this script and the connection end; they end with their master, or by stop.

  --master HOST:PORT  start: where the master listens, as the machines see it (it needs --listen 0.0.0.0:PORT)
  --worker FILE       start: the program to run there (default: target/release/rayfarm-worker of this folder)
  --jobs N            so many machines at a time (default 16)
  --timeout SECONDS   how long one machine may take (default 60)
  --ssh COMMAND       what is run in place of "ssh -o BatchMode=yes -o ConnectTimeout=10"; its words are split at
                      spaces, and [-p PORT] HOST and one command line follow
  --dry-run           print what would be done, and touch no machine
  --help              this text

A line per worker is printed. Exit status: 0 all well (status: all run); 1 not with each; 2 wrong use.
Needs bash 4.4 or later.
TEXT
}

say() { printf '%s\n' "$*" >&2; }
fail() { say "workers.sh: $1"; exit "${2:-1}"; }
wrong() { fail "$1; see --help" 2; }

# --- what is asked for ------------------------------------------------------------------------------------------------

action="" hosts_file="" master="" worker="" jobs=16 patience=60 dry_run=no
read -ra ssh_words <<<"ssh -o BatchMode=yes -o ConnectTimeout=10 -o ServerAliveInterval=5"
worker_options=()

whole_number() { [[ $2 =~ ^[1-9][0-9]{0,5}$ ]] || wrong "$1: \"$2\" is no whole number from 1"; }

while [ $# -gt 0 ]; do
    case $1 in
        --help) usage; exit 0 ;;
        --dry-run) dry_run=yes; shift; continue ;;
        --) shift; worker_options=("$@"); break ;;
        --master | --worker | --jobs | --timeout | --ssh) [ $# -ge 2 ] || wrong "$1: a value is expected" ;;
        -*) wrong "unknown option \"$1\"" ;;
        *)
            if [ -z "$action" ]; then action=$1; elif [ -z "$hosts_file" ]; then hosts_file=$1
            else wrong "one file of hosts is expected, not \"$1\" as well"; fi
            shift
            continue
            ;;
    esac
    case $1 in
        --master) master=$2 ;;
        --worker) worker=$2 ;;
        --jobs) whole_number "$1" "$2"; jobs=$2 ;;
        --timeout) whole_number "$1" "$2"; patience=$2 ;;
        --ssh) read -ra ssh_words <<<"$2" ;;
    esac
    shift 2
done

case $action in
    start) [[ $master =~ ^[^[:space:]]+:[0-9]+$ ]] || wrong "start: --master HOST:PORT is expected" ;;
    status | stop) [ -z "$master$worker${worker_options[*]}" ] || wrong "$action takes no --master, --worker or worker options" ;;
    "") usage >&2; exit 2 ;;
    *) wrong "unknown command \"$action\": start, status or stop is expected" ;;
esac
[ -n "$hosts_file" ] || wrong "$action: a file of hosts is expected"
if [ ! -r "$hosts_file" ] || [ -d "$hosts_file" ]; then fail "$hosts_file: cannot be read" 2; fi
[ ${#ssh_words[@]} -gt 0 ] || wrong "--ssh: a command is expected"

# --- the hosts --------------------------------------------------------------------------------------------------------

hosts=() threads=() ports=() names=()

# add_host LINE-NUMBER HOST THREADS PORT: checks one line, and gives the worker a name of its own.
add_host() {
    local where="$hosts_file, line $1" host=$2 name count=1
    # Nothing that a shell or ssh would take for something else.
    [[ $host =~ ^[A-Za-z0-9_][A-Za-z0-9_.@:%-]*$ ]] || fail "$where: \"$host\" is no [user@]host" 2
    [[ $3 =~ ^(-|[1-9][0-9]{0,3})$ ]] || fail "$where: \"$3\" is no number of threads (or - for all cores)" 2
    [[ $4 =~ ^(|[1-9][0-9]{0,4})$ ]] || fail "$where: \"$4\" is no port" 2
    name=$host
    while [[ " ${names[*]} " = *" $name "* ]]; do
        count=$((count + 1))
        name=$host-$count
    done
    hosts+=("$host") threads+=("$3") ports+=("$4") names+=("$name")
}

read_hosts() {
    local line number=0 words
    while IFS= read -r line || [ -n "$line" ]; do
        number=$((number + 1))
        read -ra words <<<"${line%%#*}"
        [ ${#words[@]} -gt 0 ] || continue
        [ ${#words[@]} -le 3 ] || fail "$hosts_file, line $number: [user@]host [threads [port]] is expected" 2
        add_host "$number" "${words[0]}" "${words[1]:--}" "${words[2]:-}"
    done <"$hosts_file"
    [ ${#hosts[@]} -gt 0 ] || fail "$hosts_file: names no host" 2
}

read_hosts

# --- the program ------------------------------------------------------------------------------------------------------

# Of standard input, in hexadecimal, by whichever program is there.
hash_here() {
    if command -v sha256sum >/dev/null; then sha256sum; else shasum -a 256; fi | cut -d ' ' -f 1
}

hash=""
if [ "$action" = start ]; then
    worker=${worker:-${CARGO_TARGET_DIR:-$root/target}/release/rayfarm-worker}
    if [ -f "$worker" ] && [ -x "$worker" ]; then
        hash=$(hash_here <"$worker")
    else
        fail "$worker: is no program; build it with cargo build --release -p rayfarm-worker, or name it with --worker" 2
    fi
fi

# --- one machine ------------------------------------------------------------------------------------------------------

# quote WORD ...: each as a word for any POSIX shell.
quote() {
    local word quoted=()
    for word in "$@"; do quoted+=("'${word//\'/\'\\\'\'}'"); done
    printf '%s' "${quoted[*]}"
}

# options_of INDEX: what the worker's command line shall be, as words for a shell.
options_of() {
    local words=(--master "$master" --name "${names[$1]}")
    [ "${threads[$1]}" = - ] || words+=(--threads "${threads[$1]}")
    quote "${words[@]}" "${worker_options[@]}"
}

# script_for INDEX: what sh shall read there. Everything that varies comes first, in quotes.
script_for() {
    printf 'action=%s name=%s hash=%s\n' "$action" "$(quote "${names[$1]}")" "$(quote "$hash")"
    printf 'set -- %s\n' "$(options_of "$1")"
    cat "$root/scripts/workers/remote.sh"
}

# on INDEX COMMAND-LINE: runs that there.
on() {
    local command=("${ssh_words[@]}")
    [ -z "${ports[$1]}" ] || command+=(-p "${ports[$1]}")
    command+=("${hosts[$1]}" "$2")
    if command -v timeout >/dev/null; then command=(timeout "$patience" "${command[@]}"); fi
    "${command[@]}"
}

# The copy has a name of its own until it is whole, and replaces the program at once: one that runs is not disturbed.
copy_to() {
    local new=".rayfarm/rayfarm-worker.${names[$1]}.new"
    on "$1" "umask 077; mkdir -p .rayfarm && cat > $new && chmod 755 $new && mv -f $new .rayfarm/rayfarm-worker" <"$worker"
}

# What remote.sh says when the program is absent or another one.
COPY_FIRST=9

# attempt INDEX: does what is asked for there; prints what came of it.
attempt() {
    local status=0
    script_for "$1" | on "$1" "sh -s" || status=$?
    [ "$status" = "$COPY_FIRST" ] || return "$status"
    copy_to "$1" || return
    printf 'copied; '
    script_for "$1" | on "$1" "sh -s"
}

# visit INDEX: prints a line about the machine. Its status is that of the attempt.
visit() {
    local said="" status=0
    said=$(attempt "$1" 2>&1) || status=$?
    said=$(printf '%s' "$said" | tr '\r\n\t' '   ' | tr -d '[:cntrl:]')
    case $status in
        0) printf '%-24s ok      %s\n' "${names[$1]}" "$said"; return 0 ;;
        124) said="no answer within $patience s${said:+: $said}" ;;
        255) said="cannot be reached: ${said:-ssh says nothing}" ;;
    esac
    printf '%-24s FAILED  %s\n' "${names[$1]}" "${said:-exit status $status}"
    return 1
}

tell() {
    printf '%s: %s' "${names[$1]}" "$action"
    if [ "$action" = start ]; then
        printf ' rayfarm-worker %s\n' "$(options_of "$1")"
        printf '    after a copy of %s to ~/.rayfarm/rayfarm-worker, unless its SHA-256 is %s' "$worker" "$hash"
    fi
    printf '\n    by: %s\n' "${ssh_words[*]}${ports[$1]:+ -p ${ports[$1]}} ${hosts[$1]} \"sh -s\""
}

# --- all of them ------------------------------------------------------------------------------------------------------

if [ "$dry_run" = yes ]; then
    for index in "${!hosts[@]}"; do tell "$index"; done
    exit 0
fi

outcomes=$(mktemp -d)
trap 'rm -rf "$outcomes"' EXIT
# Jobs in the background do not hear Ctrl-C themselves.
trap 'kill $(jobs -p) 2>/dev/null; say "interrupted: what was begun there goes on"; exit 130' INT TERM

for index in "${!hosts[@]}"; do
    [ "$index" -lt "$jobs" ] || wait -n || true
    { visit "$index" && : >"$outcomes/$index"; } &
done
wait

well=$(find "$outcomes" -type f | wc -l)
say "$action: $((well)) of ${#hosts[@]} ok"
[ "$well" -eq ${#hosts[@]} ]
