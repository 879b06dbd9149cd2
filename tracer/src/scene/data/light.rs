//! Lights.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::Quality;

/// A light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// Position and direction.
    pub kind: LightKind,
    /// I_j: colour times intensity, linear RGB.
    pub color: Vec3,
    /// A_j over the distance; ignored for directional lights.
    pub attenuation: Attenuation,
    /// Whether occluders cast shadows in its light.
    pub shadows: bool,
    /// Radius of a point light or a spot in world units: its shadows are soft. 0 is a light without extent; directional lights have none.
    pub radius: f64,
    /// Points on the light that shadow rays go to at the quality that the scene requests, instead of [`Quality::shadow_samples`];
    /// only with a radius.
    pub shadow_samples: Option<u16>,
}

impl Light {
    /// Points on the light that shadow rays go to at a quality, at least one. A number of the light's own is full quality: with
    /// fewer points than the scene requests (`full`), the light has as many fewer, rounded up.
    pub fn shadow_samples_at(&self, full: &Quality, quality: &Quality) -> u16 {
        let (full, now) = (full.shadow_samples.max(1), quality.shadow_samples.max(1));
        match self.shadow_samples {
            None => now,
            Some(own) if now >= full => own.max(1),
            // Not above the light's own number, so it is a `u16`.
            Some(own) => (u32::from(own.max(1)) * u32::from(now)).div_ceil(u32::from(full)) as u16,
        }
    }
}

/// The kinds of light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum LightKind {
    /// Emits in all directions from a point.
    Point {
        /// World position.
        position: DVec3,
    },
    /// Emits into a cone.
    Spot {
        /// World position.
        position: DVec3,
        /// Axis of the cone, away from the light; unit length.
        direction: DVec3,
        /// Full angle of the cone in degrees.
        beam_angle: f64,
        /// Degrees over which the edge fades inwards; 0 is a hard edge.
        penumbra: f64,
    },
    /// Emits along one direction from infinitely far away.
    Directional {
        /// Direction in which the light travels; unit length.
        direction: DVec3,
    },
}

/// A_j: the factor of a light at the distance r, in scene units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Attenuation {
    /// 1.
    None,
    /// 1 / r^2.
    InverseSquare,
    /// 1 / (constant + linear r + quadratic r^2).
    Polynomial {
        /// k_c.
        constant: f64,
        /// k_l.
        linear: f64,
        /// k_q.
        quadratic: f64,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a light with a number of its own, or without one, where the scene requests `full` points.
    fn points(own: Option<u16>, full: u16, now: u16) -> u16 {
        let light = Light {
            kind: LightKind::Point { position: DVec3::Y },
            color: Vec3::ONE,
            attenuation: Attenuation::None,
            shadows: true,
            radius: 0.5,
            shadow_samples: own,
        };
        let quality = |shadow_samples| Quality { shadow_samples, ..Quality::default() };
        light.shadow_samples_at(&quality(full), &quality(now))
    }

    #[test]
    fn fewer_points_than_the_scene_requests_scale_every_light() {
        for (now, own_9, own_64, none) in [(16, 9, 64, 16), (9, 6, 36, 9), (4, 3, 16, 4), (1, 1, 4, 1)] {
            assert_eq!(points(Some(9), 16, now), own_9, "{now} of 16");
            assert_eq!(points(Some(64), 16, now), own_64, "{now} of 16");
            assert_eq!(points(None, 16, now), none, "{now} of 16");
        }
    }

    #[test]
    fn a_number_of_the_lights_own_is_its_best() {
        for now in [16, 25, 1024] {
            assert_eq!(points(Some(9), 16, now), 9);
            assert_eq!(points(None, 16, now), now);
        }
        assert_eq!(points(Some(1024), 1024, 1024), 1024);
        assert_eq!(points(Some(1024), 1024, 1), 1);
    }

    #[test]
    fn points_never_rise_while_the_knob_falls() {
        for own in [1, 2, 9, 63, 64, 1000, 1024] {
            for full in [1, 16, 25, 1024] {
                let all: Vec<u16> = (1..=full).map(|now| points(Some(own), full, now)).collect();
                assert!(all.is_sorted(), "{own} of {full}");
                assert!(all[0] >= 1 && all[all.len() - 1] == own, "{own} of {full}");
            }
        }
    }
}
