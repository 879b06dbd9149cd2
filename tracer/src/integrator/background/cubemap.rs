//! Cube maps: six square pictures on the faces of a cube around the scene.
//!
//! OpenGL's table of faces (OpenGL 4.6, table 8.19), in which ma is the component of the largest magnitude:
//!
//! ```text
//!   face   sc   tc        s = (sc / |ma| + 1) / 2 from the left of the picture
//!    +X    -z   -y        t = (tc / |ma| + 1) / 2 from its top
//!    -X    +z   -y
//!    +Y    +x   +z
//!    -Y    +x   -z
//!    +Z    +x   -y
//!    -Z    -x   -y
//! ```
//!
//! The table is that of a left-handed system: seen from the centre, a face is its picture reflected from left to right.

use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, SimdBase, bits, each_bit, f32x16, mask_of, select, splat};
use crate::texture::Texture;
use crate::texture::bilinear::{Axis, mean};

/// The faces that directions meet, and the places there in [-1, 1].
struct Meeting<S: Simd> {
    /// Bits of the lanes on the faces of the X and of the Y axis; the others are on those of the Z axis.
    on_x: u32,
    on_y: u32,
    /// Bits of the lanes on the face of the negative direction.
    negative: u32,
    /// sc / |ma| and tc / |ma|.
    place: [f32x16<S>; 2],
}

impl<S: Simd> Meeting<S> {
    #[inline(always)]
    fn of(simd: S, direction: Vec3x16<S>) -> Self {
        let zero = splat(simd, 0.0);
        let [x, y, z] = direction.0;
        let [size_x, size_y, size_z] = [x.abs(), y.abs(), z.abs()];
        let on_x = bits(size_x.simd_ge(size_y) & size_x.simd_ge(size_z));
        let on_y = bits(size_y.simd_ge(size_z)) & !on_x;
        let by_axis = |of_x: f32x16<S>, of_y: f32x16<S>, of_z: f32x16<S>| {
            select(mask_of(simd, on_x), of_x, select(mask_of(simd, on_y), of_y, of_z))
        };
        let negative = by_axis(x, y, z).simd_lt(zero);
        let sc = by_axis(select(negative, z, -z), x, select(negative, -x, x));
        let tc = by_axis(-y, select(negative, -z, z), -y);
        let ma = by_axis(size_x, size_y, size_z);
        let ma = select(ma.simd_gt(zero), ma, splat(simd, 1.0));
        Self { on_x, on_y, negative: bits(negative), place: [sc / ma, tc / ma] }
    }

    /// Index of the face of a lane.
    #[inline(always)]
    fn face(&self, lane: usize) -> usize {
        let is = |lanes: u32| lanes >> lane & 1 == 1;
        let axis = match (is(self.on_x), is(self.on_y)) {
            (true, _) => 0,
            (false, true) => 1,
            (false, false) => 2,
        };
        2 * axis + usize::from(is(self.negative))
    }
}

/// Radiance in directions of any length, with the faces +X, -X, +Y, -Y, +Z, -Z. Interpolation ends at the border of a face.
#[inline(always)]
pub(super) fn radiance<S: Simd>(
    simd: S,
    faces: [&Texture; 6],
    direction: Vec3x16<S>,
    lanes: u32,
) -> Vec3x16<S> {
    let meeting = Meeting::of(simd, direction);
    let mut half_size = [Lanes::ZERO; 2];
    for lane in each_bit(lanes) {
        let face = faces[meeting.face(lane)];
        half_size[0].0[lane] = 0.5 * face.width() as f32;
        half_size[1].0[lane] = 0.5 * face.height() as f32;
    }
    let [half_width, half_height] = [half_size[0].load(simd), half_size[1].load(simd)];
    let [s, t] = meeting.place;
    let columns = Axis::clamped(simd, s * half_width + half_width, half_width + half_width);
    // The texture's rows begin at the bottom.
    let rows = Axis::clamped(simd, half_height - t * half_height, half_height + half_height);
    mean(simd, &columns, &rows, lanes, |lane, x, y| faces[meeting.face(lane)].linear_texel(x, y))
}
