//! A tile against a tree: that of the scene, over its items, or that of a mesh, over blocks of triangles.
//!
//! [`Walk`] hands out leaves nearest first, so that what is found hides what comes later. [`Frontier`] finds them all,
//! level by level: nodes of one level do not wait for each other, which suits a question that any triangle answers.

use super::around::{Around, Row, in_sight};
use super::lens::{Frustum, Lens};
use super::{ALL_BLOCKS, Rays};
use crate::bvh::{MAX_WIDE_DEPTH, WIDTH, WideChild, WideNode};
use crate::mesh::TriangleBlock;
use crate::simd::{Indices, Lanes, Simd, SimdBase, bits, each_bit, prefetch, select, splat};

/// What a walk is for: whether a box is worth opening.
pub(super) trait Interest<S: Simd> {
    /// Whether rays stand on a grid with step 1, so that what lies between them can be left out.
    const ON_GRID: bool;

    /// What must be at least how close to matter to each block of rays; infinity where nothing matters any more.
    fn least(&self) -> &Lanes;

    /// The least of these.
    fn least_closeness(&self) -> f32;

    /// Looks closer at a box within this rectangle of the picture (x from and to, y from and to), nowhere closer than
    /// `z_most`: which of `blocks`, whose rectangles it overlaps, do want it.
    fn refine(&self, simd: S, around: [f32; 4], z_most: f32, blocks: u32) -> u32;
}

/// Blocks with a ray that something of this closeness still matters to.
#[inline(always)]
pub(super) fn open_blocks<S: Simd>(simd: S, least: &Lanes, z_most: f32) -> u32 {
    bits(least.load(simd).simd_le(splat(simd, z_most)))
}

/// A child that a walk has yet to visit.
#[derive(Clone, Copy)]
struct Pending {
    /// See [`WideChild::of`].
    link: u32,
    z_most: f32,
    /// Blocks that want it.
    blocks: u32,
}

impl Pending {
    const ROOT: Pending = Pending { link: 0, z_most: f32::INFINITY, blocks: ALL_BLOCKS };
}

/// Room for the children that a walk has yet to visit. Kept from walk to walk: nobody need clear it.
pub(crate) struct WalkStack([Pending; MAX_WIDE_DEPTH * (WIDTH - 1) + 1]);

impl WalkStack {
    pub(crate) const EMPTY: WalkStack = WalkStack([Pending::ROOT; MAX_WIDE_DEPTH * (WIDTH - 1) + 1]);
}

/// The nodes of a tree as a tile sees them.
struct Sight<'a> {
    nodes: &'a [WideNode],
    /// What stands in the leaves, to be asked of memory in time; empty where that is not known.
    leaves: &'a [TriangleBlock],
    lens: &'a Lens,
    rows: [Row; 3],
    rays: &'a Rays,
}

/// Children of a node that are wanted.
struct Opened {
    /// Their bits.
    wanted: u32,
    /// Which blocks of rays want each.
    blocks: Indices,
    /// No point of each is closer.
    z_most: Lanes,
}

impl<'a> Sight<'a> {
    #[inline(always)]
    fn new(nodes: &'a [WideNode], leaves: &'a [TriangleBlock], lens: &'a Lens, rays: &'a Rays) -> Self {
        let [a, b, g] = lens.rows;
        Self { nodes, leaves, lens, rows: [Row::new(a), Row::new(b), Row::new(g)], rays }
    }

    /// Memory takes some hundred cycles, and a node less: what will be visited is asked for when it is found.
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

    /// Opens a node that some blocks want. A function of its own on each level: inlined wherever it is needed, it would fill
    /// the instruction cache.
    #[inline(never)]
    fn open<S: Simd, I: Interest<S>>(&self, simd: S, node: &WideNode, blocks: u32, interest: &I) -> Opened {
        simd.vectorize(
            #[inline(always)]
            || self.open_here(simd, node, blocks, interest),
        )
    }

    #[inline(always)]
    fn open_here<S: Simd, I: Interest<S>>(
        &self,
        simd: S,
        node: &WideNode,
        blocks: u32,
        interest: &I,
    ) -> Opened {
        let around = Around::new(simd, node, self.lens, &self.rows);
        let near_enough = around.z_most.load(simd).simd_ge(splat(simd, interest.least_closeness()));
        let mut wanted = node.present() & bits(near_enough);
        let crossing = wanted & around.crossing;
        if crossing != 0 {
            // A box that reaches behind the lens has no rectangle around it.
            wanted &= !crossing | in_sight(simd, node, &Frustum::new(self.lens, self.rays.union));
        }
        wanted &= crossing | around.overlapping::<S, I>(simd, self.rays.union);
        let least = interest.least();
        let few = wanted.count_ones() <= blocks.count_ones();
        let mut by_block =
            if few { Indices::ZERO } else { around.blocks_of_all(simd, self.rays, least, blocks) };
        for lane in each_bit(wanted) {
            if crossing >> lane & 1 == 1 {
                by_block.0[lane] = ALL_BLOCKS;
                continue;
            }
            if few {
                by_block.0[lane] = around.blocks_of(simd, lane, self.rays, least, blocks);
            }
            let (rectangle, z_most) = around.get(lane);
            by_block.0[lane] = interest.refine(simd, rectangle, z_most, by_block.0[lane]);
            wanted &= !(u32::from(by_block.0[lane] == 0) << lane);
        }
        Opened { wanted, blocks: by_block, z_most: around.z_most }
    }
}

/// A walk under way, nearest first.
pub(super) struct Walk<'a> {
    sight: Sight<'a>,
    stack: &'a mut WalkStack,
    height: usize,
    /// What reaches behind the lens comes last, not first.
    around_last: bool,
}

impl<'a> Walk<'a> {
    #[inline(always)]
    pub(super) fn new(
        nodes: &'a [WideNode],
        leaves: &'a [TriangleBlock],
        lens: &'a Lens,
        rays: &'a Rays,
        stack: &'a mut WalkStack,
    ) -> Self {
        stack.0[0] = Pending::ROOT;
        Self { sight: Sight::new(nodes, leaves, lens, rays), stack, height: 1, around_last: false }
    }

    /// Visits what reaches behind the lens last: among the items of a scene it is what surrounds the others.
    #[inline(always)]
    pub(super) fn around_last(self) -> Self {
        Self { around_last: true, ..self }
    }

    /// The next leaf whose box stands in the tile, near enough and wanted, and by which blocks; nearer ones earlier.
    #[inline(always)]
    pub(super) fn next<S: Simd, I: Interest<S>>(&mut self, simd: S, interest: &I) -> Option<(u32, u32)> {
        let least_closeness = interest.least_closeness();
        while self.height > 0 {
            self.height -= 1;
            let Pending { link, z_most, blocks } = self.stack.0[self.height];
            if z_most < least_closeness {
                continue;
            }
            match WideChild::of(link) {
                WideChild::Inner(index) => {
                    let node = &self.sight.nodes[index as usize];
                    let opened = self.sight.open(simd, node, blocks, interest);
                    self.push(simd, node, &opened);
                }
                WideChild::Block(index) => return Some((index, blocks)),
            }
        }
        None
    }

    /// Each to its rank, so that the nearest ends on top.
    #[inline(always)]
    fn push<S: Simd>(&mut self, simd: S, node: &WideNode, opened: &Opened) {
        let mut order = opened.z_most;
        if self.around_last {
            let closeness = order.load(simd);
            let around = closeness.simd_eq(splat(simd, f32::INFINITY));
            order.store(select(around, splat(simd, 0.0), closeness));
        }
        let closeness = order.load(simd);
        for lane in each_bit(opened.wanted) {
            let z_most = opened.z_most.0[lane];
            let (own, earlier) = (splat(simd, order.0[lane]), (1 << lane) - 1);
            let below =
                opened.wanted & (bits(closeness.simd_lt(own)) | bits(closeness.simd_eq(own)) & earlier);
            let at = self.height + below.count_ones() as usize;
            let link = node.link(lane);
            self.sight.prefetch(WideChild::of(link));
            self.stack.0[at] = Pending { link, z_most, blocks: opened.blocks.0[lane] };
        }
        self.height += opened.wanted.count_ones() as usize;
    }
}

/// Nodes and leaves that a tile may want, level by level. Kept from walk to walk.
pub(crate) struct Frontier {
    /// And the blocks that want them.
    nodes: Vec<(u32, u32)>,
    pub(super) leaves: Vec<Leaf>,
}

/// A leaf that a tile wants.
#[derive(Clone, Copy)]
pub(super) struct Leaf {
    pub index: u32,
    /// Which blocks of rays want it.
    pub blocks: u32,
    /// No point of it is closer.
    pub z_most: f32,
}

impl Frontier {
    pub(crate) const EMPTY: Frontier = Frontier { nodes: Vec::new(), leaves: Vec::new() };

    /// Finds the leaves of a tree whose boxes stand in the tile, near enough and wanted.
    #[inline(always)]
    pub(super) fn find<S: Simd, I: Interest<S>>(
        &mut self,
        simd: S,
        nodes: &[WideNode],
        lens: &Lens,
        rays: &Rays,
        interest: &I,
    ) {
        let sight = Sight::new(nodes, &[], lens, rays);
        self.leaves.clear();
        self.nodes.clear();
        self.nodes.push((0, ALL_BLOCKS));
        let mut next = 0;
        while next < self.nodes.len() {
            let (index, blocks) = self.nodes[next];
            let node = &nodes[index as usize];
            next += 1;
            let opened = sight.open(simd, node, blocks, interest);
            for lane in each_bit(opened.wanted) {
                match node.child(lane) {
                    WideChild::Inner(index) => {
                        sight.prefetch(WideChild::Inner(index));
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
