//! Pixel formats of the tracer on the wire.

use rayfarm_protocol::PixelFormat;
use rayfarm_tracer::PixelFormat as Rendered;

/// The format of the protocol for one of the tracer.
pub fn wire_format(format: Rendered) -> PixelFormat {
    match format {
        Rendered::Rgb8 => PixelFormat::Rgb8,
        Rendered::Linear => PixelFormat::Linear,
        Rendered::Sums => PixelFormat::Sums,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_have_the_same_bytes_in_tracer_and_protocol() {
        for format in [Rendered::Rgb8, Rendered::Linear, Rendered::Sums] {
            assert_eq!(wire_format(format).row_bytes(9), format.row_bytes(9), "{format:?}");
        }
    }
}
