//! Child processes with captured output, killed at the end of their test.

use std::io::{Read, Write};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

/// Time limit of every wait. It is long because machines are shared, and no test measures time with it.
const TIME_LIMIT: Duration = Duration::from_secs(180);

/// Exit status and output of a process that has ended.
#[derive(Debug)]
pub struct Outcome {
    /// Exit status, or `None` for a process that a signal has ended.
    pub code: Option<i32>,
    /// Text of standard output.
    pub stdout: String,
    /// Text of standard error.
    pub stderr: String,
}

impl Outcome {
    /// Fails the test unless the exit status is 0.
    pub fn expect_success(self) -> Self {
        assert_eq!(self.code, Some(0), "{self:#?}");
        self
    }

    /// Fails the test unless the exit status is `code` and standard error contains all of `words`.
    pub fn expect_failure(self, code: i32, words: &[&str]) -> Self {
        assert_eq!(self.code, Some(code), "{self:#?}");
        for word in words {
            assert!(self.stderr.contains(word), "standard error does not contain `{word}`: {self:#?}");
        }
        self
    }
}

/// A running process with its output so far. Killed when it is dropped.
pub struct Running {
    child: Child,
    stdin: Option<ChildStdin>,
    stdout: Capture,
    stderr: Capture,
    name: String,
}

/// Text of an output stream so far.
struct Capture {
    text: Arc<Mutex<String>>,
    reader: Option<thread::JoinHandle<()>>,
}

impl Capture {
    fn start(mut stream: impl Read + Send + 'static) -> Self {
        let text = Arc::new(Mutex::new(String::new()));
        let shared = Arc::clone(&text);
        let reader = thread::spawn(move || {
            let mut chunk = [0; 4096];
            while let Ok(count @ 1..) = stream.read(&mut chunk) {
                shared.lock().unwrap().push_str(&String::from_utf8_lossy(&chunk[..count]));
            }
        });
        Self { text, reader: Some(reader) }
    }

    fn so_far(&self) -> String {
        self.text.lock().unwrap().clone()
    }

    /// Waits for the end of the stream and returns all of its text.
    fn finish(&mut self) -> String {
        if let Some(reader) = self.reader.take() {
            reader.join().unwrap();
        }
        self.so_far()
    }
}

impl Running {
    /// Starts a command without standard input.
    pub fn start(command: &mut Command) -> Self {
        Self::spawn(command.stdin(Stdio::null()))
    }

    /// Starts a command whose standard input [`Running::write_line`] writes.
    pub fn start_with_stdin(command: &mut Command) -> Self {
        Self::spawn(command.stdin(Stdio::piped()))
    }

    fn spawn(command: &mut Command) -> Self {
        let name = format!("{command:?}");
        let mut child = command
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("cannot start {name}: {error}"));
        let stdout = Capture::start(child.stdout.take().unwrap());
        let stderr = Capture::start(child.stderr.take().unwrap());
        Self { stdin: child.stdin.take(), child, stdout, stderr, name }
    }

    /// Writes a line to standard input.
    pub fn write_line(&mut self, line: &str) {
        let stdin = self.stdin.as_mut().expect("started with start_with_stdin");
        writeln!(stdin, "{line}").unwrap_or_else(|error| panic!("cannot write to {}: {error}", self.name));
    }

    /// Returns standard output so far.
    pub fn stdout(&self) -> String {
        self.stdout.so_far()
    }

    /// Returns the process id.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Returns standard error so far.
    pub fn stderr(&self) -> String {
        self.stderr.so_far()
    }

    /// Waits until standard error contains `words`. Fails the test where the process ends first.
    pub fn wait_for(&mut self, words: &str) {
        let deadline = Instant::now() + TIME_LIMIT;
        while !self.stderr().contains(words) {
            let ended = self.child.try_wait().unwrap();
            assert!(
                ended.is_none() && Instant::now() < deadline,
                "{} did not write `{words}`; {ended:?}; standard error:\n{}",
                self.name,
                self.stderr()
            );
            thread::sleep(Duration::from_millis(10));
        }
    }

    /// Sends a signal by its name (`KILL`, `STOP`, `CONT`, `INT`, `TERM`).
    pub fn signal(&self, name: &str) {
        signal(self.id(), name);
    }

    /// Returns the ids of the child processes that run, without zombies.
    pub fn children(&self) -> Vec<u32> {
        let output = Command::new("ps").args(["-o", "pid=,stat=", "--ppid", &self.id().to_string()]).output();
        let text = String::from_utf8(output.unwrap().stdout).unwrap();
        let alive = text.lines().filter(|line| !line.contains('Z'));
        alive.map(|line| line.split_whitespace().next().unwrap().parse().unwrap()).collect()
    }

    /// Waits for the end of the process.
    pub fn finish(mut self) -> Outcome {
        let status = self.wait();
        // The streams end when no process has their pipes open. A grandchild that still runs would block here.
        Outcome { code: status.code(), stdout: self.stdout.finish(), stderr: self.stderr.finish() }
    }

    fn wait(&mut self) -> ExitStatus {
        let deadline = Instant::now() + TIME_LIMIT;
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status;
            }
            if Instant::now() > deadline {
                panic!("{} does not end; standard error:\n{}", self.name, self.stderr());
            }
            thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // Both fail where the process has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Sends a signal to a process.
pub(crate) fn signal(id: u32, name: &str) {
    let status = Command::new("kill").args([&format!("-{name}"), &id.to_string()]).status().unwrap();
    assert!(status.success(), "cannot send {name} to {id}");
}

/// Waits until a condition is true. Fails the test with `what` at the time limit.
pub fn wait_until(what: &str, mut condition: impl FnMut() -> bool) {
    let deadline = Instant::now() + TIME_LIMIT;
    while !condition() {
        assert!(Instant::now() < deadline, "the time limit is over before {what}");
        thread::sleep(Duration::from_millis(10));
    }
}
