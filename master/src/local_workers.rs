//! Worker processes on this machine: started with the farm, ended with it, started again when they die.
//!
//! Each one is this program run again as a worker. The master holds the other end of its standard input and never
//! writes to it: when the master dies, in whatever way, the pipe closes and the worker ends.

use std::ffi::OsString;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::path::PathBuf;
use std::process::{ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::{Duration, Instant};

use tokio::process::{Child, Command};
use tokio::sync::Notify;
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

use crate::app::cli::LOCAL_WORKER;
use crate::identity::{Tickets, local_name};

/// A worker that dies before it has lived this long died young.
const YOUNG: Duration = Duration::from_secs(30);
/// Deaths of young workers in a row before one is given up.
const MAX_YOUNG_DEATHS: u32 = 5;
/// The pause before a worker is started again; doubled with each young death.
const FIRST_PAUSE: Duration = Duration::from_millis(500);
/// How long a worker may take to end when it is asked to.
const ENDING: Duration = Duration::from_secs(3);

/// Where a local worker finds the name with which it introduces itself; other processes do not see it there.
const NAME_VARIABLE: &str = rayfarm_worker::cli::NAME_VARIABLE;

/// The places of local workers: which of them are empty, and how to fill them again.
#[derive(Debug, Default)]
pub(crate) struct Places {
    places: Vec<Place>,
    empty: AtomicU32,
}

/// The place of one local worker.
#[derive(Debug, Default)]
struct Place {
    is_empty: AtomicBool,
    start_again: Notify,
}

impl Places {
    fn new(count: u32) -> Self {
        Self { places: (0..count).map(|_| Place::default()).collect(), empty: AtomicU32::new(0) }
    }

    /// Places without a worker.
    pub(crate) fn gone(&self) -> u32 {
        self.empty.load(Ordering::Acquire)
    }

    /// Starts a worker in each empty place that `which` (by number, from 1) names. Returns how many.
    pub(crate) fn start_again(&self, which: impl Fn(u32) -> bool) -> u32 {
        let mut started = 0;
        for (_, place) in (1..).zip(&self.places).filter(|(number, _)| which(*number)) {
            if place.is_empty.swap(false, Ordering::AcqRel) {
                self.empty.fetch_sub(1, Ordering::AcqRel);
                place.start_again.notify_one();
                started += 1;
            }
        }
        started
    }

    /// A worker is not started again by itself. Whether it was the last one.
    fn leave(&self, place: &Place) -> bool {
        place.is_empty.store(true, Ordering::Release);
        self.empty.fetch_add(1, Ordering::AcqRel) + 1 == self.places.len() as u32
    }
}

/// What to start.
#[derive(Clone, Debug)]
pub(crate) struct LocalWorkers {
    pub(crate) program: PathBuf,
    pub(crate) count: u32,
    /// Render threads of each; `None` divides the cores.
    pub(crate) threads: Option<usize>,
    /// Where the master listens.
    pub(crate) listening: SocketAddr,
}

impl LocalWorkers {
    /// Starts all of them, each with a task that looks after it until `stop`. Whenever the last one has left or cannot
    /// be kept running, `given_up` is called with the reason.
    pub(crate) fn start(
        self,
        tickets: &Tickets,
        tasks: &TaskTracker,
        stop: &CancellationToken,
        given_up: impl Fn(String) + Send + Sync + 'static,
    ) -> Arc<Places> {
        let places = Arc::new(Places::new(self.count));
        let given_up = Arc::new(given_up);
        for number in 1..=self.count {
            let (places, given_up, stop) = (places.clone(), given_up.clone(), stop.clone());
            let name = tickets.of(number).unwrap_or_else(|| local_name(number));
            let nursery =
                Nursery { number, name, program: self.program.clone(), args: self.args(number - 1) };
            tasks.spawn(async move {
                while let Some(reason) = nursery.run(&stop).await {
                    let Some(place) = places.places.get(number as usize - 1) else { return };
                    if places.leave(place) {
                        given_up(reason);
                    }
                    tokio::select! {
                        () = stop.cancelled() => return,
                        () = place.start_again.notified() => {}
                    }
                }
            });
        }
        places
    }

    fn args(&self, number: u32) -> Vec<OsString> {
        let master = reachable(self.listening).to_string();
        let mut args = vec![LOCAL_WORKER.to_owned(), "--master".into(), master, "--exit-with-stdin".into()];
        // What becomes of it, the master tells; only what is wrong it tells itself.
        args.extend(["--once".into(), "--quiet".into()]);
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        if let Some(threads) = self.threads.or_else(|| share(cores, self.count, number)) {
            args.extend(["--threads".into(), threads.to_string()]);
        }
        args.into_iter().map(OsString::from).collect()
    }
}

/// The address under which a process of this machine reaches a listener.
fn reachable(listening: SocketAddr) -> SocketAddr {
    let ip = match listening.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => Ipv4Addr::LOCALHOST.into(),
        IpAddr::V6(ip) if ip.is_unspecified() => Ipv6Addr::LOCALHOST.into(),
        ip => ip,
    };
    match listening {
        // It keeps its scope.
        SocketAddr::V6(address) if !address.ip().is_unspecified() => listening,
        _ => SocketAddr::new(ip, listening.port()),
    }
}

/// The `number`th worker's share of the cores, at least one; a single worker takes what it finds.
fn share(cores: usize, workers: u32, number: u32) -> Option<usize> {
    let (workers, number) = (workers as usize, number as usize);
    let extra = usize::from(number < cores.checked_rem(workers)?);
    (workers > 1).then_some((cores / workers + extra).max(1))
}

/// One place for a worker process.
struct Nursery {
    number: u32,
    /// What it introduces itself with.
    name: String,
    program: PathBuf,
    args: Vec<OsString>,
}

impl Nursery {
    /// Keeps a worker running. Returns why it was given up; `None` when it was stopped.
    async fn run(&self, stop: &CancellationToken) -> Option<String> {
        let mut young_deaths = 0;
        loop {
            let born = Instant::now();
            let end = match self.spawn() {
                Ok(mut child) => {
                    // Waiting for a child closes its standard input, and with that would end it: hold it elsewhere.
                    let stdin = child.stdin.take();
                    tokio::select! {
                        biased;
                        () = stop.cancelled() => {
                            drop(stdin);
                            end(&mut child, self.number).await;
                            return None;
                        }
                        status = child.wait() => {
                            if status.as_ref().is_ok_and(ExitStatus::success) {
                                // It failed at nothing: it was drained, kicked, or stopped by hand.
                                return Some(format!("local worker {} has left in order", self.number));
                            }
                            told(status)
                        }
                    }
                }
                Err(error) => format!("cannot be started from {}: {error}", self.program.display()),
            };
            let number = self.number;
            young_deaths = if born.elapsed() < YOUNG { young_deaths + 1 } else { 1 };
            if young_deaths >= MAX_YOUNG_DEATHS {
                let reason = format!("local worker {number} {end}, {young_deaths} times in a row");
                tracing::error!("{reason}; it is not started again");
                return Some(reason);
            }
            let pause = FIRST_PAUSE * (1 << (young_deaths - 1));
            tracing::warn!("local worker {number} {end}; starting it again in {} ms", pause.as_millis());
            tokio::select! {
                () = stop.cancelled() => return None,
                () = tokio::time::sleep(pause) => {}
            }
        }
    }

    fn spawn(&self) -> std::io::Result<Child> {
        let mut command = Command::new(&self.program);
        command.args(&self.args).env(NAME_VARIABLE, &self.name);
        command.stdin(Stdio::piped()).stdout(Stdio::null()).kill_on_drop(true);
        // Ctrl-C is the master's to hear: it says goodbye to its workers in order.
        #[cfg(unix)]
        command.process_group(0);
        command.spawn()
    }
}

/// Waits for a worker that has been asked to end, and kills it if it does not.
async fn end(child: &mut Child, number: u32) {
    if tokio::time::timeout(ENDING, child.wait()).await.is_err() {
        tracing::warn!("local worker {number} does not end within {} s and is killed", ENDING.as_secs());
        // It fails only for a process that has ended meanwhile.
        let _ = child.kill().await;
    }
}

fn told(status: std::io::Result<ExitStatus>) -> String {
    match status {
        Ok(status) => format!("ended ({status})"),
        Err(error) => format!("cannot be waited for: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cores_are_divided_and_nobody_goes_without() {
        let shares = |cores, workers| (0..workers).map(|n| share(cores, workers, n)).collect::<Vec<_>>();
        assert_eq!(shares(8, 1), [None]);
        assert_eq!(shares(8, 3), [Some(3), Some(3), Some(2)]);
        assert_eq!(shares(2, 4), [Some(1); 4]);
    }

    #[test]
    fn workers_are_told_an_address_that_they_can_reach() {
        for (listening, master) in [
            ("0.0.0.0:7117", "127.0.0.1:7117"),
            ("[::]:7", "[::1]:7"),
            ("10.1.2.3:4", "10.1.2.3:4"),
            ("[fe80::1%3]:4", "[fe80::1%3]:4"),
        ] {
            assert_eq!(reachable(listening.parse().unwrap()).to_string(), master);
        }
    }

    fn nursery(program: &str, args: Vec<OsString>) -> Nursery {
        Nursery { number: 1, name: local_name(1), program: program.into(), args }
    }

    #[tokio::test]
    async fn a_worker_that_cannot_live_is_given_up_with_the_reason() {
        let nursery = nursery("/nonexistent/worker", Vec::new());
        tokio::time::pause();
        let reason = nursery.run(&CancellationToken::new()).await.unwrap();
        assert!(reason.contains("/nonexistent/worker") && reason.contains("5 times"), "{reason}");
    }

    #[cfg(unix)]
    #[tokio::test]
    async fn a_worker_ends_with_its_standard_input() {
        let tasks = TaskTracker::new();
        let stop = CancellationToken::new();
        let folder = tempfile::tempdir().unwrap();
        let ended = folder.path().join("ended");
        let script = format!("cat; touch {}", ended.display());
        let args = ["-c".into(), script.into()].to_vec();
        let shell = nursery("sh", args);
        let stopped = stop.clone();
        let task = tasks.spawn(async move { shell.run(&stopped).await });
        // Its standard input is open for as long as it is wanted.
        tokio::time::sleep(Duration::from_millis(300)).await;
        assert!(!ended.exists());
        stop.cancel();
        assert_eq!(task.await.unwrap(), None);
        assert!(ended.exists());
    }
}
