//! Values of options. Each parser returns the expected syntax, so clap's message has option, value and remedy.

use std::net::SocketAddr;
use std::time::Duration;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use rayfarm_protocol::address;
use rayfarm_tracer::image::MAX_SIDE;
use rayfarm_tracer::scene::{MAX_COORDINATE, MAX_EXPOSURE};

const MAX_FRAMES: u32 = 10_000_000;
const MAX_LOCAL_WORKERS: u32 = 64;
const MAX_THREADS: usize = 1_024;
const MAX_REPEATS: u32 = 1_000;
const MAX_RAYS: u64 = 1_000_000_000_000;
const MAX_SECONDS: f64 = 1e9;
const MIN_RATE: f64 = 0.1;
const MAX_RATE: f64 = 1000.0;

/// Picture size in pixels; neither side is zero or above [`MAX_SIDE`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size {
    /// Pixels per row.
    pub(crate) width: u32,
    /// Rows.
    pub(crate) height: u32,
}

/// A size, such as `1024x768`.
pub(super) fn size(text: &str) -> Result<Size, String> {
    let expected = || format!("expected WIDTHxHEIGHT, each from 1 to {MAX_SIDE}, such as 1024x768");
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(expected)?;
    let side = |digits: &str| match digits.parse() {
        Ok(side @ 1..=MAX_SIDE) => Ok(side),
        _ => Err(expected()),
    };
    Ok(Size { width: side(width)?, height: side(height)? })
}

/// One frame or more.
pub(super) fn frame_count(text: &str) -> Result<u32, String> {
    whole_number(text, 1, MAX_FRAMES)
}

/// A frame number, from 0.
pub(super) fn frame_index(text: &str) -> Result<u32, String> {
    whole_number(text, 0, MAX_FRAMES)
}

/// A number of workers, from 0.
pub(super) fn worker_count(text: &str) -> Result<u32, String> {
    whole_number(text, 0, MAX_LOCAL_WORKERS)
}

/// One render thread or more.
pub(super) fn thread_count(text: &str) -> Result<usize, String> {
    whole_number(text, 1, MAX_THREADS)
}

/// One repeat or more.
pub(super) fn repeat_count(text: &str) -> Result<u32, String> {
    whole_number(text, 1, MAX_REPEATS)
}

/// One ray or more.
pub(super) fn ray_count(text: &str) -> Result<u64, String> {
    whole_number(text, 1, MAX_RAYS)
}

/// Frames per second.
pub(super) fn frame_rate(text: &str) -> Result<f64, String> {
    let in_range = text.parse().ok().filter(|rate| (MIN_RATE..=MAX_RATE).contains(rate));
    in_range.ok_or_else(|| format!("expected frames per second from {MIN_RATE} to {MAX_RATE}, such as 60"))
}

/// A time above zero, in seconds.
pub(super) fn seconds(text: &str) -> Result<Duration, String> {
    let in_range = text.parse().ok().filter(|seconds| *seconds > 0.0 && *seconds <= MAX_SECONDS);
    let time = in_range.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    time.ok_or_else(|| "expected seconds above 0, at most 1000000000, such as 60 or 0.5".to_owned())
}

/// A mean FLIP error.
pub(super) fn error_limit(text: &str) -> Result<f64, String> {
    let in_range = text.parse().ok().filter(|error| (0.0..=1.0).contains(error));
    in_range.ok_or_else(|| "expected a mean FLIP error from 0 to 1, such as 0.05".to_owned())
}

/// A relative error of a pixel.
pub(super) fn noise(text: &str) -> Result<f32, String> {
    let in_range = text.parse().ok().filter(|error| (0.0..=1.0).contains(error));
    in_range.ok_or_else(|| "expected a relative error from 0 to 1, such as 0.02".to_owned())
}

/// An exposure in stops.
pub(super) fn exposure(text: &str) -> Result<f32, String> {
    let in_range = text.parse().ok().filter(|stops| (-MAX_EXPOSURE..=MAX_EXPOSURE).contains(stops));
    in_range.ok_or_else(|| {
        format!("expected stops from -{MAX_EXPOSURE} to {MAX_EXPOSURE}, such as 1 for twice the light")
    })
}

/// A length, from 0.
pub(super) fn radius(text: &str) -> Result<f64, String> {
    let in_range = text.parse().ok().filter(|radius| (0.0..=MAX_COORDINATE).contains(radius));
    in_range.ok_or_else(|| "expected a radius from 0 to 1e30, such as 0.05".to_owned())
}

/// A length above 0.
pub(super) fn distance(text: &str) -> Result<f64, String> {
    let in_range = text.parse().ok().filter(|distance| *distance > 0.0 && *distance <= MAX_COORDINATE);
    in_range.ok_or_else(|| "expected a distance above 0 and up to 1e30, such as 4.5".to_owned())
}

/// A finite angle.
pub(super) fn degrees(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(angle) if angle.is_finite() => Ok(angle),
        _ => Err("expected an angle in degrees, such as 360 or -12.5".to_owned()),
    }
}

/// An angle between two faces.
pub(super) fn crease_angle(text: &str) -> Result<f64, String> {
    let in_range = text.parse().ok().filter(|angle| (0.0..=180.0).contains(angle));
    in_range.ok_or_else(|| "expected an angle from 0 to 180 degrees, such as 40".to_owned())
}

/// An address to listen at, such as `0.0.0.0:7117` or `[fe80::1%eth0]:7117`. Host names are not resolved, because the address
/// is one of this machine.
pub(super) fn listen_address(text: &str) -> Result<SocketAddr, String> {
    address::parse(text)?.ok_or_else(|| {
        "expected ADDR:PORT with an address of this machine in digits: \
         0.0.0.0:7117 lets other machines connect, 127.0.0.1:7117 only this one, [::]:7117 is for IPv6"
            .to_owned()
    })
}

/// An equation, such as `workers=4`.
pub(super) fn equation(text: &str) -> Result<(String, String), String> {
    let parts = text.split_once('=').ok_or("expected COLUMN=TEXT, such as workers=4")?;
    Ok((parts.0.to_owned(), parts.1.to_owned()))
}

/// Parser of one of a few words, with the meaning of each.
pub(super) fn one_of<T: Copy + Send + Sync + 'static>(
    words: &'static [(&'static str, T)],
) -> impl TypedValueParser<Value = T> {
    let known = PossibleValuesParser::new(words.iter().map(|(word, _)| *word));
    known.try_map(move |text| {
        let found = words.iter().find(|(word, _)| *word == text).map(|(_, meaning)| *meaning);
        found.ok_or("unknown word")
    })
}

fn whole_number<T>(text: &str, least: T, most: T) -> Result<T, String>
where
    T: std::str::FromStr + PartialOrd + std::fmt::Display,
{
    match text.parse() {
        Ok(number) if number >= least && number <= most => Ok(number),
        _ => Err(format!("expected a whole number from {least} to {most}")),
    }
}
