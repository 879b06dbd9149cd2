//! Volumes that scatter light.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::Model;

/// A homogeneous volume that scatters light evenly to all directions. Where volumes overlap, their densities add.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Volume {
    /// Its surface, which is not seen itself.
    pub boundary: VolumeBoundary,
    /// Extinction coefficient: mean number of scatterings per world unit, not negative.
    pub density: f64,
    /// Albedo, linear RGB: share of light that is left after a scattering.
    pub color: Vec3,
}

/// The surface of a volume.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum VolumeBoundary {
    /// A sphere.
    Sphere {
        /// World position of the centre.
        center: DVec3,
        /// Radius in world units, above zero.
        radius: f64,
    },
    /// A box along the axes of the world.
    Box {
        /// World position of the corner with the lowest coordinates.
        lower: DVec3,
        /// World position of the corner with the highest coordinates.
        upper: DVec3,
    },
    /// A closed mesh, without materials. Its winding may face either side.
    Model(Model),
}

impl VolumeBoundary {
    /// The placed mesh, if it is one.
    pub fn model(&self) -> Option<&Model> {
        match self {
            Self::Model(model) => Some(model),
            Self::Sphere { .. } | Self::Box { .. } => None,
        }
    }
}
