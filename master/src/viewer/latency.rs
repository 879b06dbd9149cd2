//! Latency from an input to its picture on the screen.

use std::collections::VecDeque;
use std::time::Duration;

/// Pictures in the median.
const PICTURES: usize = 16;

/// Median latency of the last pictures.
#[derive(Clone, Debug, Default)]
pub(super) struct Latency {
    last: VecDeque<Duration>,
}

impl Latency {
    /// Adds the latency of a presented picture.
    pub(super) fn add(&mut self, latency: Duration) {
        self.last.push_back(latency);
        if self.last.len() > PICTURES {
            self.last.pop_front();
        }
    }

    /// Median of the last pictures; `None` before the first one.
    pub(super) fn median(&self) -> Option<Duration> {
        let mut sorted: Vec<Duration> = self.last.iter().copied().collect();
        sorted.sort_unstable();
        sorted.get(sorted.len() / 2).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latency_is_the_median_of_the_last_pictures() {
        let mut latency = Latency::default();
        assert_eq!(latency.median(), None);
        (0..100).for_each(|ms| latency.add(Duration::from_millis(ms)));
        assert_eq!(latency.median(), Some(Duration::from_millis(92)));
        assert_eq!(latency.last.len(), PICTURES);
    }
}
