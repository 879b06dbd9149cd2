//! A tree over many lights: one is selected by the light that it can send to a point (Conty Estevez and Kulla, "Importance Sampling of
//! Many Lights with Adaptive Tree Splitting", 2018).
//!
//! Each node has up to sixteen parts, each of which is a light or the lights of another node. A part is selected in proportion to its
//! importance at the point, from the root on, by one number that is rescaled at each node. The importance of a part with a sphere of
//! radius r around its lights, at the distance d, is
//!
//! ```text
//! (s / max(d, r)^2 + c) cos(e) cos(a)
//! ```
//!
//! with the sums s and c of the strengths that fall with the distance and that do not, the smallest angle e that the sphere leaves
//! between the normals of the lights and the way to the point, and the smallest angle a between the way to the lights and the normal of
//! the point. Both angles are bounded by the sphere, so that a light which reaches the point has a probability. Inside of the sphere
//! both cosines are 1.
//!
//! ```text
//!   layout   the lights of each node
//!   bound    spheres, normals and strengths of lights
//!   node     the parts of a node, and their importance
//! ```

mod bound;
mod layout;
mod node;
#[cfg(test)]
mod tests;

use glam::DVec3;

use super::samples::Selected;
use super::{Receivers, Selection};
use crate::simd::{LANES, Lanes, Simd, SimdBase, each_bit, three};
pub(super) use bound::{Bound, Strength};
pub(crate) use layout::Layout;
use node::Node;
pub(crate) use node::{LEAST_COSINE, LEAST_DISTANCE};

/// Least number of lights in a tree: fewer are selected by their power, at less cost. In a room with 12 lamps the error of the tree is
/// a third of that of power, at the same number of samples, each of which takes a fifth longer.
pub(crate) const MIN_LIGHTS: usize = 9;

/// Bits of the index of a part in its node.
const BITS: u32 = LANES.trailing_zeros();

/// A point that gets light, in eye space, with the unit normal of its surface; a normal of 0 is none.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Receiver {
    pub point: [f32; 3],
    pub normal: [f32; 3],
}

/// Lights in a tree.
#[derive(Clone, Debug)]
pub(super) struct LightTree {
    nodes: Vec<Node>,
    /// The parts that lead to each source, four bits a node, the root in the lowest; `None` for sources that are not in the tree.
    trails: Vec<Option<u32>>,
}

impl LightTree {
    /// The tree of the sources with bounds; `count` is the number of all sources, and `reach` the size of the scene. `None` if they are
    /// few, or without strength.
    pub(super) fn new(lights: &[(u32, Bound)], count: usize, reach: f64) -> Option<Self> {
        if lights.len() < MIN_LIGHTS {
            return None;
        }
        let centers: Vec<DVec3> = lights.iter().map(|(_, bound)| bound.center).collect();
        let layout = Layout::new(&centers);
        // Importances are about 1 in the middle of the scene.
        let Strength { inverse_square, constant } = Bound::of_all(lights.iter().map(|(_, b)| b)).strength;
        let scale = 1.0 / (inverse_square / (reach * reach) + constant);
        if !(scale > 0.0 && scale.is_finite()) {
            return None;
        }
        let mut trails = vec![None; count];
        let mut before = vec![(0_u32, 0_u32); layout.nodes.len()];
        let mut nodes = Vec::with_capacity(layout.nodes.len());
        for (index, parts) in layout.nodes.iter().enumerate() {
            let (trail, depth) = before[index];
            let mut node = Node::new(reach * LEAST_DISTANCE);
            for (slot, part) in parts.iter().enumerate() {
                let members = &layout.order[part.lights.clone()];
                let bound = Bound::of_all(members.iter().map(|&light| &lights[light as usize].1));
                let trail = trail | (slot as u32) << (BITS * depth);
                if let Some(child) = part.node {
                    before[child as usize] = (trail, depth + 1);
                    node.set(slot, &bound, scale, child, true);
                } else if let Some(&light) = members.first() {
                    let (source, bound) = &lights[light as usize];
                    node.set(slot, bound, scale, *source, false);
                    trails[*source as usize] = Some(trail);
                }
            }
            nodes.push(node);
        }
        Some(Self { nodes, trails })
    }

    /// Selects a source for each point, by a number in [0, 1) per point. A point that no source can reach selects none. The bounds of a
    /// node are wider than those of its parts, so a number may also lead to a node with no source that can reach the point.
    /// Such a number selects none.
    #[inline(never)]
    pub(super) fn select<S: Simd>(
        &self,
        simd: S,
        receivers: &Receivers<S>,
        selection: Selection,
        numbers: &[f32; LANES],
        lanes: u32,
    ) -> Selected {
        simd.vectorize(
            #[inline(always)]
            || {
                let points = three!(axis => receivers.points.0[axis].to_array());
                let normals = three!(axis => receivers.normals.0[axis].to_array());
                let mut selected = Selected::none();
                for lane in each_bit(lanes) {
                    let receiver = Receiver {
                        point: three!(axis => points[axis][lane]),
                        normal: three!(axis => normals[axis][lane]),
                    };
                    if let Some((source, probability)) =
                        self.select_one(simd, &receiver, selection, numbers[lane])
                    {
                        selected.set(lane, source, probability);
                    }
                }
                selected
            },
        )
    }

    /// The source that a point selects by a number in [0, 1), and its probability; `None` as of [`LightTree::select`].
    #[inline(always)]
    fn select_one<S: Simd>(
        &self,
        simd: S,
        receiver: &Receiver,
        selection: Selection,
        mut number: f32,
    ) -> Option<(u32, f32)> {
        let mut probability = 1.0;
        let mut index = 0;
        loop {
            let node = &self.nodes[index as usize];
            let weights = node.importance(simd, receiver, selection);
            let found = Share::select(&weights, number)?;
            probability *= found.probability;
            number = found.rest;
            index = node.child[found.slot];
            if !node.is_inner(found.slot) {
                return Some((index, probability));
            }
        }
    }

    /// The probabilities with which points select sources, in some lanes: 0 for sources that are not in the tree.
    #[inline(never)]
    pub(super) fn probabilities<S: Simd>(
        &self,
        simd: S,
        selection: Selection,
        sources: &[u32; LANES],
        receivers: &dyn Fn(usize) -> Receiver,
        lanes: u32,
    ) -> Lanes {
        simd.vectorize(
            #[inline(always)]
            || {
                let mut probabilities = Lanes::ZERO;
                for lane in each_bit(lanes) {
                    probabilities.0[lane] =
                        self.probability(simd, &receivers(lane), selection, sources[lane]);
                }
                probabilities
            },
        )
    }

    /// The probability with which a point selects a source.
    #[inline(always)]
    fn probability<S: Simd>(&self, simd: S, receiver: &Receiver, selection: Selection, source: u32) -> f32 {
        let Some(mut trail) = self.trails.get(source as usize).copied().flatten() else { return 0.0 };
        let mut probability = 1.0;
        let mut index = 0;
        loop {
            let node = &self.nodes[index as usize];
            let weights = node.importance(simd, receiver, selection);
            let slot = trail as usize % LANES;
            probability *= Share::of(&weights, slot);
            if !node.is_inner(slot) || probability == 0.0 {
                return probability;
            }
            trail >>= BITS;
            index = node.child[slot];
        }
    }
}

/// A part that is selected in proportion to weights.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Share {
    slot: usize,
    probability: f32,
    /// Where the number was in the share of the part, in [0, 1).
    rest: f32,
}

impl Share {
    /// The part of a number in [0, 1); `None` if no part has a weight.
    #[inline(always)]
    fn select(weights: &[f32; LANES], number: f32) -> Option<Self> {
        let ends = ends(weights);
        let total = ends[LANES - 1];
        if !(total > 0.0) {
            return None;
        }
        let target = number * total;
        let within = ends.iter().filter(|&&end| end <= target).count();
        // Rounding: the product may be the total.
        let slot = if within < LANES { within } else { weights.iter().rposition(|&weight| weight > 0.0)? };
        let start = if slot == 0 { 0.0 } else { ends[slot - 1] };
        let weight = weights[slot];
        let rest = ((target - start) / weight).clamp(0.0, 1.0 - f32::EPSILON / 2.0);
        Some(Self { slot, probability: weight / total, rest })
    }

    /// Probability of a part.
    #[inline(always)]
    fn of(weights: &[f32; LANES], slot: usize) -> f32 {
        if weights[slot] > 0.0 { weights[slot] / ends(weights)[LANES - 1] } else { 0.0 }
    }
}

/// Sums of weights up to each part, in their order.
#[inline(always)]
fn ends(weights: &[f32; LANES]) -> [f32; LANES] {
    let mut sum = 0.0;
    let mut ends = [0.0; LANES];
    for (end, weight) in ends.iter_mut().zip(weights) {
        sum += weight;
        *end = sum;
    }
    ends
}
