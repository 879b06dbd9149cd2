//! Lights.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

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
    /// Points on the light that shadow rays go to, instead of [`super::Quality::shadow_samples`]; only with a radius.
    pub shadow_samples: Option<u16>,
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
