#!/usr/bin/env bash
# Starts, lists and stops workers on a list of machines over ssh. See --help.
set -euo pipefail

root=$(cd "$(dirname "$0")/.." && pwd)

usage() {
    cat <<'TEXT'
usage: scripts/workers.sh start  HOSTS --join -|FILE [OPTION ...] [-- WORKER-OPTION ...]
       scripts/workers.sh start  HOSTS --master HOST:PORT [OPTION ...] [-- WORKER-OPTION ...]
       scripts/workers.sh status HOSTS [OPTION ...]
       scripts/workers.sh stop   HOSTS [OPTION ...]

Runs a rayfarm-worker on each machine that the file HOSTS names, one a line:

    [user@]host [threads [port]]      # what follows a # is a comment

threads is a number, or - for all cores; port is that of ssh. A machine that is named twice runs two workers.
The file may have Windows line ends; an IPv6 address is written with or without brackets (fe80::1%eth0).
The machines need sh and a log-in over ssh by key; neither root nor other software. The script writes to ~/.rayfarm there:
the program, and for each worker NAME.pid and NAME.log. The program is copied where it is absent or different: without
symbols (where strip exists here), and compressed (where gzip exists here and there). An interrupted copy continues where
it ended. Workers survive this script, the connection and their master: they wait for the next master at that address.
They end by stop, or with their master where "-- --once" is added.

  --join -|FILE       start: the join line that the master prints, from standard input (-) or the first line of a file. It goes
                      to the machines through ssh's standard input, and is in no argument of a process here or there
  --master HOST:PORT  start: where a master without encryption listens, as the machines see it (it needs --insecure and
                      --listen 0.0.0.0:PORT)
  --worker FILE       start: the program to run there (default: target/release/rayfarm-worker of this folder)
  --jobs N            number of machines at a time (default 16)
  --timeout SECONDS   longest time without an answer of a machine or progress of a copy (default 60)
  --ssh COMMAND       command in place of "ssh" with its default options, split at spaces;
                      [-p PORT] HOST and one command line are appended
  --dry-run           print the actions without connecting to a machine
  --help              this text

Prints a line per worker, and the progress of long copies. Exit status: 0 success for all (status: all run); 1 failure for
some; 2 wrong use.
Needs bash 4.4 or later.
TEXT
}

say() { printf '%s\n' "$*" >&2; }
fail() { say "workers.sh: $1"; exit "${2:-1}"; }
wrong() { fail "$1; see --help" 2; }

# --- options ----------------------------------------------------------------------------------------------------------

action="" hosts_file="" master="" join_from="" join_line="" worker="" jobs=16 timeout_seconds=60 dry_run=no
read -ra ssh_words <<<"ssh -o BatchMode=yes -o ConnectTimeout=10 -o ServerAliveInterval=5"
worker_options=()

whole_number() { [[ $2 =~ ^[1-9][0-9]{0,5}$ ]] || wrong "$1: \"$2\" is no whole number from 1"; }

while [ $# -gt 0 ]; do
    case $1 in
        --help) usage; exit 0 ;;
        --dry-run) dry_run=yes; shift; continue ;;
        --) shift; worker_options=("$@"); break ;;
        --join | --master | --worker | --jobs | --timeout | --ssh) [ $# -ge 2 ] || wrong "$1: a value is expected" ;;
        -*) wrong "unknown option \"$1\"" ;;
        *)
            if [ -z "$action" ]; then action=$1; elif [ -z "$hosts_file" ]; then hosts_file=$1
            else wrong "one file of hosts is expected, not \"$1\" as well"; fi
            shift
            continue
            ;;
    esac
    case $1 in
        --join) join_from=$2 ;;
        --master) master=$2 ;;
        --worker) worker=$2 ;;
        --jobs) whole_number "$1" "$2"; jobs=$2 ;;
        --timeout) whole_number "$1" "$2"; timeout_seconds=$2 ;;
        --ssh) read -ra ssh_words <<<"$2" ;;
    esac
    shift 2
done

case $action in
    start)
        [ -z "$master" ] || [ -z "$join_from" ] || wrong "start: either --join or --master is expected"
        [ -n "$join_from" ] || [[ $master =~ ^[^[:space:]]+:[0-9]+$ ]] || wrong "start: --join - or --master HOST:PORT is expected"
        [[ $join_from != rf1:* ]] || wrong "--join: other users can read the arguments of a process; pass the line on standard input, with --join -"
        ;;
    status | stop) [ -z "$master$join_from$worker${worker_options[*]}" ] || wrong "$action takes no --join, --master, --worker or worker options" ;;
    "") usage >&2; exit 2 ;;
    *) wrong "unknown command \"$action\": start, status or stop is expected" ;;
esac
[ -n "$hosts_file" ] || wrong "$action: a file of hosts is expected"
if [ ! -r "$hosts_file" ] || [ -d "$hosts_file" ]; then fail "$hosts_file: cannot be read" 2; fi
[ ${#ssh_words[@]} -gt 0 ] || wrong "--ssh: a command is expected"

# read_join_line: sets join_line. The line may be the end of a command that was pasted: rayfarm-worker --join rf1:...
read_join_line() {
    local text=""
    if [ "$join_from" = - ]; then
        # Typed and pasted characters are not displayed.
        if [ -t 0 ]; then
            say "paste the join line that the master prints:"
            read -rs -n 1024 text || true
        else
            read -r -n 1024 text || true
        fi
    else
        [ -r "$join_from" ] && [ ! -d "$join_from" ] || fail "$join_from: cannot be read" 2
        read -r -n 1024 text <"$join_from" || true
    fi
    text=${text%$'\r'}
    join_line=${text##*[[:space:]]}
    [[ $join_line =~ ^rf1:[][A-Za-z0-9_.:%-]+:[0-9]+:[0-9A-Fa-f]{64}:[0-9A-Fa-f]{32}$ ]] ||
        fail "no join line in $([ "$join_from" = - ] && echo "standard input" || echo "$join_from"): rf1:HOST:PORT:KEY:TOKEN is expected" 2
}

[ -z "$join_from" ] || read_join_line

# --- the hosts --------------------------------------------------------------------------------------------------------

hosts=() threads=() ports=() names=()

# shown WORD: the word in quotes, without control characters.
shown() {
    local word=${1//[[:cntrl:]]/?}
    printf '"%s"' "${word:0:80}"
}

# add_host LINE-NUMBER HOST THREADS PORT: checks one line, and gives the worker a unique name.
add_host() {
    local where="$hosts_file, line $1" host=$2 name count=1
    # An IPv6 address in brackets: ssh accepts it without them only.
    [[ $host =~ ^(.*@)?\[([0-9A-Fa-f:]+(%[A-Za-z0-9_.-]+)?)\]$ ]] && host=${BASH_REMATCH[1]}${BASH_REMATCH[2]}
    # No word that a shell or ssh would interpret as something else.
    [[ $host =~ ^[A-Za-z0-9_:][A-Za-z0-9_.@:%-]*$ ]] || fail "$where: $(shown "$host") is no [user@]host" 2
    [[ $3 =~ ^(-|[1-9][0-9]{0,3})$ ]] || fail "$where: $(shown "$3") is no number of threads (or - for all cores)" 2
    [[ $4 =~ ^(|[1-9][0-9]{0,4})$ ]] || fail "$where: $(shown "$4") is no port" 2
    name=$host
    while [[ " ${names[*]} " = *" $name "* ]]; do
        count=$((count + 1))
        name=$host-$count
    done
    hosts+=("$host") threads+=("$3") ports+=("$4") names+=("$name")
}

# The text of the file, without what Windows adds: a byte order mark, carriage returns.
hosts_text() {
    local text
    case $(od -An -tx1 -N2 "$hosts_file" | tr -d ' \n') in
        fffe | feff) fail "$hosts_file: is UTF-16 text; save it as UTF-8" 2 ;;
    esac
    text=$(tr -d '\000' <"$hosts_file")
    text=${text#$'\xef\xbb\xbf'}
    text=${text//$'\r\n'/$'\n'}
    printf '%s\n' "${text//$'\r'/$'\n'}"
}

read_hosts() {
    local text line number=0 words
    text=$(hosts_text) || exit
    while IFS= read -r line || [ -n "$line" ]; do
        number=$((number + 1))
        read -ra words <<<"${line%%#*}"
        [ ${#words[@]} -gt 0 ] || continue
        [ ${#words[@]} -le 3 ] || fail "$hosts_file, line $number: [user@]host [threads [port]] is expected" 2
        add_host "$number" "${words[0]}" "${words[1]:--}" "${words[2]:-}"
    done <<<"$text"
    [ ${#hosts[@]} -gt 0 ] || fail "$hosts_file: names no host" 2
}

read_hosts

# --- the program ------------------------------------------------------------------------------------------------------

# SHA-256 of standard input, in hexadecimal.
hash_here() {
    if command -v sha256sum >/dev/null; then sha256sum; else shasum -a 256; fi | cut -d ' ' -f 1
}

size_here() { wc -c <"$1" | tr -d ' '; }

# kind_of FILE: the kind of machine that an ELF program is for, as uname names it; empty where it is unknown.
kind_of() {
    local head
    head=$(od -An -tx1 -N20 "$1" | tr -d ' \n')
    case ${head:0:8}${head:36:4} in
        7f454c463e00) echo x86_64 ;;
        7f454c46b700) echo aarch64 ;;
        7f454c46f300) echo riscv64 ;;
        7f454c462800) echo arm ;;
    esac
}

# Programs to copy, and results of each machine; removed when this script ends.
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# prepare: sets program (without symbols where strip supports its architecture), hash, plain_size, packed, packed_size and machine.
hash="" plain_size=0 packed="" packed_size=0 machine=""
prepare() {
    program=$work/rayfarm-worker
    if ! { command -v strip && strip -o "$program" "$worker"; } >/dev/null 2>&1 || [ ! -s "$program" ]; then
        program=$worker
    fi
    hash=$(hash_here <"$program")
    plain_size=$(size_here "$program")
    machine=$(kind_of "$program")
    # Without name and time in the header, so that a copy can be resumed on another day.
    if command -v gzip >/dev/null && gzip -n -6 <"$program" >"$work/packed"; then
        packed=$work/packed
        packed_size=$(size_here "$packed")
    fi
}

if [ "$action" = start ]; then
    worker=${worker:-${CARGO_TARGET_DIR:-$root/target}/release/rayfarm-worker}
    if [ -f "$worker" ] && [ -x "$worker" ]; then
        prepare
    else
        fail "$worker: is no program; build it with cargo build --release, or name it with --worker" 2
    fi
fi

# --- one machine ------------------------------------------------------------------------------------------------------

# quote WORD ...: each as a word for any POSIX shell.
quote() {
    local word quoted=()
    for word in "$@"; do quoted+=("'${word//\'/\'\\\'\'}'"); done
    printf '%s' "${quoted[*]}"
}

# options_of INDEX: the worker's options, as words for a shell.
options_of() {
    local words=(--master "$master")
    [ -z "$join_line" ] || words=(--join -)
    words+=(--name "${names[$1]}")
    [ "${threads[$1]}" = - ] || words+=(--threads "${threads[$1]}")
    quote "${words[@]}" "${worker_options[@]}"
}

# script_for INDEX: the script that sh runs there. Variables come first, in quotes.
script_for() {
    printf 'action=%s name=%s hash=%s\n' "$action" "$(quote "${names[$1]}")" "$(quote "$hash")"
    printf 'machine=%s plain_size=%s packed_size=%s\n' "$(quote "$machine")" "$plain_size" "$packed_size"
    # printf is built in: the line is in no list of processes.
    printf 'join_line=%s\n' "$(quote "$join_line")"
    printf 'set -- %s\n' "$(options_of "$1")"
    cat "$root/scripts/workers/remote.sh"
}

# ssh_to INDEX: sets command to the words in front of a command line to run there.
ssh_to() {
    command=("${ssh_words[@]}")
    [ -z "${ports[$1]}" ] || command+=(-p "${ports[$1]}")
    command+=("${hosts[$1]}")
}

# run_remote INDEX: runs remote.sh there; sets said and status.
run_remote() {
    local command
    ssh_to "$1"
    if command -v timeout >/dev/null; then command=(timeout "$timeout_seconds" "${command[@]}"); fi
    status=0
    said=$(script_for "$1" | "${command[@]}" "sh -s" 2>"$work/errors.$1" 3>&-) || status=$?
    # Other output of ssh or a shell (a banner, a new host key) matters only on failure.
    [ "$status" = 0 ] || said="$said $(cat "$work/errors.$1")"
}

# Bytes of a copy between two updates of its progress.
CHUNK=131072

# send_file FILE FROM SIZE MARK: prints a file from a byte on, and writes the position reached to the file MARK.
send_file() {
    local at=$2 next
    while [ "$at" -lt "$3" ]; do
        next=$(((at / CHUNK + 1) * CHUNK))
        [ "$next" -le "$3" ] || next=$3
        if [ $((at % CHUNK)) -eq 0 ]; then
            dd if="$1" bs="$CHUNK" skip=$((at / CHUNK)) count=1 2>/dev/null || return
        else
            tail -c "+$((at + 1))" "$1" | head -c $((next - at)) || return
        fi
        at=$next
        echo "$at" >"$4"
    done
}

megabytes() { printf '%d.%d MB' $(($1 / 1000000)) $(($1 / 100000 % 10)); }

# copy_to INDEX HOW FROM: sends the rest of the program; sets said and status. Ends when
# there is no progress for timeout_seconds.
copy_to() {
    local command file=$program size=$plain_size mark=$work/mark.$1 at=$3 seen pid quiet_since=$SECONDS reported=$SECONDS
    [ "$2" = plain ] || { file=$packed size=$packed_size; }
    ssh_to "$1"
    echo "$at" >"$mark"
    send_file "$file" "$at" "$size" "$mark" 2>/dev/null |
        "${command[@]}" "umask 077; cat >>.rayfarm/rayfarm-worker.$hash.$2.${names[$1]}.part" \
            >"$work/said.$1" 2>"$work/errors.$1" 3>&- &
    pid=$!
    while kill -0 "$pid" 2>/dev/null; do
        sleep 0.2
        seen=$(cat "$mark")
        if [ "$seen" != "$at" ]; then at=${seen:-$at} quiet_since=$SECONDS; fi
        if [ $((SECONDS - quiet_since)) -gt "$timeout_seconds" ]; then
            kill "$pid" 2>/dev/null || true
            wait "$pid" 2>/dev/null || true
            status=124 said="the copy stopped at $((100 * at / size)) % of $(megabytes "$size")"
            return
        fi
        if [ $((SECONDS - reported)) -ge "$REPORT_EVERY" ]; then
            reported=$SECONDS
            say "${names[$1]}: copying, $((100 * at / size)) % of $(megabytes "$size")" 2>&3
        fi
    done
    status=0
    wait "$pid" || status=$?
    said=$(cat "$work/said.$1" "$work/errors.$1")
    copied="copied $(megabytes "$size"); "
}
REPORT_EVERY=2

# Exit status of remote.sh where the program, or a part of it, must be copied first.
COPY_FIRST=9

# attempt INDEX: performs the action there; sets said and status. Resumes an interrupted copy as long as each attempt
# transfers more.
attempt() {
    local how from before=-1 problem="" problem_status=1
    run_remote "$1"
    while [ "$status" = "$COPY_FIRST" ]; do
        if ! [[ $said =~ rayfarm-copy\ (gzip|plain)\ ([0-9]+) ]]; then
            said="invalid answer: $said" status=1
            return
        fi
        how=${BASH_REMATCH[1]} from=${BASH_REMATCH[2]}
        if [ "$from" -le "$before" ]; then
            said=${problem:-the copy does not arrive complete} status=$problem_status
            return
        fi
        before=$from
        copy_to "$1" "$how" "$from"
        # Failures of ssh and timeouts may be temporary; failures of programs there are not.
        case $status in
            0 | 124 | 255) problem=$said problem_status=$status ;;
            *) said="the program cannot be copied: ${said:-exit status $status}"; return ;;
        esac
        [ "$status" != 0 ] || problem="" problem_status=1
        run_remote "$1"
    done
}

# visit INDEX: prints a line about the machine. Its status is that of the attempt.
visit() {
    local said="" status=0 copied=""
    attempt "$1"
    said=$(printf '%s' "$said" | tr '\r\n\t' '   ' | tr -d '[:cntrl:]' | tr -s ' ')
    said=${said# } said=${said% }
    case $status in
        0) printf '%-24s ok      %s\n' "${names[$1]}" "$copied$said"; return 0 ;;
        124) said="no answer within $timeout_seconds s${said:+: $said}" ;;
        255)
            case $said in
                *"Permission denied"*) said="ssh is not allowed to log in: $said" ;;
                *) said="cannot be reached: ${said:-ssh says nothing}" ;;
            esac
            ;;
    esac
    printf '%-24s FAILED  %s\n' "${names[$1]}" "${said:-exit status $status}"
    return 1
}

# describe INDEX: prints the action without performing it.
describe() {
    printf '%s: %s' "${names[$1]}" "$action"
    if [ "$action" = start ]; then
        printf ' rayfarm-worker %s\n' "$(options_of "$1")"
        printf '    after a copy of %s (%s) to ~/.rayfarm/rayfarm-worker, unless its SHA-256 is %s' \
            "$worker" "$(megabytes "$([ -n "$packed" ] && echo "$packed_size" || echo "$plain_size")")" "$hash"
    fi
    printf '\n    command: %s\n' "${ssh_words[*]}${ports[$1]:+ -p ${ports[$1]}} ${hosts[$1]} \"sh -s\""
}

# --- all machines -----------------------------------------------------------------------------------------------------

if [ "$dry_run" = yes ]; then
    for index in "${!hosts[@]}"; do describe "$index"; done
    exit 0
fi

outcomes=$work/outcomes
mkdir "$outcomes"
# Progress is printed at once, other output with the line of the machine.
exec 3>&2
# Jobs in the background do not receive Ctrl-C.
trap 'kill $(jobs -p) 2>/dev/null; say "interrupted: actions that were started there continue, and a copy continues with the next start"; exit 130' INT TERM

for index in "${!hosts[@]}"; do
    [ "$index" -lt "$jobs" ] || wait -n || true
    { visit "$index" && : >"$outcomes/$index"; } &
done
wait

succeeded=$(find "$outcomes" -type f | wc -l)
say "$action: $((succeeded)) of ${#hosts[@]} ok"
[ "$succeeded" -eq ${#hosts[@]} ]
