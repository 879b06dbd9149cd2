//! The shading equation of the oracle.

use glam::DVec3;

use super::Oracle;
use crate::scene::{Attenuation, Background, Light, LightKind, Material, Shading};

/// Upper end of a shadow ray, as a fraction of the distance to the light: a surface that contains a light does not occlude it.
const SHADOW_T_MAX: f64 = 1.0 - 1e-9;

impl Oracle {
    /// Linear RGB of a ray from the camera.
    pub(super) fn radiance(&self, direction: DVec3) -> DVec3 {
        let Some((primitive, hit)) = self.closest(DVec3::ZERO, direction, f64::INFINITY, None) else {
            return match self.scene.background {
                Background::Color(color) => color.as_dvec3(),
                Background::Gradient { bottom, top } => {
                    bottom.as_dvec3().lerp(top.as_dvec3(), (direction.y + 1.0) / 2.0)
                }
                Background::Sky(_) => DVec3::ZERO,
            };
        };
        let mut material = self.scene.materials[self.primitives[primitive].material as usize];
        if let Some(index) = material.texture {
            material.diffuse *= self.texel(self.scene.textures[index as usize], hit.uv).truncate().as_vec3();
        }
        if material.vertex_colors {
            material.diffuse *= hit.color.as_vec3();
        }
        let point = direction * hit.t;
        let ng = if hit.normal.dot(direction) > 0.0 { -hit.normal } else { hit.normal };
        let n = if hit.shading_normal.dot(ng) < 0.0 { -hit.shading_normal } else { hit.shading_normal };
        let mut emission = DVec3::ZERO;
        if (hit.normal.dot(direction) < 0.0) != hit.mirrored {
            emission = material.emission.as_dvec3();
            if let Some(index) = material.emission_texture {
                emission *= self.texel(self.scene.textures[index as usize], hit.uv).truncate();
            }
        }
        if material.unlit {
            return material.diffuse.as_dvec3() + emission;
        }
        let mut sum = material.diffuse.as_dvec3() * self.scene.ambient.as_dvec3() + emission;
        for light in &self.scene.lights {
            sum += self.light_term(light, &material, point, n, -direction, primitive);
        }
        sum
    }

    /// S A B I ( c_d N.L + c_s (N.H)^p ) of one light.
    fn light_term(
        &self,
        light: &Light,
        material: &Material,
        point: DVec3,
        n: DVec3,
        v: DVec3,
        primitive: usize,
    ) -> DVec3 {
        let eye = self.view.camera.position;
        let (to_light, reach) = match light.kind {
            LightKind::Point { position } | LightKind::Spot { position, .. } => {
                (position - eye - point, SHADOW_T_MAX)
            }
            LightKind::Directional { direction } => (-direction, f64::INFINITY),
        };
        let r = to_light.length();
        let l = to_light / r;
        if !(n.dot(l) > 0.0) {
            return DVec3::ZERO;
        }
        let attenuation = match (light.kind, light.attenuation) {
            (LightKind::Directional { .. }, _) | (_, Attenuation::None) => 1.0,
            (_, Attenuation::InverseSquare) => 1.0 / (r * r),
            (_, Attenuation::Polynomial { constant, linear, quadratic }) => {
                1.0 / (constant + linear * r + quadratic * r * r)
            }
        };
        let strength = attenuation * beam(&light.kind, l);
        let shadows = light.shadows && self.view.quality.shadows;
        if strength == 0.0 || (shadows && self.occluded(point, to_light, reach, primitive)) {
            return DVec3::ZERO;
        }
        let h = (l + v).normalize();
        let highlight = libm::pow(n.dot(h).max(0.0), f64::from(material.exponent));
        let mut reflected = material.diffuse.as_dvec3() * n.dot(l);
        if self.view.quality.shading == Shading::Full {
            reflected += material.specular.as_dvec3() * highlight;
        }
        light.color.as_dvec3() * reflected * strength
    }
}

/// B_j for the unit vector to the light.
fn beam(kind: &LightKind, l: DVec3) -> f64 {
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
