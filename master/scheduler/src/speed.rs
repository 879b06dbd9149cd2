//! Speed of a worker in work per second, from its tracing times and from the arrival of its segments.

use std::time::Duration;

/// Factor by which earlier observations decay sooner where the new one is faster. A worker that was slow temporarily gets
/// few rows, so its recovery would otherwise be measured late.
const FASTER_DECAY: f64 = 3.0;

/// Ratio of two exponentially decaying sums. Segments that arrive in bursts do not make it infinite.
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
        let faster = self.value().is_some_and(|known| work / seconds > known);
        let half_life = if faster { half_life / FASTER_DECAY } else { half_life };
        let left = (-seconds / half_life).exp2();
        self.work = self.work * left + work;
        self.seconds = self.seconds * left + seconds;
    }

    fn value(&self) -> Option<f64> {
        (self.seconds > 0.0).then(|| self.work / self.seconds)
    }
}

/// Measurement of one finished lease.
#[derive(Clone, Copy, Debug)]
pub(super) struct Observation {
    /// Predicted work of its rows.
    pub(super) work: f64,
    /// Seconds of tracing, summed over the worker's threads, as the worker reports.
    pub(super) traced: f64,
    /// Seconds on the master's clock since the worker's previous reply, if it held this lease by then.
    pub(super) busy: Option<f64>,
}

/// Measured speed of a worker.
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

    /// Work per second; `None` before the first observation. The tracing rate counts, unless the arrival rate of a worker
    /// that always holds leases is lower: then its link, or another load on its machine, is the limit.
    pub(super) fn value(&self) -> Option<f64> {
        let traced = self.traced.value()?;
        Some(self.delivered.value().map_or(traced, |delivered| traced.min(delivered)))
    }

    /// Work of one thread per second of tracing: the scale on which costs of rows are compared.
    pub(super) fn of_thread(&self) -> Option<f64> {
        self.traced.value().map(|rate| rate / self.threads)
    }

    /// Adds an observation. Earlier ones lose half of their weight per `half_life` of observed time.
    pub(super) fn observe(&mut self, observation: Observation, half_life: Duration) {
        let half_life = half_life.as_secs_f64();
        self.traced.observe(observation.work, observation.traced / self.threads, half_life);
        self.delivered.observe(observation.work, observation.busy.unwrap_or(0.0), half_life);
    }

    /// Multiplies all work by `factor`, because the unit of work changes.
    pub(super) fn rescale(&mut self, factor: f64) {
        for rate in [&mut self.traced, &mut self.delivered] {
            rate.work *= factor;
        }
    }

    /// Lowers the speed to that of `work` in `seconds`, which the worker has not finished in that time.
    pub(super) fn observe_unfinished(&mut self, work: f64, seconds: f64) {
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

    const HALF_LIFE: Duration = Duration::from_secs(1);

    fn observation(work: f64, traced: f64, busy: Option<f64>) -> Observation {
        Observation { work, traced, busy }
    }

    #[test]
    fn speeds_of_threads_add_up() {
        let mut speed = Speed::new(4);
        assert_eq!(speed.value(), None);
        speed.observe(observation(8.0, 4.0, None), HALF_LIFE);
        assert_eq!((speed.value(), speed.of_thread()), (Some(8.0), Some(2.0)));
    }

    #[test]
    fn a_slow_link_makes_a_slow_worker() {
        let mut speed = Speed::new(1);
        speed.observe(observation(8.0, 1.0, Some(4.0)), HALF_LIFE);
        assert_eq!(speed.value(), Some(2.0));
    }

    #[test]
    fn speed_rises_sooner_than_it_falls() {
        let after = |work| {
            let mut speed = Speed::new(1);
            speed.observe(observation(2.0, 1.0, None), HALF_LIFE);
            speed.observe(observation(work, 1.0, None), HALF_LIFE);
            speed.value().unwrap_or(0.0)
        };
        let (up, down) = ((after(4.0) / 2.0).log2(), (2.0 / after(1.0)).log2());
        assert!(up > 1.5 * down, "{up} {down}");
    }

    #[test]
    fn unfinished_work_lowers_the_speed_at_once() {
        let mut speed = Speed::new(1);
        speed.observe(observation(8.0, 1.0, None), HALF_LIFE);
        speed.observe_unfinished(4.0, 0.1);
        assert_eq!(speed.value(), Some(8.0));
        speed.observe_unfinished(4.0, 2.0);
        assert_eq!(speed.value(), Some(2.0));
    }
}
