//! File descriptors of the process: how many workers they allow.

use crate::admission::LIMITS;

/// Descriptors that are kept for files, pipes of local workers and libraries.
const RESERVE: u64 = 64;
/// Most workers, however many descriptors there are.
const MAX_WORKERS: u64 = 1024;
/// Soft limit that is set where the hard one is refused: macOS accepts no more.
#[cfg(unix)]
const FALLBACK_LIMIT: u64 = 10_240;

/// Raises the process's limit of open descriptors to what the system allows, and returns the number of workers that fits. A
/// worker has one descriptor, and each connection in its handshake as well.
pub(crate) fn max_workers() -> usize {
    let workers = workers_within(raised_limit());
    if workers < MAX_WORKERS {
        tracing::info!("the limit of open files (ulimit -n) allows {workers} workers at a time");
    }
    usize::try_from(workers).unwrap_or(usize::MAX)
}

/// Workers that fit within a limit of descriptors; `None` for no limit.
fn workers_within(limit: Option<u64>) -> u64 {
    let pending = (LIMITS.unknown + LIMITS.known + LIMITS.here) as u64;
    limit.map_or(MAX_WORKERS, |limit| limit.saturating_sub(RESERVE + pending).clamp(1, MAX_WORKERS))
}

#[cfg(unix)]
fn raised_limit() -> Option<u64> {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    let set = |soft: Option<u64>| setrlimit(Resource::Nofile, Rlimit { current: soft, maximum });
    if current != maximum && set(maximum).is_err() {
        let lower = maximum.map_or(FALLBACK_LIMIT, |hard| hard.min(FALLBACK_LIMIT));
        if current.is_some_and(|soft| soft < lower)
            && let Err(error) = set(Some(lower))
        {
            tracing::debug!("the limit of open files cannot be raised: {error}");
        }
    }
    getrlimit(Resource::Nofile).current
}

#[cfg(not(unix))]
fn raised_limit() -> Option<u64> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn descriptors_bound_the_number_of_workers() {
        // 64 for files, 64 + 16 + 32 for handshakes.
        assert_eq!(workers_within(Some(1024)), 1024 - 64 - 112);
        assert_eq!(workers_within(Some(4096)), MAX_WORKERS);
        assert_eq!(workers_within(None), MAX_WORKERS);
        assert_eq!((workers_within(Some(100)), workers_within(Some(177))), (1, 1));
        assert_eq!(workers_within(Some(178)), 2);
    }

    #[cfg(unix)]
    #[test]
    fn the_soft_limit_is_raised() {
        let limit = raised_limit();
        let rustix::process::Rlimit { current, maximum } =
            rustix::process::getrlimit(rustix::process::Resource::Nofile);
        assert_eq!(current, limit);
        assert!(current == maximum || current.is_some_and(|soft| soft >= FALLBACK_LIMIT));
    }
}
