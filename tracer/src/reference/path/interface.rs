//! The interface between two bodies, or that of a sheet.

use glam::DVec3;

use super::super::optics;
use crate::scene::Material;

/// Indices of refraction on the near and the far side.
#[derive(Clone, Copy)]
pub(super) struct Interface {
    pub indices: [f64; 2],
    pub thin: bool,
}

impl Interface {
    /// The interface of a material between bodies; a sheet is between two sides of vacuum.
    pub(super) fn of(material: &Material, indices: [f64; 2]) -> Self {
        let thin = material.thin;
        Self { indices: if thin { [1.0, f64::from(material.ior)] } else { indices }, thin }
    }

    /// Share of light that is reflected at a cosine. Between the two surfaces of a sheet it is a geometric series.
    pub(super) fn share(&self, cosine: f64) -> f64 {
        let [near, far] = self.indices;
        if near == far {
            // No interface: nothing is reflected, not even at grazing angles.
            return 0.0;
        }
        let share = optics::reflected_share(DVec3::NEG_Z * cosine, DVec3::Z, self.indices);
        if self.thin { 2.0 * share / (1.0 + share) } else { share }
    }
}
