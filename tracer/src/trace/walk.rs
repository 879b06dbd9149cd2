//! One ray against one mesh: a filter in `f32` lanes, exact code for what passes.
//!
//! A node costs one slab test of sixteen boxes, a leaf one edge test of sixteen triangles. Both let through whatever
//! the exact test might accept, and little else; they never decide a hit.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3};

use crate::bvh::{MAX_WIDE_DEPTH, WIDTH, WideChild, WideNode};
use crate::mesh::{CompiledMesh, TriangleBlock};
use crate::simd::{Simd, SimdBase, bits, each_bit, f32x16, fma, splat, three};

/// Relative widening of distances: Ize's 2 gamma(3) ("Robust BVH Ray Traversal", JCGT 2013), and room for distances that
/// the exact test rounds elsewhere.
const SLACK: f32 = 1.0 + 4e-6;

/// Error of a corner's coordinates, in shares of the largest number that went into them.
const ROUNDING: f32 = 1.0 / (1 << 21) as f32;

/// A ray in mesh space, rounded to `f32` near the mesh. The filter's bounds account for the rounding.
pub(super) struct FilterRay {
    origin: Vec3,
    inverse: Vec3,
    negative: [bool; 3],
    axes: [usize; 3],
    shear: Vec3,
}

impl FilterRay {
    pub(super) fn new(origin: DVec3, direction: DVec3) -> Self {
        let (origin, single) = (origin.as_vec3(), direction.as_vec3());
        let z = direction.abs().max_position();
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let scale = direction[z];
        let shear = DVec3::new(direction[x] / scale, direction[y] / scale, 1.0 / scale).as_vec3();
        Self {
            origin,
            inverse: Vec3::ONE / single,
            negative: single.to_array().map(|component| component.is_sign_negative()),
            axes: [x, y, z],
            shear,
        }
    }
}

/// Calls `candidate(triangle)` for each triangle that the ray may hit within [0, `t_max`], those in nearer boxes
/// earlier. It answers with the farthest distance that is still of interest, or stops the walk.
#[inline(always)]
pub(super) fn walk<S: Simd>(
    simd: S,
    mesh: &CompiledMesh,
    ray: &FilterRay,
    mut t_max: f32,
    mut candidate: impl FnMut(u32) -> ControlFlow<(), f32>,
) -> ControlFlow<()> {
    let (nodes, blocks) = (mesh.nodes(), mesh.blocks());
    let mut stack = [(WideChild::Inner(0), 0.0_f32); MAX_WIDE_DEPTH * (WIDTH - 1) + 1];
    let mut depth = 1;
    while depth > 0 {
        depth -= 1;
        let (child, entry) = stack[depth];
        if entry > t_max * SLACK {
            continue;
        }
        match child {
            WideChild::Inner(index) => {
                let node = &nodes[index as usize];
                let (entered, entries) = enter(simd, node, ray, t_max);
                let first = depth;
                for lane in each_bit(entered) {
                    // Sorted so that the nearest ends on top.
                    let mut at = depth;
                    while at > first && stack[at - 1].1 < entries[lane] {
                        stack[at] = stack[at - 1];
                        at -= 1;
                    }
                    stack[at] = (node.child(lane), entries[lane]);
                    depth += 1;
                }
            }
            WideChild::Block(index) => {
                for lane in each_bit(candidates(simd, &blocks[index as usize], ray, t_max)) {
                    t_max = candidate(index * WIDTH as u32 + lane as u32)?;
                }
            }
        }
    }
    ControlFlow::Continue(())
}

/// Which children the ray enters within [0, `t_max`], and where.
#[inline(always)]
fn enter<S: Simd>(simd: S, node: &WideNode, ray: &FilterRay, t_max: f32) -> (u32, [f32; WIDTH]) {
    let mut near = splat(simd, 0.0);
    let mut far = splat(simd, t_max);
    for axis in 0..3 {
        let (origin, inverse) = (splat(simd, ray.origin[axis]), splat(simd, ray.inverse[axis]));
        let (lo, hi) = (node.lo[axis].load(simd), node.hi[axis].load(simd));
        let (entry, exit) = if ray.negative[axis] { (hi, lo) } else { (lo, hi) };
        // The operand that may be NaN (a ray inside the plane of a side) stands first: then the other one wins.
        near = ((entry - origin) * inverse).max_precise(near);
        far = ((exit - origin) * inverse).min_precise(far);
    }
    let entered = near.simd_le(far * splat(simd, SLACK));
    (bits(entered) & node.present(), near.to_array())
}

/// Twice the area between the ray and two corners, and the size of the numbers that it is made of.
#[inline(always)]
fn edge<S: Simd>(p: [f32x16<S>; 3], q: [f32x16<S>; 3]) -> (f32x16<S>, f32x16<S>) {
    (fma(p[0], q[1], -(p[1] * q[0])), (p[0].abs() + p[1].abs()) + (q[0].abs() + q[1].abs()))
}

/// Which triangles of a block the ray may hit within [0, `t_max`].
#[inline(always)]
fn candidates<S: Simd>(simd: S, block: &TriangleBlock, ray: &FilterRay, t_max: f32) -> u32 {
    let [x, y, z] = ray.axes;
    let zero = splat(simd, 0.0);
    let origin = three!(i => splat(simd, ray.origin[ray.axes[i]]));
    let shear = three!(i => splat(simd, ray.shear[i]));
    let flat = three!(k => {
        let px = block.0[k][x].load(simd) - origin[0];
        let py = block.0[k][y].load(simd) - origin[1];
        let pz = block.0[k][z].load(simd) - origin[2];
        [fma(-shear[0], pz, px), fma(-shear[1], pz, py), shear[2] * pz]
    });
    // Coordinates near the mesh are within 4 in magnitude, and the shear is at most 1.
    let error = splat(simd, 16.0 * ROUNDING);
    let edges = [edge(flat[2], flat[1]), edge(flat[0], flat[2]), edge(flat[1], flat[0])];
    let bound = error * edges[0].1.max(edges[1].1).max(edges[2].1);
    let least = edges[0].0.min(edges[1].0).min(edges[2].0);
    let most = edges[0].0.max(edges[1].0).max(edges[2].0);
    let nearest = flat[0][2].min(flat[1][2]).min(flat[2][2]);
    let farthest = flat[0][2].max(flat[1][2]).max(flat[2][2]);
    let depth_error = splat(simd, 16.0 * ROUNDING * ray.shear.z.abs());
    let inside = least.simd_ge(-bound) | most.simd_le(bound);
    let within =
        nearest.simd_le(splat(simd, t_max * SLACK) + depth_error) & farthest.simd_ge(zero - depth_error);
    bits(inside & within)
}
