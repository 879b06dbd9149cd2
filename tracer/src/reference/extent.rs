//! S_j: the share of a light that arrives at a point, per channel. The mean over the disc that the point sees of a light with a
//! radius.

use std::f64::consts::FRAC_PI_4;

use glam::{DVec2, DVec3};

use super::Oracle;
use super::surface::SurfacePoint;
use crate::scene::LightKind;

/// Upper end of a shadow ray, as a fraction of the distance to the light: a surface that contains a light does not occlude it.
const SHADOW_T_MAX: f64 = 1.0 - 1e-9;

/// Strata along each side of the square that is mapped to a disc.
const STRATA: u32 = 32;

impl Oracle {
    /// S_j of a light; `to_light` leads to its centre, or to a directional light.
    pub(super) fn light_share(&self, light: usize, surface: &SurfacePoint, to_light: DVec3) -> DVec3 {
        let start = self.shadow_start(surface, to_light.normalize_or_zero());
        let lifted = start.position - surface.position;
        let radius = self.scene.lights[light].radius;
        if let LightKind::Directional { .. } = self.scene.lights[light].kind {
            return self.unoccluded(&start, to_light, f64::INFINITY);
        }
        if !(radius > 0.0) {
            return self.unoccluded(&start, to_light - lifted, SHADOW_T_MAX);
        }
        let sets = self.light_points.get(light).filter(|sets| !sets.is_empty());
        let offsets = match sets {
            Some(sets) => sets[surface.place % sets.len()].clone(),
            None => disc(to_light.normalize_or_zero()),
        };
        let targets = offsets.iter().map(|offset| to_light - lifted + *offset * radius);
        // Points below the horizon are occluded by the surface itself.
        let visible = targets.filter(|target| target.dot(start.normal) > 0.0);
        let sum: DVec3 = visible.map(|target| self.unoccluded(&start, target, SHADOW_T_MAX)).sum();
        sum / offsets.len() as f64
    }
}

/// Points of the unit disc across a direction, stratified by area.
fn disc(across: DVec3) -> Vec<DVec3> {
    let (x, y) = across.any_orthonormal_pair();
    let coordinate = |i: u32| (2.0 * f64::from(i) + 1.0) / f64::from(STRATA) - 1.0;
    let cells = (0..STRATA).flat_map(|j| (0..STRATA).map(move |i| (i, j)));
    cells.map(|(i, j)| concentric(coordinate(i), coordinate(j))).map(|p| x * p.x + y * p.y).collect()
}

/// The map of the square [-1, 1]^2 to the unit disc that keeps areas in proportion (Shirley and Chiu, "A Low Distortion Map
/// Between Disk and Square", 1997).
pub(super) fn concentric(a: f64, b: f64) -> DVec2 {
    let (r, angle) = if a.abs() > b.abs() {
        (a, FRAC_PI_4 * b / a)
    } else if b != 0.0 {
        (b, 2.0 * FRAC_PI_4 - FRAC_PI_4 * a / b)
    } else {
        return DVec2::ZERO;
    };
    DVec2::new(libm::cos(angle), libm::sin(angle)) * r
}
