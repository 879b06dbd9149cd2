//! Normal maps: shading normals tilted by a texture.
//!
//! A texel holds x along u, y along v and z outwards, each 2 c / 255 - 1 of its byte c; x and y are multiplied by the strength. The
//! axes are the steps of u and v on the surface, made perpendicular to the shading normal: u first, then v across both, on the side to
//! which v grows. The geometric normal stays: a result behind the surface is mirrored at it, and a light behind the untilted normal
//! does not shine. The filter is that of the texture, without smaller pictures; pictures are looked up at uv * scale + offset, and
//! reflected repeats reflect the normals.

use glam::{DVec2, DVec3, Vec3};

use super::place::Place;
use crate::frame::PreparedFrame;
use crate::rays::BLOCKS;
use crate::scene::{NormalMap, Wrap};
use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, SimdBase, bits, splat};
use crate::texture::{Texture, TextureMap};

use super::{SurfaceBlock, Surfaces};

/// The normals of a tile before they were tilted.
pub(super) struct Untilted {
    /// Bits of the tilted lanes of each block.
    lanes: [u32; BLOCKS],
    normals: [[Lanes; 3]; BLOCKS],
}

impl Untilted {
    /// Normals for a frame; `None` if its scene has no normal maps.
    pub(super) fn for_frame(frame: &PreparedFrame) -> Option<Box<Self>> {
        let none = Self { lanes: [0; BLOCKS], normals: [[Lanes::ZERO; 3]; BLOCKS] };
        frame.features.normal_mapped.then(|| Box::new(none))
    }

    /// Resets a block.
    pub(super) fn clear(&mut self, block: usize) {
        self.lanes[block] = 0;
    }

    /// Tilts the shading normal of a point.
    pub(super) fn tilt(
        &mut self,
        frame: &PreparedFrame,
        map: &NormalMap,
        place: &Place<'_>,
        surface: &mut SurfaceBlock,
        (block, lane): (usize, usize),
    ) {
        let vector =
            |lanes: &[Lanes; 3]| Vec3::from_array(lanes.each_ref().map(|axis| axis.0[lane])).as_dvec3();
        let (ng, ns) = (vector(&surface.ng), vector(&surface.ns));
        let outwards = if place.is_front() { ns } else { -ns };
        let (Some(uv), Some(steps)) = (place.uv(), place.uv_steps()) else { return };
        let (texture, lookup) = &frame.textures()[map.texture as usize];
        let filter = frame.filter_of(lookup);
        let texel = texture
            .filtered(filter, lookup.tiling.wrap, lookup.tiling.place(uv), |x, y| decoded(texture, x, y));
        let mut tilt = DVec3::from_array(texel);
        let turned = turned(lookup, uv) * f64::from(map.strength);
        tilt.x *= turned.x;
        tilt.y *= turned.y;
        let Some(tilted) = tilted(outwards, steps, tilt) else { return };
        let tilted = if place.is_front() { tilted } else { -tilted };
        let across = tilted.dot(ng);
        let tilted = if across < 0.0 { tilted - ng * (2.0 * across) } else { tilted };
        for axis in 0..3 {
            self.normals[block][axis].0[lane] = surface.ns[axis].0[lane];
            surface.ns[axis].0[lane] = tilted[axis] as f32;
        }
        self.lanes[block] |= 1 << lane;
    }
}

impl Surfaces {
    /// Of the points that a light may shine on, those that its direction reaches from the front of the untilted normal.
    #[inline(always)]
    pub(crate) fn before_untilted<S: Simd>(
        &self,
        simd: S,
        block: usize,
        to_light: Vec3x16<S>,
        facing: u32,
    ) -> u32 {
        let Some(untilted) = &self.untilted else { return facing };
        let normals = Vec3x16::load(simd, &untilted.normals[block]);
        let before = bits(normals.dot(to_light).simd_gt(splat(simd, 0.0)));
        facing & (before | !untilted.lanes[block])
    }
}

fn decoded(texture: &Texture, x: u32, y: u32) -> [f64; 3] {
    texture.texel(x, y).map(|code| f64::from(code) * (2.0 / 255.0) - 1.0)
}

/// Signs of x and y where the picture is turned round: by a negative scale, or in a reflected repeat.
fn turned(lookup: &TextureMap, uv: DVec2) -> DVec2 {
    let scale = lookup.tiling.scale.as_dvec2();
    let signs = DVec2::new(scale.x.signum(), scale.y.signum());
    if lookup.tiling.wrap != Wrap::Mirror {
        return signs;
    }
    let repeat = (uv * scale + lookup.tiling.offset.as_dvec2()).floor();
    let reflected = |repeat: f64| if repeat.rem_euclid(2.0) == 1.0 { -1.0 } else { 1.0 };
    signs * DVec2::new(reflected(repeat.x), reflected(repeat.y))
}

/// A unit normal tilted by x along u, y along v and z along itself; `None` where u and v span no surface.
fn tilted(normal: DVec3, [along_u, along_v]: [DVec3; 2], tilt: DVec3) -> Option<DVec3> {
    let x = (along_u - normal * normal.dot(along_u)).try_normalize()?;
    let across = normal.cross(x);
    let side = across.dot(along_v);
    if side == 0.0 || !side.is_finite() {
        return None;
    }
    let y = across * side.signum();
    (x * tilt.x + y * tilt.y + normal * tilt.z).try_normalize()
}

#[cfg(test)]
mod tests {
    use glam::Vec2;
    use proptest::prelude::*;

    use super::*;
    use crate::scene::{Filter, Tiling};
    use crate::texture::TextureId;

    /// The neutral texel of pictures with bytes is not quite straight: 128 is 1/255.
    fn neutral() -> DVec3 {
        DVec3::from_array([128.0, 128.0, 255.0].map(|code: f64| code * (2.0 / 255.0) - 1.0))
    }

    #[test]
    fn x_and_y_tilt_along_u_and_v() {
        let steps = [DVec3::X * 3.0, DVec3::Y * 0.1];
        let tilt = |x, y| tilted(DVec3::Z, steps, DVec3::new(x, y, 1.0)).unwrap();
        assert!((tilt(1.0, 0.0) - DVec3::new(1.0, 0.0, 1.0).normalize()).length() < 1e-15);
        assert!((tilt(0.0, 1.0) - DVec3::new(0.0, 1.0, 1.0).normalize()).length() < 1e-15);
        // v grows downwards: a picture that is seen in a mirror.
        let mirrored = tilted(DVec3::Z, [DVec3::X, DVec3::NEG_Y], DVec3::new(0.0, 1.0, 1.0)).unwrap();
        assert!((mirrored - DVec3::new(0.0, -1.0, 1.0).normalize()).length() < 1e-15);
        assert_eq!(tilted(DVec3::Z, [DVec3::X, DVec3::X], DVec3::ONE), None);
        assert_eq!(tilted(DVec3::Z, [DVec3::Z, DVec3::Y], DVec3::ONE), None);
    }

    #[test]
    fn reflected_repeats_and_negative_scales_turn_the_axes() {
        let lookup = |wrap, scale| TextureMap {
            texture: TextureId([0; 32]),
            filter: Filter::Nearest,
            tiling: Tiling { wrap, scale, offset: Vec2::ZERO },
        };
        let uv = DVec2::new(1.5, -1.5);
        assert_eq!(turned(&lookup(Wrap::Repeat, Vec2::ONE), uv), DVec2::ONE);
        assert_eq!(turned(&lookup(Wrap::Repeat, Vec2::new(-2.0, 1.0)), uv), DVec2::new(-1.0, 1.0));
        assert_eq!(turned(&lookup(Wrap::Mirror, Vec2::ONE), uv), DVec2::new(-1.0, 1.0));
    }

    proptest! {
        #[test]
        fn a_neutral_texel_leaves_normals_nearly_as_they_are(
            normal in prop::array::uniform3(-1.0..1.0_f64), u in prop::array::uniform3(-1.0..1.0_f64),
            v in prop::array::uniform3(-1.0..1.0_f64), strength in 0.0..1.0_f64,
        ) {
            let [normal, u, v] = [normal, u, v].map(DVec3::from);
            prop_assume!(normal.length() > 0.1 && normal.normalize().cross(u).length() > 0.1);
            let normal = normal.normalize();
            let tilt = neutral() * DVec3::new(strength, strength, 1.0);
            if let Some(found) = tilted(normal, [u, v], tilt) {
                prop_assert!((found - normal).length() < 1.0 / 127.0);
                prop_assert!((found.length() - 1.0).abs() < 1e-12);
            }
            if let Some(straight) = tilted(normal, [u, v], DVec3::Z) {
                prop_assert!((straight - normal).length() < 1e-12);
            }
        }
    }
}
