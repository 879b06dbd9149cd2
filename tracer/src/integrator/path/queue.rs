//! Paths that go on.

use crate::bsdf::Media;
use crate::rays::{PrimitiveId, Ray};

/// A path between two vertices.
#[derive(Clone, Copy)]
pub(super) struct Path {
    /// Its next ray, in eye space; the direction has unit length.
    pub ray: Ray,
    pub starts_on: Option<PrimitiveId>,
    /// T: the factor of the light that it finds.
    pub weight: [f32; 3],
    /// Density of its direction over solid angle; infinite if no other direction was possible, as behind a mirror.
    pub density: f32,
    /// The transparent bodies that it is inside of.
    pub media: Media,
    /// Index of its sample in the group.
    pub sample: u32,
}
