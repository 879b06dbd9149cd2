//! Clustering of boxes that merge in rounds until one is left: PLOC (Meister and Bittner 2018).
//!
//! In a round each cluster chooses, among its neighbours along a Morton curve, the one whose union with it has the
//! smallest surface area. Two clusters that choose each other merge. Of boxes at random places more than half do, so
//! that a few rounds are enough. Of evenly spaced boxes (all choices of a cluster cost the same), rows with growing
//! gaps, and nested boxes only one pair may agree, and there would be as many rounds as boxes. Therefore, in a round
//! with fewer than one pair for [`SLOW`] clusters, choices that are not mutual count as well, and the remaining
//! clusters are paired in their order. A round leaves at most 15 of 16 clusters, so all rounds together take O(n).

use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, node::Bvh2Node};
use obvhs::ploc::morton::{morton_encode_u64_unorm, morton_encode_u128_unorm};
use rayon::prelude::*;

use super::divide::Bounds;
use crate::cancel::{Cancelled, IsCancelled, go_on};

/// Number of clusters per pair below which a round is slow.
const SLOW: usize = 16;

/// Largest cost of a choice that is not mutual, in multiples of the other cluster's own choice. It keeps a large
/// triangle from merging with a small one that has better neighbours.
const DEAR: f32 = 4.0;

/// Clusters per task of a round.
const CHUNK: usize = 4096;

/// Marks a cluster without a partner.
const ALONE: u32 = u32::MAX;

/// Parameters of clustering.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clustering {
    /// Neighbours on each side among which a cluster chooses.
    pub reach: usize,
    /// Number of first rounds with one neighbour on each side.
    pub short_rounds: u32,
    /// Whether positions on the curve have 42 bits per axis in place of 21.
    pub fine_order: bool,
}

/// Work of clustering, for tests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Work {
    /// Number of rounds.
    pub rounds: u32,
    /// Clusters at the beginnings of all rounds.
    pub clusters: u64,
}

impl Clustering {
    /// A binary tree over boxes (at least one, all finite), with one box per leaf.
    ///
    /// # Errors
    /// [`Cancelled`]: `cancelled` is polled before each round.
    pub(super) fn of(self, boxes: &[Bounds], cancelled: &IsCancelled<'_>) -> Result<(Bvh2, Work), Cancelled> {
        let mut tree = Bvh2::zeroed(boxes.len());
        tree.primitive_indices = (0..boxes.len() as u32).collect();
        let mut clusters = leaves_in_order(boxes, self.fine_order);
        let mut merged = Vec::with_capacity(clusters.len());
        let mut room = Choices::default();
        let (mut work, mut free) = (Work::default(), tree.nodes.len());
        while clusters.len() > 1 {
            go_on(cancelled)?;
            let reach = if work.rounds < self.short_rounds { 1 } else { self.reach };
            let partners = room.partners(&clusters, reach);
            work.rounds += 1;
            work.clusters += clusters.len() as u64;
            merged.clear();
            for (index, &partner) in partners.iter().enumerate() {
                let partner = partner as usize;
                if partner == ALONE as usize {
                    merged.push(clusters[index]);
                } else if partner < index {
                    // Children are stored behind their parents, which are prepended in later rounds.
                    free -= 2;
                    tree.nodes[free] = clusters[index];
                    tree.nodes[free + 1] = clusters[partner];
                    let around = clusters[index].aabb().union(clusters[partner].aabb());
                    merged.push(Bvh2Node::new(around, 0, free as u32));
                }
            }
            std::mem::swap(&mut clusters, &mut merged);
        }
        tree.nodes[0] = clusters[0];
        Ok((tree, work))
    }
}

/// A leaf for each box, along the curve. Leaves at one position keep the order of the boxes.
fn leaves_in_order(boxes: &[Bounds], fine: bool) -> Vec<Bvh2Node> {
    let all = boxes.iter().fold(Aabb::empty(), |mut all, &(lo, hi)| {
        all.extend(lo.into());
        all.extend(hi.into());
        all
    });
    let scale = 1.0 / all.diagonal().as_dvec3();
    let offset = -all.min.as_dvec3() * scale;
    let aabb = |index: u32| {
        let (lo, hi) = boxes[index as usize];
        Aabb { min: lo.into(), max: hi.into() }
    };
    // NaN where all boxes are in one plane; converted to zero there.
    let place = |index: u32| aabb(index).center().as_dvec3() * scale + offset;
    let order = if fine {
        in_order(boxes.len(), |index| morton_encode_u128_unorm(place(index)))
    } else {
        in_order(boxes.len(), |index| morton_encode_u64_unorm(place(index)))
    };
    order.into_par_iter().map(|index| Bvh2Node::new(aabb(index), 1, index)).collect()
}

fn in_order<K: Ord + Copy + Send>(count: usize, key: impl Fn(u32) -> K + Sync) -> Vec<u32> {
    let mut keys: Vec<(K, u32)> =
        (0..count as u32).into_par_iter().map(|index| (key(index), index)).collect();
    keys.par_sort_unstable();
    keys.into_iter().map(|(_, index)| index).collect()
}

/// Choices of all clusters; the buffers are reused in all rounds.
#[derive(Default)]
struct Choices {
    chosen: Vec<u32>,
    costs: Vec<f32>,
    partners: Vec<u32>,
}

impl Choices {
    /// The partner of each cluster, or [`ALONE`]. Of several clusters at least two get partners.
    fn partners(&mut self, clusters: &[Bvh2Node], reach: usize) -> &[u32] {
        let count = clusters.len();
        self.chosen.resize(count, ALONE);
        self.costs.resize(count, f32::INFINITY);
        let chunks = self.chosen.par_chunks_mut(CHUNK).zip(self.costs.par_chunks_mut(CHUNK));
        chunks.enumerate().for_each(|(chunk, (chosen, costs))| {
            choose(clusters, reach, chunk * CHUNK, chosen, costs);
        });
        self.partners.clear();
        self.partners.resize(count, ALONE);
        let mut pairs = 0;
        for index in 0..count {
            let other = self.chosen[index] as usize;
            if other < index && self.chosen[other] as usize == index {
                pairs += self.pair(index, other);
            }
        }
        if pairs * SLOW < count {
            for index in 0..count {
                let other = self.chosen[index] as usize;
                if self.costs.get(other).is_some_and(|&cost| self.costs[index] <= DEAR * cost) {
                    pairs += self.pair(index, other);
                }
            }
        }
        if pairs * SLOW < count {
            let mut single = None;
            for index in 0..count {
                if self.partners[index] == ALONE {
                    single = match single {
                        Some(before) => {
                            self.pair(index, before);
                            None
                        }
                        None => Some(index),
                    };
                }
            }
        }
        &self.partners
    }

    /// Pairs two clusters if neither has a partner. Returns the number of new pairs.
    fn pair(&mut self, a: usize, b: usize) -> usize {
        let free = |cluster: usize| self.partners.get(cluster) == Some(&ALONE);
        if a == b || !free(a) || !free(b) {
            return 0;
        }
        (self.partners[a], self.partners[b]) = (b as u32, a as u32);
        1
    }
}

/// Choices of the clusters from `first` on: the last one of those with the smallest union.
fn choose(clusters: &[Bvh2Node], reach: usize, first: usize, chosen: &mut [u32], costs: &mut [f32]) {
    costs.fill(f32::INFINITY);
    chosen.fill(ALONE);
    let end = first + chosen.len();
    // Each pair is computed once, or twice where it spans two chunks.
    for index in first.saturating_sub(reach)..end {
        let own = clusters[index].aabb();
        let last = (index + reach + 1).min(clusters.len());
        let mut best = match index.checked_sub(first) {
            Some(at) => (costs[at], chosen[at]),
            None => (f32::INFINITY, ALONE),
        };
        for other in (index + 1).max(first)..last {
            let cost = own.union(clusters[other].aabb()).half_area();
            if cost <= best.0 {
                best = (cost, other as u32);
            }
            if other < end && cost <= costs[other - first] {
                (costs[other - first], chosen[other - first]) = (cost, index as u32);
            }
        }
        if let Some(at) = index.checked_sub(first) {
            (costs[at], chosen[at]) = best;
        }
    }
}
