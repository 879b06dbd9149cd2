//! Frames per second.

use std::fmt;

/// A number of frames per second: a fraction in lowest terms, both parts from 1 to 60,000.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct VideoRate {
    frames: u32,
    seconds: u32,
}

/// Largest part of a fraction: APNG has 16 bits.
const MAX_PART: u32 = 60_000;

impl VideoRate {
    /// Parses `25`, `23.976` or `30000/1001`.
    ///
    /// # Errors
    /// What was expected.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let refused = || {
            format!(
                "expected frames per second from 0.1 to 1000, as 25, 23.976 or 30000/1001, found \"{text}\""
            )
        };
        let fraction = match (text.split_once('/'), text.split_once('.')) {
            (Some((frames, seconds)), _) => whole(frames).zip(whole(seconds)),
            (None, Some((frames, digits))) if (1..=4).contains(&digits.len()) => {
                let seconds = 10_u64.pow(digits.len() as u32);
                whole(frames).zip(whole(digits)).map(|(frames, part)| (frames * seconds + part, seconds))
            }
            (None, Some(_)) => None,
            (None, None) => whole(text).map(|frames| (frames, 1)),
        };
        let (frames, seconds) = fraction.filter(|(_, seconds)| *seconds > 0).ok_or_else(refused)?;
        if frames * 10 < seconds || frames > 1000 * seconds {
            return Err(refused());
        }
        let divisor = greatest_common_divisor(frames, seconds);
        let part = |n: u64| u32::try_from(n / divisor).ok().filter(|part| *part <= MAX_PART);
        let (frames, seconds) = part(frames).zip(part(seconds)).ok_or_else(refused)?;
        Ok(Self { frames, seconds })
    }

    /// Time of a frame, counted from 0, in seconds.
    pub(crate) fn time(self, frame: u64) -> f64 {
        frame as f64 * f64::from(self.seconds) / f64::from(self.frames)
    }

    /// Number of frames from time 0 to `end`, in seconds, both included.
    pub(crate) fn frames_until(self, end: f64) -> u32 {
        // Conversion saturates. Rounding must not drop the frame of the end itself.
        (end * f64::from(self.frames) / f64::from(self.seconds) + 1e-6).floor() as u32 + 1
    }

    /// Time from one frame to the next, as a fraction of a second.
    pub(crate) fn delay(self) -> (u16, u16) {
        // Both are at most MAX_PART.
        (self.seconds as u16, self.frames as u16)
    }

    /// Time of a frame in hundredths of a second, rounded.
    pub(crate) fn hundredths(self, frame: u64) -> u64 {
        let (frames, seconds) = (u64::from(self.frames), u64::from(self.seconds));
        (200 * frame * seconds + frames) / (2 * frames)
    }
}

impl Default for VideoRate {
    /// 25 frames per second.
    fn default() -> Self {
        Self { frames: 25, seconds: 1 }
    }
}

impl fmt::Display for VideoRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.seconds {
            1 => write!(f, "{}", self.frames),
            seconds => write!(f, "{}/{seconds}", self.frames),
        }
    }
}

/// A number of one to seven digits.
fn whole(text: &str) -> Option<u64> {
    let is_whole = (1..=7).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_digit());
    is_whole.then(|| text.parse().ok()).flatten()
}

fn greatest_common_divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a.max(1) } else { greatest_common_divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rate(text: &str) -> VideoRate {
        VideoRate::parse(text).unwrap()
    }

    #[test]
    fn whole_decimal_and_fractional_rates_are_read() {
        for (text, shown, delay) in [
            ("25", "25", (1, 25)),
            ("30000/1001", "30000/1001", (1001, 30000)),
            ("23.976", "2997/125", (125, 2997)),
            ("12.50", "25/2", (2, 25)),
            ("0.1", "1/10", (10, 1)),
            ("50/2", "25", (1, 25)),
        ] {
            assert_eq!((rate(text).to_string().as_str(), rate(text).delay()), (shown, delay), "{text}");
        }
        for text in
            ["", "0", "-1", "1e3", "1001", "0.09", "1/0", "1/11", "a", "25.", "25.00001", "59999/59998.5"]
        {
            let message = VideoRate::parse(text).unwrap_err();
            assert!(message.contains("0.1 to 1000"), "{text}: {message}");
        }
    }

    #[test]
    fn times_do_not_drift() {
        assert_eq!(rate("25").time(100), 4.0);
        assert_eq!(rate("30000/1001").time(30_000), 1001.0);
        assert_eq!([0, 1, 2, 3, 30].map(|frame| rate("30").hundredths(frame)), [0, 3, 7, 10, 100]);
        assert_eq!(rate("30000/1001").hundredths(30_000), 100_100);
    }

    #[test]
    fn the_frame_of_the_last_key_is_counted() {
        assert_eq!(rate("10").frames_until(0.0), 1);
        assert_eq!(rate("10").frames_until(0.3), 4);
        assert_eq!(rate("30").frames_until(7.1), 214);
        assert_eq!(rate("25").frames_until(0.99), 25);
    }
}
