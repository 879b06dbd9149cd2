# shellcheck shell=sh
# The part of scripts/workers.sh that sh runs on each machine. Lines in front of it set action, name, hash, machine, plain_size,
# packed_size, join_line (empty without encryption) and the worker's options ("$@"). Prints one line with the result. Exit
# status: 0 success; 9 the program, or the rest of it, must be copied first, and the line has the encoding and the first byte;
# 1 any failure.
# shellcheck disable=SC2154 # set in front of this text

folder=$HOME/.rayfarm
program=$folder/rayfarm-worker
pid_file=$folder/$name.pid
log=$folder/$name.log

refuse() { echo "$*"; exit 1; }

hash_of() {
    if command -v sha256sum >/dev/null; then sha256sum <"$1"; else shasum -a 256 <"$1"; fi | cut -d ' ' -f 1
}

# alive ID: whether a process runs; zombies do not.
alive() {
    kill -0 "$1" 2>/dev/null || return 1
    case $(ps -p "$1" -o stat=) in "" | Z*) return 1 ;; esac
}

# Prints the id of the worker's process if it runs. Systems reuse ids, so the name of the program is compared as well.
running() {
    { read -r pid <"$pid_file"; } 2>/dev/null || return 1
    alive "$pid" || return 1
    case $(ps -p "$pid" -o comm=) in *rayfarm-worker*) echo "$pid" ;; *) return 1 ;; esac
}

# 0.2 s where sleep accepts fractions, else 1 s.
pause() { sleep 0.2 2>/dev/null || sleep 1; }

last_line() { tail -n 1 "$log" 2>/dev/null | cut -c 1-200; }

# Whether the worker has connected since it was started.
has_joined() { grep -q 'connected to the master' "$log" 2>/dev/null; }

size_of() { if [ -f "$1" ]; then wc -c <"$1" | tr -d ' '; else echo 0; fi; }

# Removes files of incomplete copies and of other versions.
tidy() {
    for old in "$folder"/rayfarm-worker.*.part; do
        case $old in "$folder/rayfarm-worker.$hash."*) ;; *) rm -f "$old" ;; esac
    done
    rm -f "$folder/rayfarm-worker.$name.new"
    find "$folder" -name 'rayfarm-worker.*' \( -name '*.part' -o -name '*.new' \) -mtime +1 -exec rm -f {} + 2>/dev/null
    return 0
}

# Fails where the program is for another architecture, before it is copied.
check_kind() {
    [ -n "$machine" ] || return 0
    here=$(uname -m)
    case $here in amd64) here=x86_64 ;; arm64 | armv8*) here=aarch64 ;; armv*) here=arm ;; esac
    [ "$here" = "$machine" ] ||
        refuse "this machine is of another kind ($(uname -s) $here) than the program (for $machine): build it there, and name it with --worker"
}

# Installs the program where its copy is complete, and requests the rest of the copy otherwise.
install() {
    how=plain size=$plain_size
    if [ "$packed_size" -gt 0 ] && command -v gzip >/dev/null; then how=gzip size=$packed_size; fi
    part=$folder/rayfarm-worker.$hash.$how.$name.part
    new=$folder/rayfarm-worker.$name.new
    have=$(size_of "$part")
    if [ "$have" -ge "$size" ]; then
        case $how in gzip) unpack="gzip -dc" ;; *) unpack="cat" ;; esac
        problem=$($unpack <"$part" 2>&1 >"$new") || case $problem in
            *space* | *quota* | *denied*) rm -f "$new"; refuse "cannot write $new: $problem" ;;
        esac
        if [ "$(hash_of "$new")" = "$hash" ]; then
            problem=$({ chmod 755 "$new" && mv -f "$new" "$program" && rm -f "$part"; } 2>&1) || refuse "cannot install the program: $problem"
            return
        fi
        # Damaged: the copy starts again.
        rm -f "$new" "$part"
        have=0
    fi
    echo "rayfarm-copy $how $have"
    exit 9
}

start() {
    umask 077
    problem=$(mkdir -p "$folder" 2>&1) || refuse "cannot make $folder: $problem"
    check_kind
    tidy
    [ -x "$program" ] && [ "$(hash_of "$program")" = "$hash" ] || install
    version=$("$program" --version 2>&1) || refuse "the program does not run here: $version"
    # With the master's address and key, and without the token, which is in no file here but the worker's own.
    options="$*${join_line:+ ${join_line%:*}}"
    if pid=$(running); then
        [ "$(sed -n 2p "$pid_file")" = "$hash $options" ] && { echo "runs already, process $pid"; return; }
        refuse "another one runs, process $pid: stop it first"
    fi
    [ ! -f "$log" ] || mv -f "$log" "$log.old"
    start_program "$@"
    printf '%s\n%s\n' "$!" "$hash $options" >"$pid_file" || refuse "cannot write $pid_file"
    await_connection "$!"
}

# start_program OPTION ...: starts the worker in the background; its id is in $!. In a session of its own where setsid exists,
# so that the worker survives its terminal. The join line goes through a here-document, which is a pipe or an unnamed file
# for this user only, and thus is in no list of processes.
start_program() {
    detach=$(command -v setsid) || detach=
    # shellcheck disable=SC2086 # nothing, or one word
    nohup $detach "$program" "$@" >"$log" 2>&1 <<LINE &
$join_line
LINE
}

# await_connection ID: waits up to 5 s for the connection. A worker without a master is no failure: it keeps trying.
await_connection() {
    checks=0
    while [ "$checks" -lt 25 ] && ! has_joined; do
        pause
        alive "$1" || has_joined || refuse "it ended at once: $(last_line)"
        checks=$((checks + 1))
    done
    if has_joined; then echo "process $1, has joined$(alive "$1" || echo ", and has left again: $(last_line)")"; else echo "process $1, not joined yet: $(last_line)"; fi
}

status() {
    pid=$(running) || refuse "does not run"
    if has_joined; then echo "runs, process $pid: $(last_line)"; else echo "process $pid, not joined yet: $(last_line)"; fi
}

stop() {
    rm -f "$folder"/rayfarm-worker.*."$name.part" "$folder/rayfarm-worker.$name.new"
    pid=$(running) || { rm -f "$pid_file"; echo "does not run"; return; }
    kill -TERM "$pid"
    checks=0
    while [ "$checks" -lt 50 ] && running >/dev/null; do
        pause
        checks=$((checks + 1))
    done
    how=stopped
    if running >/dev/null; then
        kill -KILL "$pid" || refuse "process $pid cannot be ended"
        how="killed: it did not end by itself"
    fi
    rm -f "$pid_file"
    echo "process $pid, $how"
}

"$action" "$@"
