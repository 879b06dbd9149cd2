//! Clusters of boxes that merge round by round until one is left: PLOC (Meister and Bittner 2018).
//!
//! In a round each cluster chooses, of its neighbours along a Morton curve, the one with which it shares the smallest
//! box. Two clusters that choose each other merge: of boxes at random places more than half do, so that a few rounds
//! are enough. Of evenly spaced boxes (all choices of a cluster cost the same), of rows whose gaps grow, and of boxes
//! inside each other only one pair may agree, and there would be as many rounds as boxes. In a round with fewer than
//! one pair for [`SLOW`] clusters, choices that are not returned therefore count as well, and then clusters that are
//! left are paired by their order. A round leaves at most 15 clusters of 16, so all of them together take O(n).

use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, node::Bvh2Node};
use obvhs::ploc::morton::{morton_encode_u64_unorm, morton_encode_u128_unorm};
use rayon::prelude::*;

use super::divide::Bounds;
use crate::cancel::{Cancelled, IsCancelled, go_on};

/// A round is slow when it would merge fewer than one pair for this number of clusters.
const SLOW: usize = 16;

/// A choice that is not returned counts where it costs at most this many times as much as the other cluster's own: a
/// large triangle does not get a small one that has better neighbours.
const DEAR: f32 = 4.0;

/// Clusters that one task of a round looks at.
const CHUNK: usize = 4096;

/// Marks a cluster without a partner.
const ALONE: u32 = u32::MAX;

/// How boxes are clustered.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clustering {
    /// Neighbours on each side that a cluster chooses from.
    pub reach: usize,
    /// The first rounds, in which it chooses from one on each side.
    pub short_rounds: u32,
    /// Whether places on the curve have 42 bits for each axis instead of 21.
    pub fine_order: bool,
}

/// What clustering took: figures for tests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Work {
    /// Rounds.
    pub rounds: u32,
    /// Clusters that rounds began with, in all.
    pub clusters: u64,
}

impl Clustering {
    /// A binary tree over boxes (at least one, all finite), with a box in each leaf.
    ///
    /// # Errors
    /// [`Cancelled`]: the question is asked before each round.
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
                    // Children are behind their parents, which are put in front of them later.
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

/// A leaf for each box, along the curve; leaves in one place keep the order of the boxes.
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
    // Where all is flat it is NaN, which becomes zero there.
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

/// What clusters choose; kept from round to round.
#[derive(Default)]
struct Choices {
    chosen: Vec<u32>,
    costs: Vec<f32>,
    partners: Vec<u32>,
}

impl Choices {
    /// For each cluster the one that it merges with, or [`ALONE`]. Of more than one cluster, some merge.
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

    /// Pairs two clusters where both are free; how many pairs that is.
    fn pair(&mut self, a: usize, b: usize) -> usize {
        let free = |cluster: usize| self.partners.get(cluster) == Some(&ALONE);
        if a == b || !free(a) || !free(b) {
            return 0;
        }
        (self.partners[a], self.partners[b]) = (b as u32, a as u32);
        1
    }
}

/// Chooses for the clusters from `first` on: of those with the smallest box in common the last.
fn choose(clusters: &[Bvh2Node], reach: usize, first: usize, chosen: &mut [u32], costs: &mut [f32]) {
    costs.fill(f32::INFINITY);
    chosen.fill(ALONE);
    let end = first + chosen.len();
    // Each pair is looked at once, or twice where it is in two chunks.
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
