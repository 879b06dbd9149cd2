//! Traversal of a tree by a tile: the scene's tree over its items, or a mesh's tree over blocks of triangles.
//!
//! [`Traversal`] returns leaves nearest first, so that early hits cull later boxes. [`Frontier`] finds all leaves, level by
//! level: loads of one level's nodes overlap, which suits queries for any triangle.

use super::Picture;
use super::projected_boxes::{ProjectedBoxes, Row, in_front, in_frustum};
use crate::bvh::{MAX_WIDE_DEPTH, WIDTH, WideChild, WideNode};
use crate::mesh::TriangleBlock;
use crate::rays::{ALL_BLOCKS, Frustum};
use crate::simd::{Indices, Lanes, Simd, SimdBase, bits, each_bit, prefetch, select, splat};

/// The boxes that matter to a query.
pub(super) trait NodeFilter<S: Simd> {
    /// Whether rays may be on a grid with step 1 (see [`crate::rays::TileRays::on_grid`]), so that boxes and triangles between them can
    /// be dropped.
    const ON_GRID: bool;

    /// Whether rays are parallel and start at depth 0, so that boxes behind it can be dropped.
    #[inline(always)]
    fn is_from_plane(&self) -> bool {
        false
    }

    /// Least closeness that matters to each block of rays; infinity if none does.
    fn least(&self) -> &Lanes;

    /// The least of [`NodeFilter::least`].
    fn least_closeness(&self) -> f32;

    /// Bits of those of `blocks` that a box matters to. The box is within `rectangle` of the picture (x from and to, y from and
    /// to), which overlaps the rectangles of `blocks`, and nowhere closer than `z_most`.
    fn refine(&self, simd: S, rectangle: [f32; 4], z_most: f32, blocks: u32) -> u32;
}

/// Bits of the blocks with a ray that a closeness matters to.
#[inline(always)]
pub(super) fn open_blocks<S: Simd>(simd: S, least: &Lanes, z_most: f32) -> u32 {
    bits(least.load(simd).simd_le(splat(simd, z_most)))
}

/// A child that is still to be visited.
#[derive(Clone, Copy)]
struct Pending {
    /// See [`WideChild::of`].
    link: u32,
    z_most: f32,
    /// Bits of the blocks that it matters to.
    blocks: u32,
}

impl Pending {
    const ROOT: Pending = Pending { link: 0, z_most: f32::INFINITY, blocks: ALL_BLOCKS };
}

/// Stack of the children that are still to be visited. Kept from traversal to traversal, without being cleared.
pub(super) struct TraversalStack([Pending; MAX_WIDE_DEPTH * (WIDTH - 1) + 1]);

impl TraversalStack {
    pub(super) const EMPTY: TraversalStack =
        TraversalStack([Pending::ROOT; MAX_WIDE_DEPTH * (WIDTH - 1) + 1]);
}

/// Test of the nodes of a tree against a tile.
struct NodeTester<'a> {
    nodes: &'a [WideNode],
    /// The leaves of the tree, to be prefetched; empty for the scene's tree.
    leaves: &'a [TriangleBlock],
    picture: Picture<'a>,
    rows: [Row; 3],
}

/// The children of a node that matter.
struct Opened {
    /// Bits of the children.
    wanted: u32,
    /// Bits of the blocks of rays that each child matters to.
    blocks: Indices,
    /// Greatest closeness of each child.
    z_most: Lanes,
}

impl<'a> NodeTester<'a> {
    #[inline(always)]
    fn new(nodes: &'a [WideNode], leaves: &'a [TriangleBlock], picture: Picture<'a>) -> Self {
        let [a, b, g] = picture.projection.rows;
        Self { nodes, leaves, picture, rows: [Row::new(a), Row::new(b), Row::new(g)] }
    }

    /// Prefetches a child when it is found: a load takes some hundred cycles, a node less.
    #[inline(always)]
    fn prefetch(&self, child: WideChild) {
        match child {
            WideChild::Inner(index) => prefetch(&self.nodes[index as usize]),
            WideChild::Block(index) => {
                if let Some(leaf) = self.leaves.get(index as usize) {
                    prefetch(leaf);
                }
            }
        }
    }

    /// Tests the children of a node that matters to some blocks. A function of its own on each level: inlined into its callers,
    /// it would fill the instruction cache.
    #[inline(never)]
    fn open<S: Simd, F: NodeFilter<S>>(&self, simd: S, node: &WideNode, blocks: u32, filter: &F) -> Opened {
        simd.vectorize(
            #[inline(always)]
            || self.open_here(simd, node, blocks, filter),
        )
    }

    #[inline(always)]
    fn open_here<S: Simd, F: NodeFilter<S>>(
        &self,
        simd: S,
        node: &WideNode,
        blocks: u32,
        filter: &F,
    ) -> Opened {
        let Picture { projection, rays } = self.picture;
        let boxes = ProjectedBoxes::new(simd, node, projection, &self.rows);
        let near_enough = boxes.z_most.load(simd).simd_ge(splat(simd, filter.least_closeness()));
        let mut wanted = node.present() & bits(near_enough);
        let crossing = wanted & boxes.crossing;
        if crossing != 0 {
            // A box that reaches behind the projection has no rectangle.
            wanted &= !crossing | in_frustum(simd, node, &Frustum::new(projection, rays.union));
        }
        wanted &= crossing | boxes.overlapping::<S, F>(simd, rays);
        if filter.is_from_plane() {
            wanted &= in_front(simd, node, &self.rows[2], projection.error[1]);
        }
        let least = filter.least();
        let few = wanted.count_ones() <= blocks.count_ones();
        let mut by_block = if few { Indices::ZERO } else { boxes.blocks_of_all(simd, rays, least, blocks) };
        for lane in each_bit(wanted) {
            if crossing >> lane & 1 == 1 {
                by_block.0[lane] = ALL_BLOCKS;
                continue;
            }
            if few {
                by_block.0[lane] = boxes.blocks_of(simd, lane, rays, least, blocks);
            }
            let (rectangle, z_most) = boxes.get(lane);
            by_block.0[lane] = filter.refine(simd, rectangle, z_most, by_block.0[lane]);
            wanted &= !(u32::from(by_block.0[lane] == 0) << lane);
        }
        Opened { wanted, blocks: by_block, z_most: boxes.z_most }
    }
}

/// A traversal in progress, nearest first.
pub(super) struct Traversal<'a> {
    tester: NodeTester<'a>,
    stack: &'a mut TraversalStack,
    height: usize,
    /// Whether boxes that reach behind the projection come last, not first.
    around_last: bool,
}

impl<'a> Traversal<'a> {
    #[inline(always)]
    pub(super) fn new(
        nodes: &'a [WideNode],
        leaves: &'a [TriangleBlock],
        picture: Picture<'a>,
        stack: &'a mut TraversalStack,
    ) -> Self {
        stack.0[0] = Pending::ROOT;
        Self { tester: NodeTester::new(nodes, leaves, picture), stack, height: 1, around_last: false }
    }

    /// Visits boxes that reach behind the projection last: in a scene, those are the items that surround the others.
    #[inline(always)]
    pub(super) fn around_last(self) -> Self {
        Self { around_last: true, ..self }
    }

    /// The next leaf that matters, nearest first, with the bits of the blocks that it matters to.
    #[inline(always)]
    pub(super) fn next<S: Simd, F: NodeFilter<S>>(&mut self, simd: S, filter: &F) -> Option<(u32, u32)> {
        let least_closeness = filter.least_closeness();
        while self.height > 0 {
            self.height -= 1;
            let Pending { link, z_most, blocks } = self.stack.0[self.height];
            if z_most < least_closeness {
                continue;
            }
            match WideChild::of(link) {
                WideChild::Inner(index) => {
                    let node = &self.tester.nodes[index as usize];
                    let opened = self.tester.open(simd, node, blocks, filter);
                    self.push(simd, node, &opened);
                }
                WideChild::Block(index) => return Some((index, blocks)),
            }
        }
        None
    }

    /// Pushes the children in order, the nearest on top.
    #[inline(always)]
    fn push<S: Simd>(&mut self, simd: S, node: &WideNode, opened: &Opened) {
        let mut order = opened.z_most;
        if self.around_last {
            let closeness = order.load(simd);
            let surrounding = closeness.simd_eq(splat(simd, f32::INFINITY));
            order.store(select(surrounding, splat(simd, 0.0), closeness));
        }
        let closeness = order.load(simd);
        for lane in each_bit(opened.wanted) {
            let z_most = opened.z_most.0[lane];
            let (own, earlier) = (splat(simd, order.0[lane]), (1 << lane) - 1);
            let below =
                opened.wanted & (bits(closeness.simd_lt(own)) | bits(closeness.simd_eq(own)) & earlier);
            let at = self.height + below.count_ones() as usize;
            let link = node.link(lane);
            self.tester.prefetch(WideChild::of(link));
            self.stack.0[at] = Pending { link, z_most, blocks: opened.blocks.0[lane] };
        }
        self.height += opened.wanted.count_ones() as usize;
    }
}

/// Nodes and leaves that matter to a tile, level by level. Kept from traversal to traversal.
pub(super) struct Frontier {
    /// Indices, with the bits of the blocks that the nodes matter to.
    nodes: Vec<(u32, u32)>,
    pub(super) leaves: Vec<Leaf>,
}

/// A leaf that matters to a tile.
#[derive(Clone, Copy)]
pub(super) struct Leaf {
    pub index: u32,
    /// Bits of the blocks that it matters to.
    pub blocks: u32,
    /// Greatest closeness of its box.
    pub z_most: f32,
}

impl Frontier {
    pub(super) const EMPTY: Frontier = Frontier { nodes: Vec::new(), leaves: Vec::new() };

    /// Finds the leaves of a tree that matter.
    #[inline(always)]
    pub(super) fn find<S: Simd, F: NodeFilter<S>>(
        &mut self,
        simd: S,
        nodes: &[WideNode],
        picture: Picture<'_>,
        filter: &F,
    ) {
        let tester = NodeTester::new(nodes, &[], picture);
        self.leaves.clear();
        self.nodes.clear();
        self.nodes.push((0, ALL_BLOCKS));
        let mut next = 0;
        while next < self.nodes.len() {
            let (index, blocks) = self.nodes[next];
            let node = &nodes[index as usize];
            next += 1;
            let opened = tester.open(simd, node, blocks, filter);
            for lane in each_bit(opened.wanted) {
                match node.child(lane) {
                    WideChild::Inner(index) => {
                        tester.prefetch(WideChild::Inner(index));
                        self.nodes.push((index, opened.blocks.0[lane]));
                    }
                    WideChild::Block(index) => {
                        let (blocks, z_most) = (opened.blocks.0[lane], opened.z_most.0[lane]);
                        self.leaves.push(Leaf { index, blocks, z_most });
                    }
                }
            }
        }
    }
}
