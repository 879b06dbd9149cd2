//! A bounded number of log lines about one matter, with a count of those that were left out.

use std::time::Instant;

use crate::bucket::{Bucket, Rate};

/// The log lines that are still written.
#[derive(Debug)]
pub(crate) struct LineBudget {
    bucket: Bucket,
    left_out: u64,
}

impl LineBudget {
    /// A budget of which nothing is used.
    pub(crate) fn new(rate: Rate, now: Instant) -> Self {
        Self { bucket: Bucket::new(rate, now), left_out: 0 }
    }

    /// Whether another line is written. If so, the number of lines that were left out since the last written one.
    pub(crate) fn next(&mut self, now: Instant) -> Option<u64> {
        if self.bucket.take(now) {
            return Some(std::mem::take(&mut self.left_out));
        }
        self.left_out += 1;
        None
    }
}

/// The end of a log line after which `left_out` lines of its kind were left out.
pub(crate) fn more(left_out: u64) -> String {
    match left_out {
        0 => String::new(),
        count => format!(" ({count} more like this)"),
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn lines_that_are_left_out_are_counted_once() {
        let start = Instant::now();
        let mut lines = LineBudget::new(Rate { burst: 2.0, per_second: 1.0 }, start);
        let first = [0; 5].map(|_| lines.next(start));
        assert_eq!(first, [Some(0), Some(0), None, None, None]);
        let later = start + Duration::from_millis(1500);
        assert_eq!([lines.next(later), lines.next(later)], [Some(3), None]);
        assert_eq!(
            lines.next(later + Duration::from_secs(1)).map(more).as_deref(),
            Some(" (1 more like this)")
        );
        assert_eq!(more(0), "");
    }
}
