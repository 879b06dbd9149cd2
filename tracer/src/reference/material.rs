//! Colours of a surface point, and normals that a texture tilts.

use glam::{DVec2, DVec3};

use super::Oracle;
use super::optics::leaving;
use super::surface::SurfacePoint;
use crate::scene::{Checker, CheckerSpace, Material, TextureMap, Wrap};

/// Part of a cell of a pattern by which points are moved behind their surface.
const BEHIND: f64 = 1.0 / 1024.0;

impl Oracle {
    pub(super) fn material(&self, surface: &SurfacePoint) -> &Material {
        &self.scene.materials[surface.material_index as usize]
    }

    /// c_d: a colour of a pattern, or the colour times its texel, times the vertex colour.
    pub(super) fn diffuse(&self, surface: &SurfacePoint) -> DVec3 {
        let material = self.material(surface);
        let mut diffuse = material.diffuse.as_dvec3();
        if let Some(pattern) = &material.checker {
            diffuse = self.pattern_color(pattern, surface);
        } else if let Some(index) = material.texture {
            diffuse *= self.texture_color(self.scene.textures[index as usize], surface);
        }
        if material.vertex_colors { diffuse * surface.vertex_color } else { diffuse }
    }

    /// Factors of the roughness and of the share of metal.
    pub(super) fn rough_factors(&self, surface: &SurfacePoint) -> [f64; 2] {
        let texture = self.material(surface).metallic_roughness.and_then(|model| model.texture);
        let shares = texture.and_then(|index| self.shares(self.scene.textures[index as usize], surface.uv));
        shares.map_or([1.0; 2], |shares| [shares.y, shares.z])
    }

    /// Light that the front of the surface emits.
    pub(super) fn emission(&self, surface: &SurfacePoint) -> DVec3 {
        let material = self.material(surface);
        if !surface.front {
            return DVec3::ZERO;
        }
        let factor = material
            .emission_texture
            .map_or(DVec3::ONE, |index| self.texture_color(self.scene.textures[index as usize], surface));
        material.emission.as_dvec3() * factor
    }

    /// The colour of the cell that a point is in: the sum over the axes of floor(coordinate / size) is even for the first one. Cells
    /// that are cut by the surface are those behind it, a thousandth of a cell along the normal of its winding.
    fn pattern_color(&self, pattern: &Checker, surface: &SurfacePoint) -> DVec3 {
        let size = f64::from(pattern.size);
        let name = self.primitives[surface.primitive].name;
        let place = match pattern.space {
            CheckerSpace::World => {
                (surface.position + self.view.camera.position) / size - surface.winding_normal * BEHIND
            }
            CheckerSpace::Object => {
                let normal = self.normal_in_object(surface.primitive, surface.winding_normal);
                self.in_object(name, surface.position) / size - normal * BEHIND
            }
            CheckerSpace::Uv => (surface.uv / size).extend(0.0),
        };
        let odd = |cell: f64| cell.rem_euclid(2.0);
        let cell = place.floor().to_array().into_iter().map(odd).sum::<f64>();
        pattern.colors[usize::from(odd(cell) == 1.0)].as_dvec3()
    }

    /// The shading normal, tilted by the normal map of the material: x along u, y across it on the side of v, z along the normal of
    /// the front. A normal behind the surface is mirrored at it.
    pub(super) fn mapped_normal(&self, surface: &SurfacePoint) -> DVec3 {
        self.tilted(surface).unwrap_or(surface.ns)
    }

    fn tilted(&self, surface: &SurfacePoint) -> Option<DVec3> {
        let map = self.material(surface).normal_map?;
        let lookup = self.scene.textures[map.texture as usize];
        let tilt = self.shares(lookup, surface.uv)? * 2.0 - 1.0;
        let signs = axis_signs(&lookup, surface.uv) * f64::from(map.strength);
        let side = if surface.front { 1.0 } else { -1.0 };
        let normal = surface.ns * side;
        let tangents = surface.tangents;
        let along_u = (tangents[0] - normal * tangents[0].dot(normal)).try_normalize()?;
        let along_v = tangents[1] - normal * tangents[1].dot(normal);
        let across = (along_v - along_u * along_v.dot(along_u)).try_normalize()?;
        let tilted = along_u * (tilt.x * signs.x) + across * (tilt.y * signs.y) + normal * tilt.z;
        Some(leaving(tilted.try_normalize()? * side, surface.ng))
    }
}

/// Signs of u and v in a picture: negative scales and reflected repeats turn them round.
fn axis_signs(lookup: &TextureMap, uv: DVec2) -> DVec2 {
    let scale = lookup.tiling.scale.as_dvec2();
    let repeat = (uv * scale + lookup.tiling.offset.as_dvec2()).floor();
    let sign = |scale: f64, repeat: f64| {
        let reflected = lookup.tiling.wrap == Wrap::Mirror && repeat.rem_euclid(2.0) == 1.0;
        if reflected { -scale.signum() } else { scale.signum() }
    };
    DVec2::new(sign(scale.x, repeat.x), sign(scale.y, repeat.y))
}
