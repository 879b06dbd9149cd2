//! Texture coordinates of sixteen points: interpolated between the corners of triangles, or found exactly.

use glam::{DVec2, Vec2};

use super::footprint::Footprint;
use super::group::barycentric_mean;
use crate::mesh::CompiledMesh;
use crate::scene::{Tiling, Wrap};
use crate::simd::{LANES, Lanes, Simd, each_bit, f32x16, splat};

/// Texture coordinates at the corners of sixteen triangles, indexed `[corner][u or v]`.
pub(super) struct CornerUvs {
    corners: [[Lanes; 2]; 3],
    /// Whole repeats, to be added for textures whose tiling distinguishes them.
    repeats: Option<[Lanes; 2]>,
}

/// Texture coordinates of sixteen points.
pub(super) struct PointUvs {
    places: Places,
    footprint: Option<Box<Footprint>>,
}

#[allow(clippy::large_enum_variant, reason = "one at a time, on the stack; nearly all are interpolated")]
enum Places {
    /// On triangles.
    Interpolated {
        near: [Lanes; 2],
        /// See [`CornerUvs`].
        repeats: Option<[Lanes; 2]>,
    },
    /// On spheres and planes, with whole repeats.
    Exact(Box<[DVec2; LANES]>),
}

impl CornerUvs {
    /// One triangle in all lanes.
    pub(super) fn splat(uvs: [Vec2; 3]) -> Self {
        Self { corners: uvs.map(|uv| uv.to_array().map(|c| Lanes([c; LANES]))), repeats: None }
    }

    /// Those of the triangles that lanes hit.
    #[inline(always)]
    pub(super) fn gather(mesh: &CompiledMesh, triangles: &[u32; LANES], lanes: u32) -> Self {
        let all = mesh.uvs();
        let mut uvs = [[Lanes::ZERO; 2]; 3];
        for lane in each_bit(lanes) {
            // `CompiledScene::new` checks that a mesh under a texture has them.
            let corners = all.get(triangles[lane] as usize).copied().unwrap_or_default();
            for (uvs, corner) in uvs.iter_mut().zip(corners) {
                uvs[0].0[lane] = corner.x;
                uvs[1].0[lane] = corner.y;
            }
        }
        let repeats = (!mesh.uv_repeats().is_empty()).then(|| gather_repeats(mesh, triangles, lanes));
        Self { corners: uvs, repeats }
    }

    /// Interpolates between the corners: `weights` are those of the second and the third.
    #[inline(always)]
    pub(super) fn at<S: Simd>(
        &self,
        simd: S,
        weights: [f32x16<S>; 2],
        footprint: Option<Box<Footprint>>,
    ) -> PointUvs {
        let [a, b, c] = &self.corners;
        let mut near = [Lanes::ZERO; 2];
        for axis in 0..2 {
            near[axis].store(barycentric_mean(simd, [&a[axis], &b[axis], &c[axis]], weights));
        }
        PointUvs { places: Places::Interpolated { near, repeats: self.repeats }, footprint }
    }
}

#[inline(never)]
fn gather_repeats(mesh: &CompiledMesh, triangles: &[u32; LANES], lanes: u32) -> [Lanes; 2] {
    let mut repeats = [Lanes::ZERO; 2];
    for lane in each_bit(lanes) {
        let whole = mesh.whole_repeats(triangles[lane]);
        repeats[0].0[lane] = whole.x;
        repeats[1].0[lane] = whole.y;
    }
    repeats
}

impl PointUvs {
    /// Texture coordinates found exactly.
    pub(super) fn exact(uvs: Box<[DVec2; LANES]>, footprint: Option<Box<Footprint>>) -> Self {
        Self { places: Places::Exact(uvs), footprint }
    }

    /// Footprints of the points, where a filter depends on them.
    pub(super) fn footprint(&self) -> Option<&Footprint> {
        self.footprint.as_deref()
    }

    /// Coordinates with the scale and the offset of a texture's tiling. Exact ones are reduced to where `wrap` leaves them the same,
    /// so that `f32` keeps their digits.
    #[inline(always)]
    pub(super) fn laid<S: Simd>(&self, simd: S, tiling: &Tiling) -> [f32x16<S>; 2] {
        let (near, repeats) = match &self.places {
            Places::Interpolated { near, repeats } => (near, repeats),
            Places::Exact(uvs) => {
                let reduced = reduce(uvs, tiling);
                return [reduced[0].load(simd), reduced[1].load(simd)];
            }
        };
        let [u, v] = [near[0].load(simd), near[1].load(simd)];
        if *tiling == Tiling::default() {
            return [u, v];
        }
        let [u, v] = match repeats {
            Some(repeats) if tiling.distinguishes_repeats() => {
                [u + repeats[0].load(simd), v + repeats[1].load(simd)]
            }
            _ => [u, v],
        };
        let Tiling { scale, offset, .. } = tiling;
        [u * splat(simd, scale.x) + splat(simd, offset.x), v * splat(simd, scale.y) + splat(simd, offset.y)]
    }
}

#[inline(never)]
fn reduce(uvs: &[DVec2; LANES], tiling: &Tiling) -> [Lanes; 2] {
    let mut reduced = [Lanes::ZERO; 2];
    for (lane, uv) in uvs.iter().enumerate() {
        let at = *uv * tiling.scale.as_dvec2() + tiling.offset.as_dvec2();
        let at = match tiling.wrap {
            Wrap::Repeat => at - at.floor(),
            Wrap::Mirror => at - (at * 0.5).floor() * 2.0,
            Wrap::Clamp => at.clamp(DVec2::ZERO, DVec2::ONE),
        };
        reduced[0].0[lane] = at.x as f32;
        reduced[1].0[lane] = at.y as f32;
    }
    reduced
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_coordinates_keep_their_digits() {
        let far = 1e6 + 0.123_456_7;
        let uvs = [DVec2::new(far, -far); LANES];
        let at = |wrap, scale: f32| {
            let tiling = Tiling { wrap, scale: Vec2::splat(scale), ..Tiling::default() };
            reduce(&uvs, &tiling).map(|lanes| lanes.0[5])
        };
        let near = |found: [f32; 2], expected: [f32; 2]| {
            assert!((found[0] - expected[0]).abs() < 2e-7, "{found:?}");
            assert!((found[1] - expected[1]).abs() < 2e-7, "{found:?}");
        };
        near(at(Wrap::Repeat, 1.0), [0.123_456_7, 1.0 - 0.123_456_7]);
        // 500,000 repeats and a half of 0.123...
        near(at(Wrap::Repeat, 0.5), [0.061_728_35, 1.0 - 0.061_728_35]);
        near(at(Wrap::Mirror, 1.0), [0.123_456_7, 2.0 - 0.123_456_7]);
        near(at(Wrap::Clamp, 1.0), [1.0, 0.0]);
    }
}
