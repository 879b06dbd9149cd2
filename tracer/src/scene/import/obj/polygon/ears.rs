//! Ear clipping: in each round, triangles of three adjacent corners that are inside of the outline are cut off. A
//! round cuts off every second corner at most, which distributes slivers over the corners.

use glam::DVec2;

use super::grid::Grid;
use super::{halve, turn};

/// Corners and cells that may be examined per corner of the polygon, before the rest is cut without tests.
const WORK_PER_CORNER: u64 = 2000;

/// Conditions for cutting off a triangle, from strict to none; the next one applies when no ear is left.
#[derive(Clone, Copy, PartialEq)]
enum Demand {
    /// It has an area, the outline does not touch it from inside, and its neighbours are outside.
    Clean,
    /// The outline may touch it, and it may have no area.
    Touching,
    /// The outline may cross it.
    Crossed,
    /// None: the orientation of the polygon is wrong.
    Any,
}

impl Demand {
    fn next(self) -> Self {
        match self {
            Self::Clean => Self::Touching,
            Self::Touching => Self::Crossed,
            Self::Crossed | Self::Any => Self::Any,
        }
    }
}

/// A polygon whose ears are clipped.
pub(super) struct Ears<'p> {
    points: &'p [DVec2],
    next: Vec<u32>,
    previous: Vec<u32>,
    /// Whether each corner is reflex: only reflex corners can be inside of an ear.
    reflex: Vec<bool>,
    /// Reflex corners in a grid.
    grid: Grid,
    /// Whether a neighbour of each corner was cut off in this round.
    is_touched: Vec<bool>,
    remaining: usize,
    /// A corner that is not cut off.
    start: u32,
    work: u64,
    most_work: u64,
}

impl<'p> Ears<'p> {
    /// The polygon with the corners of `ring`, counterclockwise.
    pub(super) fn new(points: &'p [DVec2], ring: &[u32]) -> Self {
        let mut next: Vec<u32> = (0..points.len() as u32).collect();
        let mut previous = next.clone();
        for (&corner, &after) in ring.iter().zip(ring.iter().cycle().skip(1)) {
            next[corner as usize] = after;
            previous[after as usize] = corner;
        }
        let mut ears = Self {
            points,
            next,
            previous,
            reflex: vec![false; points.len()],
            grid: Grid::default(),
            is_touched: vec![false; points.len()],
            remaining: ring.len(),
            start: ring.first().copied().unwrap_or(0),
            work: 0,
            most_work: WORK_PER_CORNER * points.len() as u64,
        };
        for &corner in ring {
            ears.note_turn(corner);
        }
        let reflex: Vec<u32> = ring.iter().copied().filter(|&corner| ears.reflex[corner as usize]).collect();
        ears.grid = Grid::of(points, &reflex);
        ears
    }

    /// Triangulates the polygon.
    pub(super) fn cut(mut self, triangles: &mut Vec<[u32; 3]>) {
        let mut demand = Demand::Clean;
        let mut candidates = self.ring();
        while self.remaining > 3 && self.work <= self.most_work {
            let remaining = self.remaining;
            candidates = self.cut_round(&candidates, demand, triangles);
            if demand != Demand::Clean {
                demand = if self.remaining < remaining { Demand::Clean } else { demand.next() };
                candidates = self.ring();
            } else if candidates.is_empty() {
                demand = demand.next();
                candidates = self.ring();
            }
        }
        halve(self.ring(), triangles);
    }

    /// Cuts off the ears among the candidates. Returns the neighbours of cut corners, which may be ears in the next
    /// round; all other corners are unchanged.
    fn cut_round(&mut self, candidates: &[u32], demand: Demand, triangles: &mut Vec<[u32; 3]>) -> Vec<u32> {
        let mut touched = Vec::new();
        for &corner in candidates {
            if self.remaining <= 3 || self.work > self.most_work {
                break;
            }
            let (before, after) = (self.before(corner), self.after(corner));
            let is_gone = after == corner;
            if is_gone || self.is_touched[corner as usize] || !self.is_ear(corner, demand) {
                continue;
            }
            triangles.push([before, corner, after]);
            self.cut_off(corner);
            for neighbour in [before, after] {
                if !std::mem::replace(&mut self.is_touched[neighbour as usize], true) {
                    touched.push(neighbour);
                }
            }
        }
        for &corner in &touched {
            self.is_touched[corner as usize] = false;
        }
        touched
    }

    fn ring(&self) -> Vec<u32> {
        let ring = std::iter::successors(Some(self.start), |&corner| Some(self.after(corner)));
        ring.take(self.remaining).collect()
    }

    fn is_ear(&mut self, corner: u32, demand: Demand) -> bool {
        self.work += 1;
        let (before, after) = (self.before(corner), self.after(corner));
        let triangle = [before, corner, after].map(|corner| self.at(corner));
        let [a, b, c] = triangle;
        let area = turn(a, b, c);
        match demand {
            Demand::Clean => {
                area > 0.0
                    && self.is_inside_at_its_ends(before, corner, after)
                    && !self.is_blocked(triangle, |p| {
                        let touches = turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
                        touches && p != a && p != b && p != c
                    })
            }
            Demand::Touching => {
                area == 0.0
                    || area > 0.0
                        && !self.is_blocked(triangle, |p| {
                            turn(a, b, p) > 0.0 && turn(b, c, p) > 0.0 && turn(c, a, p) > 0.0
                        })
            }
            Demand::Crossed => area >= 0.0,
            Demand::Any => true,
        }
    }

    /// Whether the new edge leaves both its ends towards the inside. Corners at one position, as at bridges to holes,
    /// share the directions around it, so that no further test is needed for them.
    fn is_inside_at_its_ends(&self, before: u32, corner: u32, after: u32) -> bool {
        let [a, b, c] = [before, corner, after].map(|corner| self.at(corner));
        let (ahead, behind) = (self.at(self.before(before)), self.at(self.after(after)));
        let leaves_a = turn(ahead, a, b) <= 0.0 || turn(a, c, ahead) > 0.0;
        let leaves_c = turn(b, c, behind) <= 0.0 || turn(c, behind, a) > 0.0;
        leaves_a && leaves_c
    }

    fn is_blocked(&mut self, triangle: [DVec2; 3], blocks: impl Fn(DVec2) -> bool) -> bool {
        let (points, reflex) = (self.points, &self.reflex);
        self.grid.any(
            triangle,
            |corner| reflex[corner as usize],
            |corner| blocks(points[corner as usize]),
            &mut self.work,
        )
    }

    fn cut_off(&mut self, corner: u32) {
        let (before, after) = (self.before(corner), self.after(corner));
        self.next[before as usize] = after;
        self.previous[after as usize] = before;
        self.next[corner as usize] = corner;
        self.start = before;
        self.reflex[corner as usize] = false;
        self.remaining -= 1;
        self.note_turn(before);
        self.note_turn(after);
    }

    fn note_turn(&mut self, corner: u32) {
        let turned = turn(self.at(self.before(corner)), self.at(corner), self.at(self.after(corner)));
        self.reflex[corner as usize] = turned <= 0.0;
    }

    fn at(&self, corner: u32) -> DVec2 {
        self.points[corner as usize]
    }

    fn after(&self, corner: u32) -> u32 {
        self.next[corner as usize]
    }

    fn before(&self, corner: u32) -> u32 {
        self.previous[corner as usize]
    }
}
