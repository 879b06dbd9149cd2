//! One ray down a tree of sixteen children a node, nearer children first.

use std::ops::ControlFlow::{self, Continue};

use super::near_ray::NearRay;
use crate::bvh::{WIDTH, WideChild, WideNode};
use crate::simd::{Simd, SimdBase, bits, each_bit, f32x16, fma, splat, three};

/// The number of the root: see [`WideChild::of`].
const ROOT: u32 = 0;

/// What is done about the leaves that a ray reaches.
pub(super) trait Leaves<S: Simd> {
    /// Hits at a larger t are of no interest.
    fn limit(&self) -> f64;

    /// Looks at one leaf, within [0, `reach`]; may stop the walk.
    fn visit(&mut self, simd: S, leaf: u32, reach: f32) -> ControlFlow<()>;
}

/// Visits each leaf that the ray may touch, nearer ones earlier. `stack` must be empty.
#[inline(always)]
pub(super) fn walk<S: Simd>(
    simd: S,
    nodes: &[WideNode],
    ray: &NearRay,
    stack: &mut Stack,
    leaves: &mut impl Leaves<S>,
) -> ControlFlow<()> {
    let slabs = Slabs::new(ray);
    let mut reach = ray.distance(leaves.limit());
    let mut next = ROOT;
    loop {
        match WideChild::of(next) {
            WideChild::Inner(index) => {
                let node = &nodes[index as usize];
                let (entered, near) = slabs.enter(simd, node, reach);
                if entered != 0 {
                    next = stack.push_all_but_nearest(node, entered, &near.to_array());
                    continue;
                }
            }
            WideChild::Block(leaf) => {
                leaves.visit(simd, leaf, reach)?;
                reach = ray.distance(leaves.limit());
            }
        }
        match stack.pop(reach) {
            Some(link) => next = link,
            None => return Continue(()),
        }
    }
}

/// A ray as boxes want it.
struct Slabs {
    inverse: [f32; 3],
    /// Products with the origin that make the entry too early and the exit too late, by the error of coordinates: a
    /// box is entered whenever the exact ray touches it (Ize, "Robust BVH Ray Traversal", JCGT 2013, with an absolute
    /// bound, so that one fused operation a plane is enough).
    entry: [f32; 3],
    exit: [f32; 3],
    /// Where a node has the sides that the ray enters by, and those that it leaves by.
    first: [usize; 3],
    last: [usize; 3],
}

impl Slabs {
    #[inline(always)]
    fn new(ray: &NearRay) -> Self {
        let (mut entry, mut exit, mut first, mut last) = ([0.0; 3], [0.0; 3], [0; 3], [0; 3]);
        for axis in 0..3 {
            let product = ray.origin[axis] * ray.inverse[axis];
            let slack = ray.inverse[axis].abs() * ray.error;
            (entry[axis], exit[axis]) = (-product - slack, slack - product);
            let negative = (ray.inverse[axis].to_bits() >> 31) as usize;
            (first[axis], last[axis]) = (axis + 3 * negative, axis + 3 - 3 * negative);
        }
        Self { inverse: ray.inverse, entry, exit, first, last }
    }

    /// Which children the ray enters within [0, `reach`], and where.
    #[inline(always)]
    fn enter<S: Simd>(&self, simd: S, node: &WideNode, reach: f32) -> (u32, f32x16<S>) {
        let sides = node.sides();
        let inverse = three!(axis => splat(simd, self.inverse[axis]));
        let [x0, y0, z0] = three!(axis => {
            fma(sides[self.first[axis]].load(simd), inverse[axis], splat(simd, self.entry[axis]))
        });
        let [x1, y1, z1] = three!(axis => {
            fma(sides[self.last[axis]].load(simd), inverse[axis], splat(simd, self.exit[axis]))
        });
        let near = x0.max(y0).max(z0.max(splat(simd, 0.0)));
        let far = x1.min(y1).min(z1.min(splat(simd, reach)));
        (bits(near.simd_le(far) & node.present_lanes(simd)), near)
    }
}

/// Children that are kept at hand: deeper trees than usual keep the rest in memory of its own.
const AT_HAND: usize = 32;

/// What a walk has to come back to, the nearest of each node on top.
pub(super) struct Stack {
    /// A child and where the ray enters it, as one number: of two, the lower is nearer. Distances are not negative, so
    /// that their bits compare as they do.
    keys: [u64; AT_HAND],
    len: usize,
    rest: Vec<u64>,
}

impl Stack {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self { keys: [0; AT_HAND], len: 0, rest: Vec::new() }
    }

    /// Pushes the children in `entered`, of which there is one at least, but for the nearest, which it returns.
    #[inline(always)]
    fn push_all_but_nearest(&mut self, node: &WideNode, entered: u32, near: &[f32; WIDTH]) -> u32 {
        let first = entered.trailing_zeros() as usize;
        let others = entered & (entered - 1);
        if others == 0 {
            return node.link(first);
        }
        if self.len > AT_HAND - WIDTH {
            self.put_away();
        }
        let key = |lane: usize| u64::from(near[lane].to_bits()) << 32 | u64::from(node.link(lane));
        let bottom = self.len;
        let mut nearest = key(first);
        for lane in each_bit(others) {
            let key = key(lane);
            let farther = nearest.max(key);
            nearest = nearest.min(key);
            let mut at = self.len;
            while at > bottom && self.keys[at - 1] < farther {
                self.keys[at] = self.keys[at - 1];
                at -= 1;
            }
            self.keys[at] = farther;
            self.len += 1;
        }
        nearest as u32
    }

    /// The next child that begins within `reach`.
    #[inline(always)]
    fn pop(&mut self, reach: f32) -> Option<u32> {
        loop {
            let key = if self.len > 0 {
                self.len -= 1;
                self.keys[self.len]
            } else {
                self.rest.pop()?
            };
            if f32::from_bits((key >> 32) as u32) <= reach {
                return Some(key as u32);
            }
        }
    }

    #[cold]
    fn put_away(&mut self) {
        self.rest.extend_from_slice(&self.keys[..self.len]);
        self.len = 0;
    }
}
