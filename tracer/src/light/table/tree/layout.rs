//! Layout of a light tree: the lights of each node.

use std::ops::Range;

use glam::DVec3;

use crate::simd::LANES;

/// Nodes of up to sixteen parts, over lights that are numbered from 0.
#[derive(Clone, Debug, Default)]
pub(crate) struct Layout {
    /// The lights, so that those of each part are neighbours.
    pub order: Vec<u32>,
    /// The parts of each node; node 0 is the root.
    pub nodes: Vec<Vec<Part>>,
}

/// One light, or the lights of another node.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Part {
    /// Where the lights are in [`Layout::order`].
    pub lights: Range<usize>,
    /// The node of these lights; `None` for one light.
    pub node: Option<u32>,
}

impl Layout {
    /// Divides lights by their centres. The largest part of a node is halved, across the axis along which its centres are farthest
    /// apart, until there are sixteen parts. Lights with the same coordinate are divided by their numbers: the layout depends on
    /// nothing but the centres.
    pub(crate) fn new(centers: &[DVec3]) -> Self {
        let mut layout = Self { order: (0..centers.len() as u32).collect(), nodes: Vec::new() };
        let all = 0..centers.len();
        let mut waiting = vec![all];
        // Nodes are numbered in the order in which they wait.
        let mut next = 0;
        while next < waiting.len() {
            let parts = layout.divide(waiting[next].clone(), centers);
            let parts = parts.into_iter().map(|lights| {
                let node = (lights.len() > 1).then(|| {
                    waiting.push(lights.clone());
                    waiting.len() as u32 - 1
                });
                Part { lights, node }
            });
            layout.nodes.push(parts.collect());
            next += 1;
        }
        layout
    }

    fn divide(&mut self, lights: Range<usize>, centers: &[DVec3]) -> Vec<Range<usize>> {
        let mut parts = vec![lights];
        while parts.len() < LANES {
            // The first one of the largest parts.
            let largest = (0..parts.len()).rev().max_by_key(|&part| parts[part].len()).unwrap_or(0);
            let Range { start, end } = parts[largest];
            if end - start < 2 {
                break;
            }
            let middle = start + (end - start) / 2;
            let axis = widest_axis(&self.order[start..end], centers);
            self.order[start..end].select_nth_unstable_by(middle - start, |&a, &b| {
                let along = |light: u32| centers[light as usize][axis];
                along(a).total_cmp(&along(b)).then(a.cmp(&b))
            });
            parts[largest] = start..middle;
            parts.insert(largest + 1, middle..end);
        }
        parts
    }
}

/// The axis along which centres are farthest apart; the first of equal ones.
fn widest_axis(lights: &[u32], centers: &[DVec3]) -> usize {
    let all = || lights.iter().map(|&light| centers[light as usize]);
    let lo = all().reduce(DVec3::min).unwrap_or(DVec3::ZERO);
    let hi = all().reduce(DVec3::max).unwrap_or(DVec3::ZERO);
    let size = hi - lo;
    (1..3).fold(0, |widest, axis| if size[axis] > size[widest] { axis } else { widest })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn assert_covers(layout: &Layout, count: usize) {
        let mut sorted = layout.order.clone();
        sorted.sort_unstable();
        assert!(sorted.iter().copied().eq(0..count as u32));
        let mut expected = vec![None; layout.nodes.len()];
        expected[0] = Some(0..count);
        for (index, parts) in layout.nodes.iter().enumerate() {
            let lights = expected[index].clone().unwrap();
            assert!((1..=LANES).contains(&parts.len()));
            assert_eq!(
                (parts[0].lights.start, parts[parts.len() - 1].lights.end),
                (lights.start, lights.end)
            );
            assert!(parts.windows(2).all(|two| two[0].lights.end == two[1].lights.start));
            for part in parts {
                assert_eq!(part.lights.len() > 1, part.node.is_some());
                if let Some(node) = part.node {
                    assert!(node as usize > index && expected[node as usize].is_none());
                    expected[node as usize] = Some(part.lights.clone());
                }
            }
            let sizes = || parts.iter().map(|part| part.lights.len());
            assert!(sizes().max().unwrap() <= 2 * sizes().min().unwrap());
        }
    }

    #[test]
    fn equal_centers_are_divided_as_evenly_as_others() {
        for count in [1, 2, 16, 17, 33, 500, 5000] {
            assert_covers(&Layout::new(&vec![DVec3::ONE; count]), count);
        }
    }

    #[test]
    fn lights_on_a_line_are_divided_along_it() {
        let layout =
            Layout::new(&(0..64).map(|i| DVec3::new(0.0, f64::from(63 - i), 0.0)).collect::<Vec<_>>());
        assert!(layout.order.iter().copied().eq((0..64).rev()));
        assert_eq!(layout.nodes.len(), 17);
    }

    proptest! {
        #[test]
        fn every_light_is_in_one_part_of_each_level(
            centers in prop::collection::vec(prop::array::uniform3(-3_i8..3), 1..300),
        ) {
            let centers: Vec<DVec3> = centers.iter().map(|c| DVec3::from_array(c.map(f64::from))).collect();
            assert_covers(&Layout::new(&centers), centers.len());
        }
    }
}
