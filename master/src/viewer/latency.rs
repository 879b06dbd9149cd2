//! From an input to its picture on the screen.

use std::collections::VecDeque;
use std::time::Duration;

/// Pictures that are looked back upon.
const PICTURES: usize = 16;

/// The median over the last pictures.
#[derive(Clone, Debug, Default)]
pub(super) struct Latency {
    last: VecDeque<Duration>,
}

impl Latency {
    /// A picture is shown, so long after it was asked for.
    pub(super) fn shown(&mut self, after: Duration) {
        self.last.push_back(after);
        if self.last.len() > PICTURES {
            self.last.pop_front();
        }
    }

    /// `None` before the first picture.
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
    fn it_is_the_median_of_the_last_pictures() {
        let mut latency = Latency::default();
        assert_eq!(latency.median(), None);
        (0..100).for_each(|ms| latency.shown(Duration::from_millis(ms)));
        assert_eq!(latency.median(), Some(Duration::from_millis(92)));
        assert_eq!(latency.last.len(), PICTURES);
    }
}
