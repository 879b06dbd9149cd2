//! Traversal of a tree with sixteen children a node by one ray, nearer children first.

use std::cell::RefCell;
use std::hint::black_box;
use std::ops::ControlFlow::{self, Continue};

use super::near_ray::NearRay;
use crate::bvh::{MAX_WIDE_DEPTH, WIDTH, WideChild, WideNode};
use crate::simd::{Simd, SimdBase, bits, f32x16, fma, splat, three};

/// Link to the root: see [`WideChild::of`].
const ROOT: u32 = 0;

/// Visitor of the leaves that a ray reaches.
pub(super) trait LeafVisitor<S: Simd> {
    /// Upper end of the distances that matter.
    fn limit(&self) -> f64;

    /// Visits a leaf, within [0, `reach`]. Breaks the traversal, or returns whether the limit may have changed. The part of
    /// the stack above is free.
    fn visit(&mut self, simd: S, leaf: u32, reach: f32, stack: Stack) -> ControlFlow<(), bool>;

    /// Prefetches a leaf that may be visited later.
    fn prefetch(&self, leaf: u32);
}

/// Visits each leaf whose box the ray may enter, nearer ones first.
#[inline(always)]
pub(super) fn traverse<S: Simd>(
    simd: S,
    nodes: &[WideNode],
    ray: &NearRay,
    mut stack: Stack,
    leaves: &mut impl LeafVisitor<S>,
) -> ControlFlow<()> {
    let slabs = Slabs::new(ray);
    let mut reach = ray.distance(leaves.limit());
    let mut next = Some(ROOT);
    while let Some(link) = next {
        // Hides the numbers from the optimiser: it would splat them once, before the loop, and spill the vectors around the
        // calls of a visit, which costs more than to splat them again.
        let Some(leaf) = stack.next_leaf(simd, nodes, leaves, black_box(&slabs), link, reach) else { break };
        if leaves.visit(simd, leaf, reach, stack.above())? {
            reach = ray.distance(leaves.limit());
        }
        next = stack.pop(reach);
    }
    Continue(())
}

/// A ray prepared for slab tests. The fourth numbers are padding, as in [`NearRay`].
struct Slabs<'a> {
    ray: &'a NearRay,
    /// Products with the origin, moved by the error bound of coordinates so that entries are early and exits late: a box is
    /// entered whenever the exact ray touches it (Ize, "Robust BVH Ray Traversal", JCGT 2013, with an absolute
    /// bound, so that one fused operation a plane suffices).
    entry: [f32; 4],
    exit: [f32; 4],
    /// Indices of the sides of a node through which the ray enters; it leaves through the others.
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

/// The numbers of [`Slabs`], each splat to all lanes.
struct SlabLanes<'a, S: Simd> {
    slabs: &'a Slabs<'a>,
    inverse: [f32x16<S>; 3],
    entry: [f32x16<S>; 3],
    exit: [f32x16<S>; 3],
    reach: f32x16<S>,
}

impl<S: Simd> SlabLanes<'_, S> {
    /// Bits of the children that the ray enters within [0, `reach`], and the distances of the entries.
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

/// Capacity for the stacks of two traversals: one of a mesh runs in a leaf of one of the scene.
const ROOM: usize = 512;
const _: () = assert!(2 * (MAX_WIDE_DEPTH * (WIDTH - 1) + 1) <= ROOM);

thread_local! {
    static KEYS: RefCell<[u64; ROOM]> = const { RefCell::new([0; ROOM]) };
}

/// Calls a function with the thread's stack, which is not initialised for each ray. Dispatch to a level inside of `with`: it is a
/// closure, which is compiled for no level. `with` must not call this function.
#[inline(always)]
pub(in crate::intersect) fn with_stack<R>(with: impl FnOnce(Stack) -> R) -> R {
    KEYS.with_borrow_mut(|keys| with(Stack { keys, bottom: 0, len: 0 }))
}

/// Children that are still to be visited, the nearest of each node on top.
pub(in crate::intersect) struct Stack<'a> {
    /// A child and the distance of its entry as one number, so that the nearer child has the lower one: bits of numbers that
    /// are not negative compare as the numbers do.
    keys: &'a mut [u64; ROOM],
    /// Range of this traversal's keys.
    bottom: usize,
    len: usize,
}

impl Stack<'_> {
    /// A stack that starts at the end of this one.
    #[inline(always)]
    pub(in crate::intersect) fn above(&mut self) -> Stack<'_> {
        Stack { keys: &mut *self.keys, bottom: self.len, len: self.len }
    }

    /// Continues at a child, down to the next leaf that the ray enters within [0, `reach`].
    #[inline(always)]
    fn next_leaf<S: Simd>(
        &mut self,
        simd: S,
        nodes: &[WideNode],
        leaves: &impl LeafVisitor<S>,
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

    /// Pushes the children in `entered`, which is not 0, except for the nearest, which is returned.
    #[inline(always)]
    fn push_all_but_nearest<S: Simd>(
        &mut self,
        leaves: &impl LeafVisitor<S>,
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
        // One step of a sort each, without unpredictable branches. More than three children are sorted in part: traversals in
        // any order find the same hits.
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

    /// Pops the next child that is entered within `reach`.
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

/// The key of a child: see [`Stack`].
#[inline(always)]
fn key(node: &WideNode, near: &[f32; WIDTH], lane: usize) -> u64 {
    u64::from(near[lane % WIDTH].to_bits()) << 32 | u64::from(node.link(lane % WIDTH))
}

/// Prefetches a leaf. Nodes are few, and in the cache in most cases.
#[inline(always)]
fn prefetch_leaf<S: Simd>(leaves: &impl LeafVisitor<S>, key: u64) {
    if let WideChild::Block(leaf) = WideChild::of(key as u32) {
        leaves.prefetch(leaf);
    }
}
