//! Delays between attempts to connect.

use std::collections::hash_map::RandomState;
use std::hash::BuildHasher;
use std::time::Duration;

const FIRST_DELAY: Duration = Duration::from_millis(500);
const LONGEST_DELAY: Duration = Duration::from_secs(5);

/// Largest difference between a delay and its nominal value, as a fraction of the latter.
const JITTER: f64 = 0.25;

/// Exponential backoff: 0.5 s, doubled each time up to 5 s. Each delay differs at random by up to 25 %, so that the workers
/// of a master that restarts do not return at the same moment.
#[derive(Debug)]
pub(super) struct Backoff {
    next: Duration,
}

impl Backoff {
    pub(super) fn new() -> Self {
        Self { next: FIRST_DELAY }
    }

    /// Restarts at the first delay, after a success.
    pub(super) fn reset(&mut self) {
        self.next = FIRST_DELAY;
    }

    /// Returns the next delay.
    pub(super) fn next_delay(&mut self) -> Duration {
        let delay = self.next;
        self.next = (delay * 2).min(LONGEST_DELAY);
        delay.mul_f64(1.0 + JITTER * (2.0 * random_fraction() - 1.0))
    }
}

/// A random number from 0 to 1. Hash tables have random keys, which suffice for delays.
fn random_fraction() -> f64 {
    RandomState::new().hash_one(0_u8) as f64 / u64::MAX as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_near(delay: Duration, nominal_ms: u64) -> bool {
        let ratio = delay.as_secs_f64() * 1e3 / nominal_ms as f64;
        (1.0 - JITTER - 1e-6..=1.0 + JITTER + 1e-6).contains(&ratio)
    }

    #[test]
    fn delays_double_up_to_five_seconds_and_restart_after_a_reset() {
        let mut backoff = Backoff::new();
        for nominal in [500, 1000, 2000, 4000, 5000, 5000, 5000] {
            let delay = backoff.next_delay();
            assert!(is_near(delay, nominal), "{delay:?} is not near {nominal} ms");
        }
        backoff.reset();
        assert!(is_near(backoff.next_delay(), 500));
    }

    #[test]
    fn delays_of_many_workers_are_spread() {
        let delays: Vec<f64> = (0..200).map(|_| Backoff::new().next_delay().as_secs_f64()).collect();
        let least = delays.iter().copied().fold(f64::MAX, f64::min);
        let most = delays.iter().copied().fold(0.0, f64::max);
        // 200 uniform values from 0.375 s to 0.625 s: each bound fails with probability 0.8^200.
        assert!(least < 0.425 && most > 0.575, "{least} to {most}");
    }
}
