//! Tests of `scripts/workers.sh` with a shell in place of ssh: each folder represents a machine and is its home folder.

use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::process::Command;

use rayfarm_tests::{Outcome, Running, Scenes, free_port, master, project_root, wait_until, worker};

/// A replacement of ssh with the same arguments. A machine without a folder is unreachable. `$COPY` selects a fault of the
/// copy. Programs in the machine's folder `bin` take precedence.
const NOT_SSH: &str = r#"#!/bin/sh
while [ "$1" = -p ]; do shift 2; done
HOME=$MACHINES/$1 PATH=$MACHINES/$1/bin:$PATH
cd "$HOME" 2>/dev/null || { echo "ssh: connect to host $1: No route to host" >&2; exit 255; }
shift
export HOME PATH
case $*$COPY in
*"cat >>"*slow) (while :; do dd bs=65536 count=1 2>dd; grep -q '^0+0' dd && break; sleep 1; done) | sh -c "$*" ;;
*"cat >>"*cut) head -c 200000 | sh -c "$*"; echo "client_loop: Broken pipe" >&2; exit 255 ;;
*"cat >>"*silent) exec sleep 100 ;;
*no-gzip) mkdir -p tools; ln -sf /bin/* /usr/bin/* tools 2>ln; rm tools/gzip; PATH=$HOME/tools; exec sh -c "$*" ;;
*) exec sh -c "$*" ;;
esac
"#;

/// Returns a script that runs until it is killed and does not compress well: it ends with half a megabyte of noise.
fn big_program() -> Vec<u8> {
    let script = "#!/bin/sh\n[ \"$1\" = --version ] && exit\necho connected to the master\nwhile :; do sleep 0.1; done\n";
    let mut state = 1u64;
    let noise = std::iter::repeat_with(move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 56) as u8
    });
    script.bytes().chain(noise.take(500_000)).collect()
}

/// Some machines. Their workers end with the test.
struct Room {
    scenes: Scenes,
    port: u16,
}

impl Room {
    fn new(machines: &[&str], hosts: &str) -> Self {
        let room = Self { scenes: Scenes::new(), port: free_port() };
        for machine in machines {
            std::fs::create_dir(room.path(machine)).unwrap();
        }
        room.scenes.write("hosts", hosts);
        room.program("not-ssh", NOT_SSH);
        room
    }

    fn path(&self, name: &str) -> PathBuf {
        self.scenes.path(name)
    }

    fn program(&self, name: &str, text: &str) -> PathBuf {
        let path = self.scenes.write(name, text);
        std::fs::set_permissions(&path, PermissionsExt::from_mode(0o755)).unwrap();
        path
    }

    /// Runs `workers.sh ACTION hosts ARGUMENT ...`.
    fn workers(&self, action: &str, arguments: &[&str]) -> Outcome {
        self.workers_with("", action, arguments)
    }

    /// Runs `workers.sh` with a fault of the copy.
    fn workers_with(&self, copy: &str, action: &str, arguments: &[&str]) -> Outcome {
        let mut command = Command::new(project_root().join("scripts/workers.sh"));
        command.arg(action).arg(self.path("hosts")).arg("--ssh").arg(self.path("not-ssh"));
        command.args(arguments).env("MACHINES", self.path("")).env("COPY", copy).env_remove("RUST_LOG");
        Running::start(&mut command).finish()
    }

    /// Starts the worker under test on all machines.
    fn start(&self, more: &[&str]) -> Outcome {
        let program = worker().get_program().to_str().unwrap().to_owned();
        let master = format!("127.0.0.1:{}", self.port);
        self.workers("start", &[&["--master", &master, "--worker", &program], more].concat())
    }

    /// Starts the script of [`big_program`] on the machine `there`.
    fn start_big(&self, copy: &str, more: &[&str]) -> Outcome {
        let program = self.scenes.write("big", big_program());
        std::fs::set_permissions(&program, PermissionsExt::from_mode(0o755)).unwrap();
        let arguments = ["--master", "127.0.0.1:1", "--worker", program.to_str().unwrap()];
        self.workers_with(copy, "start", &[&arguments, more].concat())
    }

    /// Returns the names of the files that were copied to the machine `there`.
    fn files_there(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.path("there/.rayfarm")).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// Starts a master that begins to render when that number of workers is connected.
    fn master(&self, workers: &str) -> Running {
        let mut command = master();
        command
            .arg("render")
            .arg(self.path("small.toml"))
            .arg("-o")
            .arg(self.path("picture.ppm"))
            .arg("--json");
        command.args(["--no-local-workers", "--wait-for-workers", workers]);
        Running::start(command.args(["--listen", &format!("127.0.0.1:{}", self.port)]))
    }
}

impl Drop for Room {
    fn drop(&mut self) {
        self.workers("stop", &[]);
    }
}

/// Result of a worker in the second column of its line.
const OK: &str = "ok";
const FAILED: &str = "FAILED";

/// Returns the result of a worker: [`OK`] or [`FAILED`].
fn result<'a>(outcome: &'a Outcome, name: &str) -> &'a str {
    line(outcome, name).split_whitespace().nth(1).unwrap()
}

/// Returns the number of the process that the line about a worker names, if it names one.
fn process(outcome: &Outcome, name: &str) -> Option<u32> {
    let mut words = line(outcome, name).split_whitespace().skip_while(|word| *word != "process").skip(1);
    words.next().map(|word| word.trim_matches([',', ':']).parse().unwrap())
}

/// Returns the line about a worker.
fn line<'a>(outcome: &'a Outcome, name: &str) -> &'a str {
    let found = outcome.stdout.lines().find(|line| line.split_whitespace().next() == Some(name));
    assert!(found.is_some(), "no line about {name}: {outcome:#?}");
    found.unwrap()
}

#[test]
fn workers_are_started_listed_and_stopped() {
    let room = Room::new(&["near", "me@far"], "# two machines\nnear 1\n\n near - 2222 # again\nme@far 1");
    let names = ["near", "near-2", "me@far"];
    let _master = room.master("9");
    let outcome = room.workers("status", &[]);
    assert!(outcome.code == Some(1) && result(&outcome, "near-2") == FAILED, "{outcome:#?}");

    room.start(&[]).expect_success();
    let outcome = room.workers("status", &[]).expect_success();
    let processes = names.map(|name| process(&outcome, name));
    assert!(processes.iter().all(Option::is_some), "{outcome:#?}");
    let expect_same = |outcome: Outcome, expected: &str| {
        assert_eq!(names.map(|name| process(&outcome, name)), processes, "{outcome:#?}");
        assert!(names.iter().all(|name| result(&outcome, name) == expected), "{outcome:#?}");
    };
    expect_same(room.start(&[]).expect_success(), OK);
    let outcome = room.start(&["--", "--asset-cache", "64"]);
    assert_eq!(outcome.code, Some(1));
    expect_same(outcome, FAILED);

    expect_same(room.workers("stop", &["--jobs", "1"]).expect_success(), OK);
    assert_eq!(room.workers("status", &[]).code, Some(1));
    let outcome = room.workers("stop", &[]).expect_success();
    assert!(names.iter().all(|name| process(&outcome, name).is_none()), "{outcome:#?}");
}

#[test]
fn launched_workers_render_for_one_master_after_another() {
    let room = Room::new(&["a", "b"], "a 1\nb 1\n");
    let mut master = room.master("2");
    room.start(&["--jobs", "1"]).expect_success();
    for _ in 0..2 {
        let report = master.finish().expect_success().stdout;
        let report: serde_json::Value = serde_json::from_str(&report).unwrap();
        assert_eq!((&report["workers"], &report["threads"]), (&2.into(), &2.into()));
        room.workers("status", &[]).expect_success();
        master = room.master("2");
    }
    master.finish().expect_success();
    room.workers("stop", &[]).expect_success();
    room.start(&["--", "--once"]).expect_success();
    room.master("2").finish().expect_success();
    wait_until("the workers have ended with their master", || {
        let outcome = room.workers("status", &[]);
        ["a", "b"].iter().all(|name| result(&outcome, name) == FAILED)
    });
}

#[test]
fn a_copy_leaves_the_program_only() {
    let room = Room::new(&["there"], "there\n");
    std::fs::create_dir(room.path("there/.rayfarm")).unwrap();
    for left in [
        "rayfarm-worker.there.new",
        "rayfarm-worker.0123.gzip.there.part",
        "rayfarm-worker.0123.plain.x.part",
    ] {
        room.scenes.write(&format!("there/.rayfarm/{left}"), "a part of an older program");
    }
    let outcome = room.start_big("", &[]).expect_success();
    assert!(line(&outcome, "there").contains("0.5 MB"), "{outcome:#?}");
    assert_eq!(room.files_there(), ["rayfarm-worker", "there.log", "there.pid"]);
    assert!(room.scenes.read("there/.rayfarm/rayfarm-worker") == big_program());
    let outcome = room.start_big("", &[]).expect_success();
    assert!(!line(&outcome, "there").contains(" MB"), "{outcome:#?}");
}

#[test]
fn an_interrupted_copy_is_resumed() {
    let room = Room::new(&["there"], "there\n");
    let outcome = room.start_big("cut", &[]).expect_success();
    assert!(room.scenes.read("there/.rayfarm/rayfarm-worker") == big_program(), "{outcome:#?}");
    assert_eq!(room.files_there(), ["rayfarm-worker", "there.log", "there.pid"]);
}

#[test]
fn a_slow_copy_reports_its_progress_and_is_not_aborted() {
    let room = Room::new(&["there"], "there\n");
    // The copy takes eight seconds and makes progress every second.
    let outcome = room.start_big("slow", &["--timeout", "4"]).expect_success();
    let reports = |line: &str| line.contains("there") && line.contains(" % ") && line.contains("0.5 MB");
    assert!(outcome.stderr.lines().any(reports), "{outcome:#?}");
    assert!(room.scenes.read("there/.rayfarm/rayfarm-worker") == big_program());
}

#[test]
fn a_copy_without_progress_is_aborted_with_a_message() {
    let room = Room::new(&["there"], "there\n");
    let outcome = room.start_big("silent", &["--timeout", "2"]);
    assert_eq!(outcome.code, Some(1), "{outcome:#?}");
    let line = line(&outcome, "there");
    for fact in [FAILED, " 2 s", " % ", "0.5 MB"] {
        assert!(line.contains(fact), "no `{fact}`: {line}");
    }
}

#[test]
fn a_failure_is_reported_with_the_message_of_the_failed_program() {
    let room = Room::new(&["there"], "there\n");
    std::fs::create_dir(room.path("there/bin")).unwrap();
    let expect_failure = |program: &str, text: &str, words: &[&str]| {
        let path = room.program(&format!("there/bin/{program}"), text);
        let outcome = room.start_big("", &[]);
        assert_eq!(outcome.code, Some(1), "{outcome:#?}");
        for word in words {
            assert!(line(&outcome, "there").contains(word), "{word}: {outcome:#?}");
        }
        std::fs::remove_file(path).unwrap();
    };
    let full = "#!/bin/sh\necho 'cat: write error: No space left on device' >&2; exit 1\n";
    expect_failure("cat", full, &["cat: write error: No space left on device"]);
    // The message of gzip when the disk is full.
    let full = "#!/bin/sh\necho 'gzip: stdout: No space left on device' >&2; exit 1\n";
    expect_failure("gzip", full, &[".rayfarm/", "gzip: stdout: No space left on device"]);
    std::fs::remove_dir_all(room.path("there/.rayfarm")).unwrap();
    room.scenes.write("there/.rayfarm", "a file");
    expect_failure("unused", "", &[".rayfarm", "File exists"]);
}

#[test]
fn a_machine_without_gzip_receives_the_program_uncompressed() {
    let room = Room::new(&["there"], "there\n");
    let outcome = room.start_big("no-gzip", &[]).expect_success();
    assert!(line(&outcome, "there").contains("0.5 MB"), "{outcome:#?}");
    assert!(room.scenes.read("there/.rayfarm/rayfarm-worker") == big_program());
}

#[cfg(target_os = "linux")]
#[test]
fn a_program_for_another_architecture_is_not_copied() {
    let room = Room::new(&["there"], "there\n");
    std::fs::create_dir(room.path("there/bin")).unwrap();
    room.program("there/bin/uname", "#!/bin/sh\n[ \"$1\" = -m ] && echo m68k || echo Linux\n");
    let outcome = room.start(&[]);
    assert_eq!(outcome.code, Some(1), "{outcome:#?}");
    let line = line(&outcome, "there");
    assert!(line.contains("Linux m68k") && line.contains("--worker"), "{line}");
    assert_eq!(room.files_there(), Vec::<String>::new());
}

#[test]
fn host_files_with_windows_line_ends_are_read() {
    for text in [
        "\u{feff}# the room\r\nthere 8 7120\r\nme@[fe80::1%eth0] 2\r\n",
        "there 8 7120\rme@[fe80::1%eth0] 2\r",
        "there 8 7120\nme@fe80::1%eth0 2",
    ] {
        let room = Room::new(&[], text);
        let outcome = room.start(&["--dry-run"]).expect_success();
        for word in [
            "'--name' 'there'",
            "'--threads' '8'",
            "-p 7120 there ",
            "'--name' 'me@fe80::1%eth0'",
            "'--threads' '2'",
        ] {
            assert!(outcome.stdout.contains(word), "no `{word}`: {outcome:#?}");
        }
        assert!(!outcome.stdout.contains('\r'), "{outcome:#?}");
    }
    let room = Room::new(&[], "");
    room.scenes.write("hosts", b"\xff\xfet\0h\0e\0r\0e\0\n\0");
    room.start(&[]).expect_failure(2, &["UTF-16", "UTF-8"]);
    // The message about a wrong line has no control characters.
    room.scenes.write("hosts", "there 8 \u{1b}[2J\n");
    let outcome = room.start(&[]).expect_failure(2, &["hosts, line 1", "[2J"]);
    assert!(!outcome.stderr.contains('\u{1b}'), "{outcome:#?}");
}

#[test]
fn a_machine_that_fails_is_reported_and_the_others_continue() {
    let room = Room::new(&["there"], "gone 1\nthere 1\n");
    let _master = room.master("9");
    let outcome = room.start(&[]);
    assert_eq!(outcome.code, Some(1), "{outcome:#?}");
    assert_eq!((result(&outcome, "gone"), result(&outcome, "there")), (FAILED, OK), "{outcome:#?}");
    let gone = line(&outcome, "gone");
    assert!(gone.contains("ssh: connect to host gone: No route to host"), "{outcome:#?}");
    assert!(outcome.stderr.contains("1 of 2"), "{outcome:#?}");
}

#[test]
fn a_program_that_does_not_run_is_reported() {
    let room = Room::new(&["there"], "there\n");
    let program = room.program("strange", "#!/bin/sh\necho wrong kind of machine >&2\nexit 126\n");
    let outcome = room.workers("start", &["--master", "127.0.0.1:1", "--worker", program.to_str().unwrap()]);
    assert_eq!(outcome.code, Some(1));
    assert!(line(&outcome, "there").contains("wrong kind of machine"), "{outcome:#?}");
}

#[test]
fn every_argument_arrives_unchanged() {
    let room = Room::new(&["there"], "there 3\n");
    let program = room.program("echoes", "#!/bin/sh\nfor word; do echo \"$word\" >>\"$HOME/words\"; done\n");
    let odd = ["it's", "two  words", "$(touch broken)", "; touch broken #", "\"\\", "*", ""];
    let arguments = ["--master", "127.0.0.1:1", "--worker", program.to_str().unwrap(), "--"];
    let outcome = room.workers("start", &[&arguments[..], &odd[..]].concat());
    assert_eq!((outcome.code, result(&outcome, "there")), (Some(1), FAILED), "{outcome:#?}");
    let words = String::from_utf8(room.scenes.read("there/words")).unwrap();
    let expected =
        [&["--version", "--master", "127.0.0.1:1", "--name", "there", "--threads", "3"][..], &odd[..]]
            .concat();
    assert_eq!(words.lines().collect::<Vec<_>>(), expected);
    assert!(!room.path("there/broken").exists());
}

#[test]
fn a_dry_run_prints_the_commands_and_runs_none() {
    let room = Room::new(&["there"], "there 2 2222\n");
    let outcome = room.start(&["--dry-run"]).expect_success();
    for word in ["'--name' 'there'", "'--threads' '2'", "SHA-256", "-p 2222 there"] {
        assert!(outcome.stdout.contains(word), "no `{word}`: {outcome:#?}");
    }
    assert_eq!(std::fs::read_dir(room.path("there")).unwrap().count(), 0);
}

/// A program that records its arguments and its first line of standard input, and then runs like a worker.
const RECORDER: &str = "#!/bin/sh\n[ \"$1\" = --version ] && exit\necho \"$@\" >\"$HOME/arguments\"\n\
                        IFS= read -r line && printf '%s' \"$line\" >\"$HOME/line\"\n\
                        echo connected to the master\nwhile :; do sleep 0.1; done\n";

#[test]
fn a_join_line_reaches_workers_by_standard_input_only() {
    let room = Room::new(&["there"], "there\n");
    let program = room.program("rayfarm-worker", RECORDER);
    let token = "0123456789abcdef0123456789abcdef";
    let line = format!("rf1:farm.local:7117:{}:{token}", "ab".repeat(32));
    // The end of the pasted command is enough.
    room.scenes.write("join", format!("rayfarm-worker --join {line}\n"));
    let file = room.path("join");
    let arguments = ["--join", file.to_str().unwrap(), "--worker", program.to_str().unwrap()];
    let outcome = room.workers("start", &arguments);
    assert_eq!(result(&outcome, "there"), OK, "{outcome:#?}");
    assert_eq!(std::fs::read_to_string(room.path("there/line")).unwrap(), line);
    let recorded = std::fs::read_to_string(room.path("there/arguments")).unwrap();
    assert!(recorded.contains("--join -") && !recorded.contains(token), "{recorded}");
    assert!(!outcome.stdout.contains(token) && !outcome.stderr.contains(token), "{outcome:#?}");
    for name in room.files_there() {
        let bytes = std::fs::read(room.path("there/.rayfarm").join(&name)).unwrap();
        assert!(!String::from_utf8_lossy(&bytes).contains(token), "the token is in {name}");
    }
    let again = room.workers("start", &arguments);
    assert!(line_of(&again).contains("runs already"), "{again:#?}");
    let dry = room.workers("start", &[&arguments[..], &["--dry-run"]].concat());
    assert!(!dry.stdout.contains(token), "{dry:#?}");
}

fn line_of(outcome: &Outcome) -> &str {
    line(outcome, "there")
}

#[test]
fn a_join_line_on_the_command_line_of_the_script_is_refused() {
    let room = Room::new(&["there"], "there\n");
    let line = format!("rf1:farm.local:7117:{}:{}", "ab".repeat(32), "cd".repeat(16));
    room.workers("start", &["--join", &line]).expect_failure(2, &["--join -"]);
    room.workers("start", &["--join", "-", "--master", "a:1"]).expect_failure(2, &["either"]);
    room.scenes.write("other", "not a line\n");
    let other = room.path("other");
    room.workers("start", &["--join", other.to_str().unwrap()]).expect_failure(2, &["rf1:HOST:PORT"]);
    room.workers("stop", &["--join", "-"]).expect_failure(2, &["stop takes no"]);
}

#[test]
fn a_wrong_command_line_is_refused_before_any_connection() {
    for (hosts, word) in [
        ("there; touch broken\n", "line 1: \"there;\""),
        ("-oProxyCommand=touch\n", "line 1: \"-oProxyCommand=touch\""),
        ("there\nthere many\n", "line 2: \"many\""),
        ("there 1 port\n", "line 1: \"port\""),
        ("there 1 22 more\n", "line 1: "),
        ("# empty\n", ""),
    ] {
        let room = Room::new(&["there"], hosts);
        room.start(&[]).expect_failure(2, &["/hosts", word]);
        assert_eq!(std::fs::read_dir(room.path("there")).unwrap().count(), 0);
    }
    let room = Room::new(&["there"], "there\n");
    room.workers("start", &[]).expect_failure(2, &["--master"]);
    room.workers("begin", &[]).expect_failure(2, &["begin", "start", "status", "stop"]);
    room.workers("start", &["--master", "a:1", "--worker", "nowhere"])
        .expect_failure(2, &["nowhere", "--worker"]);
    room.workers("status", &["--jobs", "0"]).expect_failure(2, &["--jobs"]);
}
