//! Vertex colours at surface points, in linear light.

use super::group::barycentric_mean;
use crate::mesh::CompiledMesh;
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, each_bit, f32x16, three};
use crate::srgb;

/// Colours at the corners of sixteen triangles, indexed `[corner][channel]`.
pub(super) struct CornerColors([[Lanes; 3]; 3]);

impl CornerColors {
    /// Those of the triangles that lanes hit; white in all others.
    #[inline(never)]
    pub(super) fn gather(mesh: &CompiledMesh, triangles: &[u32; LANES], lanes: u32) -> Self {
        let (all, decoded) = (mesh.colors(), srgb::decoded());
        let mut colors = [[Lanes([1.0; LANES]); 3]; 3];
        for lane in each_bit(lanes) {
            let Some(corners) = all.get(triangles[lane] as usize) else { continue };
            for (colors, corner) in colors.iter_mut().zip(corners) {
                for (color, code) in colors.iter_mut().zip(corner) {
                    color.0[lane] = decoded[usize::from(*code)];
                }
            }
        }
        Self(colors)
    }

    /// Interpolates between the corners: `weights` are those of the second and the third.
    #[inline(always)]
    pub(super) fn at<S: Simd>(&self, simd: S, weights: [f32x16<S>; 2]) -> Vec3x16<S> {
        let [a, b, c] = &self.0;
        Vec3x16(three!(i => barycentric_mean(simd, [&a[i], &b[i], &c[i]], weights)))
    }
}
