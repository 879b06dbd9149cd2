//! Token bucket: a number of events at once, and a rate at which it fills again.

use std::time::Instant;

/// Limit of a rate of events.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rate {
    /// Events at once.
    pub(crate) burst: f64,
    /// Events per second in the long run.
    pub(crate) per_second: f64,
}

/// The events that a [`Rate`] still allows.
#[derive(Debug)]
pub(crate) struct Bucket {
    rate: Rate,
    left: f64,
    at: Instant,
}

impl Bucket {
    /// A full bucket.
    pub(crate) fn new(rate: Rate, now: Instant) -> Self {
        Self { rate, left: rate.burst, at: now }
    }

    /// Allows some more events, up to those at once.
    pub(crate) fn give(&mut self, events: f64) {
        self.left = (self.left + events).min(self.rate.burst);
    }

    /// Whether another event is allowed, which is counted then.
    pub(crate) fn take(&mut self, now: Instant) -> bool {
        let filled = now.saturating_duration_since(self.at).as_secs_f64() * self.rate.per_second;
        self.left = (self.left + filled).min(self.rate.burst);
        self.at = now;
        let is_allowed = self.left >= 1.0;
        if is_allowed {
            self.left -= 1.0;
        }
        is_allowed
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn the_rate_holds_in_the_long_run() {
        let start = Instant::now();
        let mut bucket = Bucket::new(Rate { burst: 10.0, per_second: 2.0 }, start);
        // 100 attempts a second for 50 seconds: the burst, and two a second.
        let times = (0..5000).map(|step| start + Duration::from_millis(10 * step));
        let allowed = times.filter(|&now| bucket.take(now)).count();
        assert!((108..=110).contains(&allowed), "{allowed}");
    }
}
