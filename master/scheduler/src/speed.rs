//! How fast a worker is: work a second, from what it traced and from what arrived.

use std::time::Duration;

/// Good news fades what was known before so many times faster than bad news: a worker that was slow for a while gets
/// few rows, and would otherwise not be seen to be fast again for long.
const GOOD_NEWS: f64 = 3.0;

/// A ratio of two fading sums: segments that arrive in bunches do not make a worker look infinitely fast.
#[derive(Clone, Copy, Debug, Default)]
struct Rate {
    work: f64,
    seconds: f64,
}

impl Rate {
    fn observe(&mut self, work: f64, seconds: f64, half_life: f64) {
        if !(work > 0.0 && seconds > 0.0) {
            return;
        }
        let good = self.value().is_some_and(|known| work / seconds > known);
        let half_life = if good { half_life / GOOD_NEWS } else { half_life };
        let left = (-seconds / half_life).exp2();
        self.work = self.work * left + work;
        self.seconds = self.seconds * left + seconds;
    }

    fn value(&self) -> Option<f64> {
        (self.seconds > 0.0).then(|| self.work / self.seconds)
    }
}

/// A finished lease, as it bears on its worker's speed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Observation {
    /// Predicted work of its rows.
    pub(super) work: f64,
    /// Seconds of tracing summed over the worker's threads, as the worker says.
    pub(super) traced: f64,
    /// Seconds on the master's clock since the worker's answer before, if it had this lease by then.
    pub(super) busy: Option<f64>,
}

/// The speed of a worker.
#[derive(Clone, Copy, Debug)]
pub(super) struct Speed {
    threads: f64,
    traced: Rate,
    delivered: Rate,
}

impl Speed {
    pub(super) fn new(threads: u32) -> Self {
        Self { threads: f64::from(threads.max(1)), traced: Rate::default(), delivered: Rate::default() }
    }

    /// Work a second; `None` before the first observation. What a worker traces counts, unless less arrives while it
    /// always has something to do: then its link, or something else on its machine, is what limits it.
    pub(super) fn value(&self) -> Option<f64> {
        let traced = self.traced.value()?;
        Some(self.delivered.value().map_or(traced, |delivered| traced.min(delivered)))
    }

    /// Work of one thread in a second of tracing: the scale on which rows are compared.
    pub(super) fn of_thread(&self) -> Option<f64> {
        self.traced.value().map(|rate| rate / self.threads)
    }

    /// What is known halves its weight in `half_life` of work.
    pub(super) fn observe(&mut self, seen: Observation, half_life: Duration) {
        let half_life = half_life.as_secs_f64();
        self.traced.observe(seen.work, seen.traced / self.threads, half_life);
        self.delivered.observe(seen.work, seen.busy.unwrap_or(0.0), half_life);
    }

    /// The same work is called so many times as much from now on.
    pub(super) fn rescale(&mut self, factor: f64) {
        for rate in [&mut self.traced, &mut self.delivered] {
            rate.work *= factor;
        }
    }

    /// It had so long for this work and has not done it.
    pub(super) fn miss(&mut self, work: f64, seconds: f64) {
        if self.value().is_some_and(|known| work / seconds < known) {
            for rate in [&mut self.traced, &mut self.delivered] {
                *rate = Rate { work, seconds };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIFE: Duration = Duration::from_secs(1);

    fn seen(work: f64, traced: f64, busy: Option<f64>) -> Observation {
        Observation { work, traced, busy }
    }

    #[test]
    fn threads_add_up() {
        let mut speed = Speed::new(4);
        assert_eq!(speed.value(), None);
        speed.observe(seen(8.0, 4.0, None), LIFE);
        assert_eq!((speed.value(), speed.of_thread()), (Some(8.0), Some(2.0)));
    }

    #[test]
    fn a_slow_link_makes_a_slow_worker() {
        let mut speed = Speed::new(1);
        speed.observe(seen(8.0, 1.0, Some(4.0)), LIFE);
        assert_eq!(speed.value(), Some(2.0));
    }

    #[test]
    fn good_news_is_believed_sooner_than_bad_news() {
        let after = |work| {
            let mut speed = Speed::new(1);
            speed.observe(seen(2.0, 1.0, None), LIFE);
            speed.observe(seen(work, 1.0, None), LIFE);
            speed.value().unwrap_or(0.0)
        };
        let (up, down) = ((after(4.0) / 2.0).log2(), (2.0 / after(1.0)).log2());
        assert!(up > 1.5 * down, "{up} {down}");
    }

    #[test]
    fn work_that_does_not_come_is_bad_news_at_once() {
        let mut speed = Speed::new(1);
        speed.observe(seen(8.0, 1.0, None), LIFE);
        speed.miss(4.0, 0.1);
        assert_eq!(speed.value(), Some(8.0));
        speed.miss(4.0, 2.0);
        assert_eq!(speed.value(), Some(2.0));
    }
}
