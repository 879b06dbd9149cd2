//! Origins of shadow rays on smooth surfaces: points lifted to the surface that the interpolated normals describe.
//!
//! Interpolated normals light a triangle up to a place where its plane has turned away from the light. There the triangle is in the
//! shadow of its own mesh, and the edge of that shadow is a sawtooth of whole triangles. So shadow rays start on a smooth surface
//! above the triangle: at the mean, by barycentric weights, of the point's projections onto the planes through the corners across
//! their normals (Hanika, "Hacking the Shadow Terminator", Ray Tracing Gems II, 2021). Of the shift only the part along the
//! geometric normal is used:
//!
//! ```text
//!   lift = sum_i w_i max(0, (v_i - p).n_i) (n_i . ng)      n_i on the side of the viewer
//!   full for ng.L <= 1/4, fading to 0 at ng.L = 1/2
//! ```
//!
//! A steeper light is not hidden by triangles that are turned by less than 30 degrees, and without the lift the shadows of things
//! that touch the surface stay where they are. The alternative is to fade the light out towards the plane of the triangle (Chiang,
//! Li and Burley, "Taming the Shadow Terminator", 2019). On coarse meshes that makes the triangles visible: on a sphere of 960
//! triangles the error of linear light is 0.009, against 0.005 without any remedy and 0.003, that of the normals themselves, with
//! this one.

use super::Surfaces;
use super::group::{Group, ThreeVectors};
use super::space::Space;
use crate::frame::PreparedFrame;
use crate::rays::{BLOCKS, SurfaceSource};
use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, SimdBase, f32x16, mask32x16, select, splat};

/// Cosine ng.L from which on a shadow ray starts at the triangle itself.
const UNLIFTED: f32 = 0.5;

/// Full lift per cosine below [`UNLIFTED`].
const FADE: f32 = 4.0;

/// Lifts of the points of a tile, in eye units; 0 where normals are not interpolated.
pub(super) struct Lifts([Lanes; BLOCKS]);

/// Points on triangles with interpolated normals, in the space of their mesh.
pub(super) struct SmoothPoints<'a, S: Simd> {
    /// Relative to the first corner.
    pub at: Vec3x16<S>,
    pub ab: Vec3x16<S>,
    pub ac: Vec3x16<S>,
    /// Barycentric weights of the second and the third corner.
    pub weights: [f32x16<S>; 2],
    pub normals: &'a ThreeVectors<S>,
    /// Where the normals are on the back as the viewer sees it.
    pub against: mask32x16<S>,
    /// Geometric unit normals in eye space, on the side of the viewer.
    pub ng: Vec3x16<S>,
}

impl Lifts {
    /// Lifts for a frame; `None` if its shadows need none.
    pub(super) fn for_frame(frame: &PreparedFrame) -> Option<Box<Self>> {
        let features = &frame.features;
        let used = features.smooth && features.shadows && frame.view().quality.smooth_terminator;
        used.then(|| Box::new(Self([Lanes::ZERO; BLOCKS])))
    }

    /// Resets a block.
    pub(super) fn clear(&mut self, block: usize) {
        self.0[block] = Lanes::ZERO;
    }

    /// Sets the lifts of some lanes. Not inlined: the code of scenes without it stays dense.
    #[inline(never)]
    pub(super) fn put<S: Simd, R: SurfaceSource>(
        &mut self,
        simd: S,
        group: &Group<'_, R, S>,
        space: &Space<R>,
        points: &SmoothPoints<'_, S>,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                let lift = points.lift(simd, &space.normals, space.normals_scale);
                group.put_one(simd, lift, &mut self.0[group.block]);
            },
        );
    }
}

impl<S: Simd> SmoothPoints<'_, S> {
    /// The lifts; `normals` are the columns of the map of normals to eye space, divided by `scale`.
    #[inline(always)]
    fn lift(&self, simd: S, normals: &[[f32; 3]; 3], scale: f32) -> f32x16<S> {
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let [u, v] = self.weights;
        let weights = [one - u - v, u, v];
        let from_corners = [self.at, self.at.sub(self.ab), self.at.sub(self.ac)];
        let mut lift = zero;
        for k in 0..3 {
            // n.d is the same in eye space and in mesh space, up to the scale of the normal.
            let height = self.normals[k].dot(from_corners[k]) * splat(simd, scale);
            let below = select(self.against, height, -height).max(zero);
            let normal = self.normals[k].transform(simd, normals);
            let along = normal.dot(self.ng);
            let along = select(self.against, -along, along);
            lift += weights[k] * below * along / normal.dot(normal);
        }
        // Not for NaN: a corner without a normal.
        let usable = lift.simd_gt(zero) & lift.simd_le(splat(simd, f32::MAX));
        select(usable, lift, zero)
    }
}

impl Surfaces {
    /// Distances of the origins of shadow rays from the points of a block, along ng: to the side of the light, or onto the smooth
    /// surface. `along` is ng.L.
    #[inline(always)]
    pub(crate) fn to_shadow_origins<S: Simd>(&self, simd: S, block: usize, along: f32x16<S>) -> f32x16<S> {
        let zero = splat(simd, 0.0);
        let bias = self.blocks[block].bias.load(simd);
        let side = select(along.simd_lt(zero), -bias, bias);
        let Some(lifts) = &self.lifts else { return side };
        let lift = lifts.0[block].load(simd);
        let share = (splat(simd, UNLIFTED) - along) * splat(simd, FADE);
        let raised = bias + lift * share.min(splat(simd, 1.0)).max(zero);
        select(lift.simd_gt(zero), raised, side)
    }
}
