//! Size of pictures on the wire.

use rayfarm_farm::ViewRequest;
use rayfarm_tracer::scene::ColorDepth;

/// Bytes of a pixel with reduced colours, as a part of those with full ones: two thirds, and less after compression; the mean
/// of the measured scenes.
const REDUCED_BYTES: f64 = 0.6;

/// Size of a picture on the wire, in pixels of full colours.
pub(crate) fn bytes(request: &ViewRequest) -> f64 {
    let colors = match request.view.quality.colors {
        ColorDepth::Exact => 1.0,
        ColorDepth::Reduced => REDUCED_BYTES,
    };
    colors * request.scale.factor().powi(2) * f64::from(request.view.width) * f64::from(request.view.height)
}
