//! Colours of a surface point, and normals that a texture tilts.

use glam::DVec3;

use super::Oracle;
use super::surface::SurfacePoint;
use crate::scene::{Checker, CheckerSpace, Material};

impl Oracle {
    pub(super) fn material(&self, surface: &SurfacePoint) -> &Material {
        &self.scene.materials[surface.material_index as usize]
    }

    /// c_d: a checker pattern, or the colour times its texel, times the vertex colour.
    pub(super) fn diffuse(&self, surface: &SurfacePoint) -> DVec3 {
        let material = self.material(surface);
        let mut diffuse = material.diffuse.as_dvec3();
        if let Some(checker) = &material.checker {
            diffuse = self.checker_color(checker, surface);
        } else if let Some(index) = material.texture {
            diffuse *= self.texel(self.scene.textures[index as usize], surface.uv).truncate();
        }
        if material.vertex_colors { diffuse * surface.vertex_color } else { diffuse }
    }

    /// Light that the front of the surface emits.
    pub(super) fn emission(&self, surface: &SurfacePoint) -> DVec3 {
        let material = self.material(surface);
        if !surface.front {
            return DVec3::ZERO;
        }
        let factor = material.emission_texture.map_or(DVec3::ONE, |index| {
            self.texel(self.scene.textures[index as usize], surface.uv).truncate()
        });
        material.emission.as_dvec3() * factor
    }

    /// The colour of the cell that a point is in.
    fn checker_color(&self, checker: &Checker, surface: &SurfacePoint) -> DVec3 {
        let place = match checker.space {
            CheckerSpace::World => surface.position + self.view.camera.position,
            CheckerSpace::Object => self.in_object(self.primitives[surface.primitive].name, surface.position),
            CheckerSpace::Uv => surface.uv.extend(0.0),
        };
        let cell = (place / f64::from(checker.size)).floor().element_sum();
        checker.colors[usize::from(cell.rem_euclid(2.0) != 0.0)].as_dvec3()
    }

    /// The shading normal, tilted by the normal map of the material: x along u, y along v, z outwards. `tangents` are the
    /// derivatives of the point by u and v.
    pub(super) fn mapped_normal(&self, surface: &SurfacePoint, tangents: [DVec3; 2]) -> DVec3 {
        let ns = surface.ns;
        let Some(map) = self.material(surface).normal_map else { return ns };
        let Some(shares) = self.shares(self.scene.textures[map.texture as usize], surface.uv) else {
            return ns;
        };
        let tilt = shares * 2.0 - 1.0;
        let along = |tangent: DVec3| (tangent - ns * tangent.dot(ns)).normalize_or_zero();
        let [u, v] = tangents.map(along);
        let (x, y) = (tilt.x * f64::from(map.strength), tilt.y * f64::from(map.strength));
        let tilted = (u * x + v * y + ns * tilt.z).try_normalize().unwrap_or(ns);
        if tilted.dot(surface.ng) < 0.0 { ns } else { tilted }
    }
}
