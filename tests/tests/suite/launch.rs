//! `scripts/workers.sh` with a shell in place of ssh: a folder is a machine, and its home.

use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::process::Command;

use rayfarm_tests::{Outcome, Running, Scenes, free_port, master, project_root, wait_until, worker};

/// Takes what ssh takes. A machine that has no folder cannot be reached.
const NOT_SSH: &str = r#"#!/bin/sh
while [ "$1" = -p ]; do shift 2; done
HOME=$MACHINES/$1
cd "$HOME" || exit 255
shift
export HOME
exec sh -c "$*"
"#;

/// Some machines, whose workers end with the test.
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

    /// `workers.sh ACTION hosts ARGUMENT ...`
    fn workers(&self, action: &str, arguments: &[&str]) -> Outcome {
        let mut command = Command::new(project_root().join("scripts/workers.sh"));
        command.arg(action).arg(self.path("hosts")).arg("--ssh").arg(self.path("not-ssh"));
        command.args(arguments).env("MACHINES", self.path("")).env_remove("RUST_LOG");
        Running::start(&mut command).finish()
    }

    fn start(&self, more: &[&str]) -> Outcome {
        let program = worker().get_program().to_str().unwrap().to_owned();
        let master = format!("127.0.0.1:{}", self.port);
        self.workers("start", &[&["--master", &master, "--worker", &program], more].concat())
    }

    /// A master that begins to render when so many workers are there.
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

/// The line about a worker.
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
    assert!(outcome.code == Some(1) && line(&outcome, "near-2").contains("does not run"), "{outcome:#?}");

    room.start(&[]).expect_success();
    let mut seen = String::new();
    wait_until("all have joined", || {
        seen = room.workers("status", &[]).expect_success().stdout;
        seen.matches("runs, process").count() == names.len()
    });
    let outcome = room.start(&[]).expect_success();
    assert!(names.iter().all(|name| line(&outcome, name).contains("runs already")), "{outcome:#?}");
    let outcome = room.start(&["--", "--asset-cache", "64"]);
    assert!(outcome.code == Some(1) && line(&outcome, "near").contains("stop it first"), "{outcome:#?}");

    let outcome = room.workers("stop", &["--jobs", "1"]).expect_success();
    assert!(names.iter().all(|name| line(&outcome, name).contains("process")), "{outcome:#?}");
    assert_eq!(room.workers("status", &[]).code, Some(1));
    room.workers("stop", &[]).expect_success();
}

#[test]
fn launched_workers_render() {
    let room = Room::new(&["a", "b"], "a 1\nb 1\n");
    let master = room.master("2");
    room.start(&["--jobs", "1"]).expect_success();
    let report: serde_json::Value = serde_json::from_str(&master.finish().expect_success().stdout).unwrap();
    assert_eq!((&report["workers"], &report["threads"]), (&2.into(), &2.into()));
    wait_until("the workers have ended with their master", || {
        room.workers("status", &[]).stdout.matches("does not run").count() == 2
    });
}

#[test]
fn a_machine_that_fails_is_named_and_the_others_go_on() {
    let room = Room::new(&["there"], "gone 1\nthere 1\n");
    let _master = room.master("9");
    let outcome = room.start(&[]);
    assert_eq!(outcome.code, Some(1), "{outcome:#?}");
    assert!(line(&outcome, "gone").contains("FAILED  cannot be reached"), "{outcome:#?}");
    assert!(line(&outcome, "there").contains(" ok "), "{outcome:#?}");
    assert!(outcome.stderr.contains("1 of 2"), "{outcome:#?}");
}

#[test]
fn a_program_of_another_kind_of_machine_is_told_of() {
    let room = Room::new(&["there"], "there\n");
    let program = room.program("strange", "#!/bin/sh\necho wrong kind of machine >&2\nexit 126\n");
    let outcome = room.workers("start", &["--master", "127.0.0.1:1", "--worker", program.to_str().unwrap()]);
    assert_eq!(outcome.code, Some(1));
    assert!(line(&outcome, "there").contains("does not run here: wrong kind of machine"), "{outcome:#?}");
}

#[test]
fn every_word_arrives_as_it_was_given() {
    let room = Room::new(&["there"], "there 3\n");
    let program = room.program("echoes", "#!/bin/sh\nfor word; do echo \"$word\" >>\"$HOME/words\"; done\n");
    let odd = ["it's", "two  words", "$(touch broken)", "; touch broken #", "\"\\", "*", ""];
    let arguments = ["--master", "127.0.0.1:1", "--worker", program.to_str().unwrap(), "--"];
    let outcome = room.workers("start", &[&arguments[..], &odd[..]].concat());
    assert!(line(&outcome, "there").contains("it ended at once"), "{outcome:#?}");
    let words = String::from_utf8(room.scenes.read("there/words")).unwrap();
    let expected =
        [&["--version", "--master", "127.0.0.1:1", "--name", "there", "--threads", "3"][..], &odd[..]]
            .concat();
    assert_eq!(words.lines().collect::<Vec<_>>(), expected);
    assert!(!room.path("there/broken").exists());
}

#[test]
fn a_dry_run_tells_what_would_be_done_and_touches_nothing() {
    let room = Room::new(&["there"], "there 2 2222\n");
    let outcome = room.start(&["--dry-run"]).expect_success();
    for word in ["there: start", "'--threads' '2'", "SHA-256", "-p 2222 there"] {
        assert!(outcome.stdout.contains(word), "no `{word}`: {outcome:#?}");
    }
    assert_eq!(std::fs::read_dir(room.path("there")).unwrap().count(), 0);
}

#[test]
fn wrong_use_is_refused_before_any_machine_is_asked() {
    for (hosts, word) in [
        ("there; touch broken\n", "is no [user@]host"),
        ("-oProxyCommand=touch\n", "is no [user@]host"),
        ("there many\n", "is no number of threads"),
        ("there 1 port\n", "is no port"),
        ("there 1 22 more\n", "line 1"),
        ("# nobody\n", "names no host"),
    ] {
        let room = Room::new(&["there"], hosts);
        room.start(&[]).expect_failure(2, &[word]);
        assert_eq!(std::fs::read_dir(room.path("there")).unwrap().count(), 0);
    }
    let room = Room::new(&["there"], "there\n");
    room.workers("start", &[]).expect_failure(2, &["--master"]);
    room.workers("begin", &[]).expect_failure(2, &["start, status or stop"]);
    room.workers("start", &["--master", "a:1", "--worker", "nowhere"]).expect_failure(2, &["cargo build"]);
    room.workers("status", &["--jobs", "0"]).expect_failure(2, &["--jobs"]);
}
