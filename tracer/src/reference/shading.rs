//! The shading equation of the oracle, without bounces.

use glam::DVec3;

use super::Oracle;
use super::surface::SurfacePoint;
use crate::scene::{Attenuation, Light, LightKind, Material, Shading};

impl Oracle {
    /// Linear RGB that a surface emits, and reflects of the lights and the ambient light.
    pub(super) fn local_light(&self, surface: &SurfacePoint) -> DVec3 {
        let material = self.material(surface);
        let (diffuse, emission) = (self.diffuse(surface), self.emission(surface));
        if material.unlit {
            return diffuse + emission;
        }
        let lights =
            (0..self.scene.lights.len()).map(|light| self.light_term(light, material, diffuse, surface));
        diffuse * self.scene.ambient.as_dvec3() + emission + lights.sum::<DVec3>()
    }

    /// S A B I ( c_d N.L + c_s (N.H)^p ) of one light.
    fn light_term(&self, index: usize, material: &Material, diffuse: DVec3, surface: &SurfacePoint) -> DVec3 {
        let light = &self.scene.lights[index];
        let to_light = match light.kind {
            LightKind::Point { position } | LightKind::Spot { position, .. } => {
                position - self.view.camera.position - surface.position
            }
            LightKind::Directional { direction } => -direction,
        };
        let (n, v, r) = (surface.ns, -surface.direction, to_light.length());
        let l = to_light / r;
        if !(n.dot(l) > 0.0 && surface.untilted.dot(l) > 0.0) {
            return DVec3::ZERO;
        }
        let strength = attenuation(light, r) * beam(&light.kind, l);
        if strength == 0.0 {
            return DVec3::ZERO;
        }
        let shadows = light.shadows && self.view.quality.shadows;
        let arriving = if shadows { self.light_share(index, surface, to_light) } else { DVec3::ONE };
        let h = (l + v).normalize();
        let highlight = libm::pow(n.dot(h).max(0.0), f64::from(material.exponent));
        let mut reflected = diffuse * n.dot(l);
        if self.view.quality.shading == Shading::Full {
            reflected += material.specular.as_dvec3() * highlight;
        }
        arriving * light.color.as_dvec3() * reflected * strength
    }
}

/// A_j at a distance.
pub(super) fn attenuation(light: &Light, r: f64) -> f64 {
    match (light.kind, light.attenuation) {
        (LightKind::Directional { .. }, _) | (_, Attenuation::None) => 1.0,
        (_, Attenuation::InverseSquare) => 1.0 / (r * r),
        (_, Attenuation::Polynomial { constant, linear, quadratic }) => {
            1.0 / (constant + linear * r + quadratic * r * r)
        }
    }
}

/// B_j for the unit vector to the light.
pub(super) fn beam(kind: &LightKind, l: DVec3) -> f64 {
    let LightKind::Spot { direction, beam_angle, penumbra, .. } = *kind else { return 1.0 };
    let outer = libm::cos((beam_angle / 2.0).to_radians());
    let inner = libm::cos((beam_angle / 2.0 - penumbra).max(0.0).to_radians());
    let cosine = -l.dot(direction.normalize());
    if cosine <= outer {
        0.0
    } else if cosine >= inner {
        1.0
    } else {
        let s = (cosine - outer) / (inner - outer);
        s * s * (3.0 - 2.0 * s)
    }
}
