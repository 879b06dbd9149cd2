//! Segment policies: how a frame is cut into segments.

use std::fmt;
use std::str::FromStr;

use super::frame::RowRange;

/// Policy that cuts a frame into segments; `static:ROWS`, `smart:ROWS` or `adaptive` on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum SegmentPolicy {
    /// Segments of this number of rows, in order. At a frame's end, idle workers render segments again that others
    /// still hold.
    Static(u32),
    /// As `Static`, with the last `workers / 2` segments halved.
    Smart(u32),
    /// Segments of equal predicted time, from the last frame's cost per row and each worker's measured speed.
    #[default]
    Adaptive,
}

/// A text that names no policy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{text:?} is not a segment policy: expected static:ROWS, smart:ROWS (ROWS at least 1) or adaptive")]
pub struct PolicyError {
    text: String,
}

impl SegmentPolicy {
    /// Row ranges that are queued when a frame of `height` rows begins.
    pub(super) fn ranges(self, height: u32, max_rows: u32) -> impl Iterator<Item = RowRange> {
        let rows = match self {
            Self::Static(rows) | Self::Smart(rows) => rows.clamp(1, max_rows),
            Self::Adaptive => height.max(1),
        };
        (0..height).step_by(rows as usize).map(move |first| RowRange::new(first, rows.min(height - first)))
    }
}

impl FromStr for SegmentPolicy {
    type Err = PolicyError;

    fn from_str(text: &str) -> Result<Self, PolicyError> {
        let refused = || PolicyError { text: text.to_owned() };
        let rows = |digits: &str| digits.parse().ok().filter(|&rows: &u32| rows > 0).ok_or_else(refused);
        match text.split_once(':') {
            None if text == "adaptive" => Ok(Self::Adaptive),
            Some(("static", digits)) => rows(digits).map(Self::Static),
            Some(("smart", digits)) => rows(digits).map(Self::Smart),
            _ => Err(refused()),
        }
    }
}

impl fmt::Display for SegmentPolicy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Static(rows) => write!(f, "static:{rows}"),
            Self::Smart(rows) => write!(f, "smart:{rows}"),
            Self::Adaptive => f.write_str("adaptive"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts(policy: SegmentPolicy, height: u32, max_rows: u32) -> Vec<u32> {
        policy.ranges(height, max_rows).map(|range| range.count).collect()
    }

    #[test]
    fn static_frames_are_cut_when_they_begin() {
        assert_eq!(counts(SegmentPolicy::Static(10), 25, 100), [10, 10, 5]);
        assert_eq!(counts(SegmentPolicy::Static(10), 25, 9), [9, 9, 7]);
        assert_eq!(counts(SegmentPolicy::Adaptive, 25, 9), [25]);
        assert_eq!(counts(SegmentPolicy::Adaptive, 0, 9), [] as [u32; 0]);
    }

    #[test]
    fn a_policy_parses_back_from_its_display() {
        for policy in [SegmentPolicy::Static(1), SegmentPolicy::Smart(24), SegmentPolicy::Adaptive] {
            assert_eq!(policy.to_string().parse(), Ok(policy));
        }
    }

    #[test]
    fn an_invalid_policy_is_refused_and_quoted() {
        for text in
            ["", "static", "static:", "static:0", "smart:-1", "adaptive:8", "Static:8", "static:4294967296"]
        {
            let error = text.parse::<SegmentPolicy>().unwrap_err().to_string();
            assert!(error.contains(&format!("{text:?}")) && error.contains("static:ROWS"), "{error}");
        }
    }
}
