//! Supervision of local worker processes: they start and end with the farm, and are restarted when they fail.

use std::ffi::OsString;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::Arc;

use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

mod process;
mod slots;

use rayfarm_protocol::transport::MasterSecurity;

use crate::sessions::addresses::Entrance;
use crate::sessions::identity::{Tickets, local_name};
use process::Supervisor;

pub(crate) use slots::LocalSlots;

/// The command line of a local worker.
#[derive(Clone, Debug, Default)]
pub struct LocalWorkerCommand {
    /// Program of the local workers.
    pub program: PathBuf,
    /// Arguments before those of a worker.
    pub args: Vec<OsString>,
    /// The environment variable from which the worker reads its name. Processes of other users cannot read it.
    pub name_variable: String,
}

/// The local workers to start.
#[derive(Clone, Debug)]
pub(crate) struct LocalWorkers {
    pub(crate) command: LocalWorkerCommand,
    pub(crate) count: u32,
    /// Render threads of each; `None` divides the cores.
    pub(crate) threads: Option<usize>,
    /// Where and how they connect.
    pub(crate) entrance: Entrance,
}

impl LocalWorkers {
    /// Starts all of them, each with a task that supervises it until `stop`. `on_all_exited` is called with the reason
    /// whenever the last running one has exited for good.
    pub(crate) fn start(
        self,
        tickets: &Tickets,
        tasks: &TaskTracker,
        stop: &CancellationToken,
        on_all_exited: impl Fn(String) + Send + Sync + 'static,
    ) -> Arc<LocalSlots> {
        let slots = Arc::new(LocalSlots::new(self.count));
        let on_all_exited = Arc::new(on_all_exited);
        for number in 1..=self.count {
            let (slots, on_all_exited, stop) = (slots.clone(), on_all_exited.clone(), stop.clone());
            let name = tickets.of(number).unwrap_or_else(|| local_name(number));
            let supervisor = Supervisor {
                number,
                name,
                command: self.command(number - 1),
                entrance: self.entrance.clone(),
            };
            tasks.spawn(async move {
                while let Some(reason) = supervisor.run(&stop).await {
                    let Some(slot) = slots.get(number) else { return };
                    if slots.vacate(slot) {
                        on_all_exited(reason);
                    }
                    tokio::select! {
                        () = stop.cancelled() => return,
                        () = slot.restarted() => {}
                    }
                }
            });
        }
        slots
    }

    /// The command line of the worker with this index, from 0.
    fn command(&self, index: u32) -> LocalWorkerCommand {
        let mut args = match self.entrance.security {
            MasterSecurity::Plain => {
                vec!["--master".to_owned(), reachable(self.entrance.address).to_string()]
            }
            // The line itself comes over standard input: the process list is readable for all users.
            MasterSecurity::Tls(_) => vec!["--join".to_owned(), "-".to_owned(), "--no-remember".to_owned()],
        };
        args.push("--exit-with-stdin".into());
        // The master logs its joining and leaving; the worker itself logs only errors.
        args.extend(["--once".into(), "--quiet".into()]);
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        if let Some(threads) = self.threads.or_else(|| share(cores, self.count, index)) {
            args.extend(["--threads".into(), threads.to_string()]);
        }
        let mut command = self.command.clone();
        command.args.extend(args.into_iter().map(OsString::from));
        command
    }
}

/// The line with which a process of this machine joins; `None` where connections are plain.
fn join_line(entrance: &Entrance) -> Option<String> {
    match &entrance.security {
        MasterSecurity::Plain => None,
        MasterSecurity::Tls(trust) => {
            Some(trust.join_line(reachable(entrance.address).to_string()).to_string())
        }
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
        // The address keeps its scope.
        SocketAddr::V6(address) if !address.ip().is_unspecified() => listening,
        _ => SocketAddr::new(ip, listening.port()),
    }
}

/// The share of the cores, at least one, of the worker with this index; `None` for a single worker, which uses all cores.
fn share(cores: usize, workers: u32, index: u32) -> Option<usize> {
    let (workers, index) = (workers as usize, index as usize);
    let extra = usize::from(index < cores.checked_rem(workers)?);
    (workers > 1).then_some((cores / workers + extra).max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cores_are_divided_and_each_worker_gets_one() {
        let shares = |cores, workers| (0..workers).map(|n| share(cores, workers, n)).collect::<Vec<_>>();
        assert_eq!(shares(8, 1), [None]);
        assert_eq!(shares(8, 3), [Some(3), Some(3), Some(2)]);
        assert_eq!(shares(2, 4), [Some(1); 4]);
    }

    #[test]
    fn the_master_address_of_a_local_worker_is_reachable() {
        for (listening, master) in [
            ("0.0.0.0:7117", "127.0.0.1:7117"),
            ("[::]:7", "[::1]:7"),
            ("10.1.2.3:4", "10.1.2.3:4"),
            ("[fe80::1%3]:4", "[fe80::1%3]:4"),
        ] {
            assert_eq!(reachable(listening.parse().unwrap()).to_string(), master);
        }
    }
}
