//! The faces around one position, divided into fans of smoothly connected faces.

use glam::{DVec3, Vec3};

/// Largest number of faces at an edge over which faces are smooth. An edge of more is a crease: nothing defines which
/// of them belong together, and all pairs of thousands would take too long.
const MOST_AT_AN_EDGE: usize = 8;

/// A corner of a face.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Entry {
    pub(super) triangle: u32,
    pub(super) corner: u8,
}

/// Averaged normals at one position.
pub(super) struct Fans {
    /// Unit normals, in the order of their first corners.
    pub(super) normals: Vec<Vec3>,
    /// Index of the normal of each corner.
    pub(super) of_entries: Vec<u32>,
}

/// Averages normals over the corners at one position.
///
/// `neighbours` are the positions at the other ends of a corner's two edges: the next one in the order of the face,
/// and the previous one. `is_smooth` is called for pairs of corners that share an edge, with `true` where their faces
/// have opposite windings: some files have inverted faces.
pub(super) fn around(
    entries: &[Entry],
    neighbours: impl Fn(&Entry) -> [u32; 2],
    is_smooth: impl Fn(&Entry, &Entry, bool) -> bool,
    weight: impl Fn(&Entry) -> DVec3,
) -> Fans {
    let mut sides = Sides::new(entries.len());
    // Half edges: the position at the other end, the corner, and whether the edge leads there in the order of its
    // face.
    let mut edges: Vec<(u32, u32, bool)> = Vec::with_capacity(2 * entries.len());
    for (number, entry) in (0_u32..).zip(entries) {
        let [to, from] = neighbours(entry);
        edges.extend([(to, number, true), (from, number, false)]);
    }
    edges.sort_unstable();
    for edge in edges.chunk_by(|a, b| a.0 == b.0).filter(|edge| edge.len() <= MOST_AT_AN_EDGE) {
        for (i, &(_, a, a_leads)) in edge.iter().enumerate() {
            for &(_, b, b_leads) in edge.iter().skip(i + 1) {
                // Two adjacent faces of equal winding run through the edge in opposite directions. Where there are
                // more than two, a face of the other winding belongs to the other side of a surface.
                let turned = a_leads == b_leads;
                if turned && edge.len() > 2 {
                    continue;
                }
                if is_smooth(&entries[a as usize], &entries[b as usize], turned) {
                    sides.join(a, b, turned);
                }
            }
        }
    }
    sides.normals(entries, weight)
}

/// Disjoint sets of corners, each with the same winding as the first one of its set or with the opposite one.
struct Sides {
    /// The parent of each corner, and whether its winding is opposite to the parent's.
    leaders: Vec<(u32, bool)>,
}

impl Sides {
    fn new(count: usize) -> Self {
        Self { leaders: (0..count as u32).map(|corner| (corner, false)).collect() }
    }

    /// The first corner of the set, and whether the winding of this one is opposite.
    fn first(&mut self, corner: u32) -> (u32, bool) {
        let (mut at, mut turned) = (corner, false);
        loop {
            let (leader, is_turned) = self.leaders[at as usize];
            if leader == at {
                return (at, turned);
            }
            // Path halving.
            let (above, above_turned) = self.leaders[leader as usize];
            self.leaders[at as usize] = (above, is_turned ^ above_turned);
            turned ^= is_turned ^ above_turned;
            at = above;
        }
    }

    fn join(&mut self, a: u32, b: u32, turned: bool) {
        let ((a, a_turned), (b, b_turned)) = (self.first(a), self.first(b));
        // The earlier one becomes the parent.
        let (leader, follower) = (a.min(b), a.max(b));
        if leader != follower {
            self.leaders[follower as usize] = (leader, turned ^ a_turned ^ b_turned);
        }
    }

    fn normals(&mut self, entries: &[Entry], weight: impl Fn(&Entry) -> DVec3) -> Fans {
        let mut sums = vec![DVec3::ZERO; entries.len()];
        for (number, entry) in (0_u32..).zip(entries) {
            let (first, turned) = self.first(number);
            let weight = weight(entry);
            sums[first as usize] += if turned { -weight } else { weight };
        }
        let mut fans = Fans { normals: Vec::new(), of_entries: Vec::with_capacity(entries.len()) };
        // The normal of each side of each set, once it is computed.
        let mut numbers = vec![[None; 2]; entries.len()];
        for (number, entry) in (0_u32..).zip(entries) {
            let (first, turned) = self.first(number);
            let fan = *numbers[first as usize][usize::from(turned)].get_or_insert_with(|| {
                let sum = sums[first as usize].try_normalize().unwrap_or_else(|| {
                    let own = weight(entry).normalize_or_zero();
                    if turned { -own } else { own }
                });
                fans.normals.push(if turned { -sum } else { sum }.as_vec3());
                fans.normals.len() as u32 - 1
            });
            fans.of_entries.push(fan);
        }
        fans
    }
}
