//! Detection of a master that has vanished without closing the connection: a power failure, a pulled cable. TCP does not
//! detect it while this worker sends nothing.

use std::time::Duration;

use rayfarm_protocol::limits::{MAX_CHUNK_BYTES, envelope_deadline};

/// Interval of the checks.
pub(super) const CHECK_INTERVAL: Duration = Duration::from_secs(3);

/// Most consecutive checks without a received byte. A master sends a ping every 2 s, and the longest message may take
/// [`envelope_deadline`].
const MAX_IDLE_CHECKS: u32 = 5;

const _: () =
    assert!(MAX_IDLE_CHECKS as u64 * CHECK_INTERVAL.as_secs() > envelope_deadline(MAX_CHUNK_BYTES).as_secs());

/// Timeout of a connection that receives no bytes. It counts checks and not time: a worker that was suspended has missed
/// checks as well as messages.
#[derive(Debug, Default)]
pub(super) struct IdleTimeout {
    received_bytes: u64,
    checks: u32,
}

impl IdleTimeout {
    /// Performs a check. `received_bytes` is the total of the session so far. Returns whether the timeout has expired.
    pub(super) fn has_expired(&mut self, received_bytes: u64) -> bool {
        if received_bytes != self.received_bytes {
            *self = Self { received_bytes, checks: 0 };
        }
        self.checks += 1;
        self.checks > MAX_IDLE_CHECKS
    }

    /// Error text for an expired timeout.
    pub(super) fn reason() -> String {
        let seconds = u64::from(MAX_IDLE_CHECKS) * CHECK_INTERVAL.as_secs();
        format!("the master has been silent for {seconds} s")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn received_bytes_reset_the_timeout() {
        let mut timeout = IdleTimeout::default();
        for received in [0, 0, 0, 0, 0, 8, 8, 8, 8, 8, 9] {
            assert!(!timeout.has_expired(received));
        }
        let checks = (0..20).take_while(|_| !timeout.has_expired(9)).count();
        assert_eq!(checks, MAX_IDLE_CHECKS as usize - 1);
    }
}
