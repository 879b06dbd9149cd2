# shellcheck shell=sh
# What scripts/workers.sh has sh read on a machine, after lines that set action, name, hash, machine, plain_size, packed_size
# and the worker's options ("$@"). Says in one line what came of it. Exit status: 0 well; 9 the program, or the rest of it,
# is to be copied first, and the line says how and from which byte on; 1 anything else.
# shellcheck disable=SC2154 # they are set in front of this text

folder=$HOME/.rayfarm
program=$folder/rayfarm-worker
pid_file=$folder/$name.pid
log=$folder/$name.log

give_up() { echo "$*"; exit 1; }

hash_of() {
    if command -v sha256sum >/dev/null; then sha256sum <"$1"; else shasum -a 256 <"$1"; fi | cut -d ' ' -f 1
}

# alive ID: not where it has ended and only waits for somebody to ask how.
alive() {
    kill -0 "$1" 2>/dev/null || return 1
    case $(ps -p "$1" -o stat=) in "" | Z*) return 1 ;; esac
}

# Prints the worker's id if it runs. Ids are used again: what does not bear its name is another program.
running() {
    { read -r pid <"$pid_file"; } 2>/dev/null || return 1
    alive "$pid" || return 1
    case $(ps -p "$pid" -o comm=) in *rayfarm-worker*) echo "$pid" ;; *) return 1 ;; esac
}

# Short where sleep knows fractions.
pause() { sleep 0.2 2>/dev/null || sleep 1; }

last_words() { tail -n 1 "$log" 2>/dev/null | cut -c 1-200; }

# Since the worker was started.
has_joined() { grep -q 'connected to the master' "$log" 2>/dev/null; }

size_of() { if [ -f "$1" ]; then wc -c <"$1" | tr -d ' '; else echo 0; fi; }

# What was left there by a copy that never became whole, and by other versions.
tidy() {
    for left in "$folder"/rayfarm-worker.*.part; do
        case $left in "$folder/rayfarm-worker.$hash."*) ;; *) rm -f "$left" ;; esac
    done
    rm -f "$folder/rayfarm-worker.$name.new"
    find "$folder" -name 'rayfarm-worker.*' \( -name '*.part' -o -name '*.new' \) -mtime +1 -exec rm -f {} + 2>/dev/null
    return 0
}

# A program for another kind of machine is not worth copying.
check_kind() {
    [ -n "$machine" ] || return 0
    here=$(uname -m)
    case $here in amd64) here=x86_64 ;; arm64 | armv8*) here=aarch64 ;; armv*) here=arm ;; esac
    [ "$here" = "$machine" ] ||
        give_up "this machine is of another kind ($(uname -s) $here) than the program (for $machine): build it there, and name it with --worker"
}

# Puts the program in its place where its copy is whole, and asks for the rest of the copy where it is not.
install() {
    how=plain size=$plain_size
    if [ "$packed_size" -gt 0 ] && command -v gzip >/dev/null; then how=gzip size=$packed_size; fi
    part=$folder/rayfarm-worker.$hash.$how.$name.part
    new=$folder/rayfarm-worker.$name.new
    have=$(size_of "$part")
    if [ "$have" -ge "$size" ]; then
        case $how in gzip) unpack="gzip -dc" ;; *) unpack="cat" ;; esac
        problem=$($unpack <"$part" 2>&1 >"$new") || case $problem in
            *space* | *quota* | *denied*) rm -f "$new"; give_up "cannot write $new: $problem" ;;
        esac
        if [ "$(hash_of "$new")" = "$hash" ]; then
            problem=$({ chmod 755 "$new" && mv -f "$new" "$program" && rm -f "$part"; } 2>&1) || give_up "cannot put the program in place: $problem"
            return
        fi
        # Damaged: from the beginning again.
        rm -f "$new" "$part"
        have=0
    fi
    echo "rayfarm-copy $how $have"
    exit 9
}

start() {
    umask 077
    problem=$(mkdir -p "$folder" 2>&1) || give_up "cannot make $folder: $problem"
    check_kind
    tidy
    [ -x "$program" ] && [ "$(hash_of "$program")" = "$hash" ] || install
    version=$("$program" --version 2>&1) || give_up "the program does not run here: $version"
    options=$*
    if pid=$(running); then
        [ "$(sed -n 2p "$pid_file")" = "$hash $options" ] && { echo "runs already, process $pid"; return; }
        give_up "another one runs, process $pid: stop it first"
    fi
    [ ! -f "$log" ] || mv -f "$log" "$log.old"
    # A session of its own where that is at hand, so that no terminal's end is its end.
    detach=$(command -v setsid) || detach=
    # shellcheck disable=SC2086 # nothing, or one word
    nohup $detach "$program" "$@" </dev/null >"$log" 2>&1 &
    printf '%s\n%s\n' "$!" "$hash $options" >"$pid_file" || give_up "cannot write $pid_file"
    await_news "$!"
}

# A worker that has no master yet is well as well: it goes on trying.
await_news() {
    looks=0
    while [ "$looks" -lt 25 ] && ! has_joined; do
        pause
        alive "$1" || has_joined || give_up "it ended at once: $(last_words)"
        looks=$((looks + 1))
    done
    if has_joined; then echo "process $1, has joined$(alive "$1" || echo ", and has left again: $(last_words)")"; else echo "process $1, not joined yet: $(last_words)"; fi
}

status() {
    pid=$(running) || give_up "does not run"
    if has_joined; then echo "runs, process $pid: $(last_words)"; else echo "process $pid, not joined yet: $(last_words)"; fi
}

stop() {
    rm -f "$folder"/rayfarm-worker.*."$name.part" "$folder/rayfarm-worker.$name.new"
    pid=$(running) || { rm -f "$pid_file"; echo "does not run"; return; }
    kill -TERM "$pid"
    looks=0
    while [ "$looks" -lt 50 ] && running >/dev/null; do
        pause
        looks=$((looks + 1))
    done
    how=stopped
    if running >/dev/null; then
        kill -KILL "$pid" || give_up "process $pid cannot be ended"
        how="killed: it did not end by itself"
    fi
    rm -f "$pid_file"
    echo "process $pid, $how"
}

"$action" "$@"
