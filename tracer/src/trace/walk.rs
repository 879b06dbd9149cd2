//! One ray down a tree of sixteen children a node, nearer children first.

use std::cell::RefCell;
use std::hint::black_box;
use std::ops::ControlFlow::{self, Continue};

use super::near_ray::NearRay;
use crate::bvh::{MAX_WIDE_DEPTH, WIDTH, WideChild, WideNode};
use crate::simd::{Simd, SimdBase, bits, f32x16, fma, splat, three};

/// The number of the root: see [`WideChild::of`].
const ROOT: u32 = 0;

/// What is done about the leaves that a ray reaches.
pub(super) trait Leaves<S: Simd> {
    /// Hits at a larger t are of no interest.
    fn limit(&self) -> f64;

    /// Looks at one leaf, within [0, `reach`]; may stop the walk, else tells whether the limit may have changed.
    /// What is above on the stack is free.
    fn visit(&mut self, simd: S, leaf: u32, reach: f32, stack: Stack) -> ControlFlow<(), bool>;

    /// Has a leaf that may be visited later brought into the cache.
    fn prefetch(&self, leaf: u32);
}

/// Visits each leaf that the ray may touch, nearer ones earlier.
#[inline(always)]
pub(super) fn walk<S: Simd>(
    simd: S,
    nodes: &[WideNode],
    ray: &NearRay,
    mut stack: Stack,
    leaves: &mut impl Leaves<S>,
) -> ControlFlow<()> {
    let slabs = Slabs::new(ray);
    let mut reach = ray.distance(leaves.limit());
    let mut next = Some(ROOT);
    while let Some(link) = next {
        // Lanes filled with a ray's numbers would else be made once, before the loop, and saved in memory around the
        // calls of a visit, at more than it costs to fill them from the numbers again.
        let Some(leaf) = stack.next_leaf(simd, nodes, leaves, black_box(&slabs), link, reach) else { break };
        if leaves.visit(simd, leaf, reach, stack.above())? {
            reach = ray.distance(leaves.limit());
        }
        next = stack.pop(reach);
    }
    Continue(())
}

/// A ray as boxes want it. The fourth numbers are idle, as in [`NearRay`].
struct Slabs<'a> {
    ray: &'a NearRay,
    /// Products with the origin that make the entry too early and the exit too late, by the error of coordinates: a
    /// box is entered whenever the exact ray touches it (Ize, "Robust BVH Ray Traversal", JCGT 2013, with an absolute
    /// bound, so that one fused operation a plane is enough).
    entry: [f32; 4],
    exit: [f32; 4],
    /// Where a node has the sides that the ray enters by; the others are those that it leaves by.
    first: [usize; 3],
}

impl<'a> Slabs<'a> {
    #[inline(always)]
    fn new(ray: &'a NearRay) -> Self {
        let (mut entry, mut exit) = ([0.0; 4], [0.0; 4]);
        for axis in 0..4 {
            let product = ray.origin[axis] * ray.inverse[axis];
            let slack = ray.inverse[axis].abs() * ray.error;
            (entry[axis], exit[axis]) = (-product - slack, slack - product);
        }
        let first = three!(axis => axis + 3 * (ray.inverse[axis].to_bits() >> 31) as usize);
        Self { ray, entry, exit, first }
    }

    #[inline(always)]
    fn lanes<S: Simd>(&'a self, simd: S, reach: f32) -> SlabLanes<'a, S> {
        SlabLanes {
            slabs: self,
            inverse: three!(axis => splat(simd, self.ray.inverse[axis])),
            entry: three!(axis => splat(simd, self.entry[axis])),
            exit: three!(axis => splat(simd, self.exit[axis])),
            reach: splat(simd, reach),
        }
    }
}

/// The numbers of [`Slabs`], each in all lanes.
struct SlabLanes<'a, S: Simd> {
    slabs: &'a Slabs<'a>,
    inverse: [f32x16<S>; 3],
    entry: [f32x16<S>; 3],
    exit: [f32x16<S>; 3],
    reach: f32x16<S>,
}

impl<S: Simd> SlabLanes<'_, S> {
    /// Which children the ray enters within [0, `reach`], and where.
    #[inline(always)]
    fn enter(&self, simd: S, node: &WideNode) -> (u32, f32x16<S>) {
        let sides = node.sides();
        let [x0, y0, z0] = three!(axis => {
            let first = sides[self.slabs.first[axis] % sides.len()].load(simd);
            fma(first, self.inverse[axis], self.entry[axis])
        });
        let [x1, y1, z1] = three!(axis => {
            let last = sides[(2 * axis + 3 - self.slabs.first[axis]) % sides.len()].load(simd);
            fma(last, self.inverse[axis], self.exit[axis])
        });
        let near = x0.max(y0).max(z0.max(splat(simd, 0.0)));
        let far = x1.min(y1).min(z1.min(self.reach));
        (bits(near.simd_le(far) & node.present_lanes(simd)), near)
    }
}

/// Room for the stacks of two walks: one may stand in a leaf of the other.
const ROOM: usize = 512;
const _: () = assert!(2 * (MAX_WIDE_DEPTH * (WIDTH - 1) + 1) <= ROOM);

thread_local! {
    static KEYS: RefCell<[u64; ROOM]> = const { RefCell::new([0; ROOM]) };
}

/// Calls `with` with the thread's stack: it would take longer to make one for each ray.
#[inline(always)]
pub(super) fn with_stack<R>(with: impl FnOnce(Stack) -> R) -> R {
    KEYS.with_borrow_mut(|keys| with(Stack { keys, bottom: 0, len: 0 }))
}

/// What a walk has to come back to, the nearest of each node on top.
pub(super) struct Stack<'a> {
    /// A child and where the ray enters it, as one number: of two, the lower is nearer. Distances are not negative, so
    /// that their bits compare as they do.
    keys: &'a mut [u64; ROOM],
    /// Where this walk's begin, and where they end.
    bottom: usize,
    len: usize,
}

impl Stack<'_> {
    /// A stack that begins where this one ends.
    #[inline(always)]
    pub(super) fn above(&mut self) -> Stack<'_> {
        Stack { keys: &mut *self.keys, bottom: self.len, len: self.len }
    }

    /// Goes on at a child, down to the next leaf that the ray enters within [0, `reach`].
    #[inline(always)]
    fn next_leaf<S: Simd>(
        &mut self,
        simd: S,
        nodes: &[WideNode],
        leaves: &impl Leaves<S>,
        slabs: &Slabs<'_>,
        mut next: u32,
        reach: f32,
    ) -> Option<u32> {
        let slabs = slabs.lanes(simd, reach);
        loop {
            match WideChild::of(next) {
                WideChild::Block(leaf) => return Some(leaf),
                WideChild::Inner(index) => {
                    let node = &nodes[index as usize];
                    let (entered, near) = slabs.enter(simd, node);
                    next = if entered == 0 {
                        self.pop(reach)?
                    } else {
                        self.push_all_but_nearest(leaves, node, entered, &near.to_array())
                    };
                }
            }
        }
    }

    /// Pushes the children in `entered`, of which there is one at least, but for the nearest, which it returns.
    #[inline(always)]
    fn push_all_but_nearest<S: Simd>(
        &mut self,
        leaves: &impl Leaves<S>,
        node: &WideNode,
        entered: u32,
        near: &[f32; WIDTH],
    ) -> u32 {
        let first = entered.trailing_zeros() as usize;
        let mut others = entered & (entered - 1);
        if others == 0 {
            return node.link(first);
        }
        let mut nearest = key(node, near, first);
        // The farthest so far, and what lies between it and the nearest: sorted by one step each, without a branch that
        // nobody can predict. More than three are sorted in part: a walk in any order finds the same.
        let lane = others.trailing_zeros() as usize;
        let (mut below, other) = (self.len, key(node, near, lane));
        let farther = nearest.max(other);
        self.keys[below % ROOM] = farther;
        prefetch_leaf(leaves, farther);
        nearest = nearest.min(other);
        others &= others - 1;
        while others != 0 {
            let other = key(node, near, others.trailing_zeros() as usize);
            let farther = nearest.max(other);
            prefetch_leaf(leaves, farther);
            nearest = nearest.min(other);
            let top = self.keys[below % ROOM];
            self.keys[below % ROOM] = top.max(farther);
            below += 1;
            self.keys[below % ROOM] = top.min(farther);
            others &= others - 1;
        }
        self.len = below + 1;
        nearest as u32
    }

    /// The next child that begins within `reach`.
    #[inline(always)]
    fn pop(&mut self, reach: f32) -> Option<u32> {
        while self.len > self.bottom {
            self.len -= 1;
            let key = self.keys[self.len % ROOM];
            if f32::from_bits((key >> 32) as u32) <= reach {
                return Some(key as u32);
            }
        }
        None
    }
}

/// See [`Stack`].
#[inline(always)]
fn key(node: &WideNode, near: &[f32; WIDTH], lane: usize) -> u64 {
    u64::from(near[lane % WIDTH].to_bits()) << 32 | u64::from(node.link(lane % WIDTH))
}

/// Nodes are few, and near in the cache anyhow.
#[inline(always)]
fn prefetch_leaf<S: Simd>(leaves: &impl Leaves<S>, key: u64) {
    if let WideChild::Block(leaf) = WideChild::of(key as u32) {
        leaves.prefetch(leaf);
    }
}
