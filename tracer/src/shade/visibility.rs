//! S_j: whether a light is seen from a point.

use crate::frame::PreparedFrame;
use crate::light::Incidence;
use crate::render::RayCounts;
use crate::trace::Surface;

/// Traces one shadow ray. The primitive that it leaves cannot be in its way: triangles and planes are flat, and a
/// sphere is left by its other root.
pub(super) fn is_visible(
    frame: &PreparedFrame,
    surface: &Surface,
    incidence: &Incidence,
    counts: &mut RayCounts,
) -> bool {
    counts.shadow += 1;
    !frame.occluded(&surface.leave(incidence.to_light), incidence.t_light, surface.primitive)
}
