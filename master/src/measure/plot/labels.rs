//! Placement of labels, so that they hide neither points nor other labels.

use super::draw::Pixel;

/// More labels than this overlap anyway, and a search for places takes long.
const MAX_PLACED: usize = 200;
/// Distance of a label from its point in pixels, and further distances to try, nearest first.
const GAP: i32 = 9;
const STEPS: [i32; 7] = [0, 12, 26, 42, 60, 80, 105];
/// Half the side of a mark, with a margin.
const MARK: i32 = 7;
/// Cost of a hidden pixel, in pixels of distance.
const HIDDEN: i64 = 6;
/// Cost of a pixel outside the plot: more than any cost inside.
const OUTSIDE: i64 = 1_000;
/// Distance between two tested points of a line, in pixels.
const LINE_STEP: f64 = 5.0;

/// A rectangle in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Area {
    pub(super) left: i32,
    pub(super) top: i32,
    pub(super) right: i32,
    pub(super) bottom: i32,
}

/// A label's point, and its size in pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Label {
    pub(super) at: Pixel,
    pub(super) width: i32,
    pub(super) height: i32,
}

/// Everything that labels avoid.
#[derive(Clone, Debug, Default)]
pub(super) struct Drawn {
    /// Centres of marks.
    pub(super) marks: Vec<Pixel>,
    /// End points of straight lines.
    pub(super) lines: Vec<[Pixel; 2]>,
}

impl Area {
    /// Common pixels of two rectangles.
    fn overlap(self, other: Self) -> i64 {
        let width = self.right.min(other.right) - self.left.max(other.left);
        let height = self.bottom.min(other.bottom) - self.top.max(other.top);
        i64::from(width.max(0)) * i64::from(height.max(0))
    }

    fn size(self) -> i64 {
        self.overlap(self)
    }

    /// The point of the rectangle that is nearest to a pixel.
    pub(super) fn nearest_to(self, (x, y): Pixel) -> Pixel {
        (x.clamp(self.left, self.right), y.clamp(self.top, self.bottom))
    }

    /// Whether it is so far from its point that a line should lead to it.
    pub(super) fn is_away_from(self, at: Pixel) -> bool {
        let near = self.nearest_to(at);
        (near.0 - at.0).abs().max((near.1 - at.1).abs()) > 2 * GAP
    }
}

/// Places labels in `room`, greedily: each where it hides least, then nearest to its point, then at the right and
/// above.
pub(super) fn place(labels: &[Label], drawn: &Drawn, room: Area) -> Vec<Area> {
    let mark = |(x, y): &Pixel| Area { left: x - MARK, top: y - MARK, right: x + MARK, bottom: y + MARK };
    let mut taken: Vec<Area> = drawn.marks.iter().map(mark).collect();
    taken.extend(drawn.lines.iter().flat_map(squares_along));
    let mut found = Vec::with_capacity(labels.len());
    for label in labels {
        let steps = if labels.len() > MAX_PLACED { &STEPS[..0] } else { &STEPS[..] };
        let cost = |(rank, area): &(i64, Area)| {
            let hidden: i64 = taken.iter().map(|other| area.overlap(*other)).sum();
            rank + hidden * HIDDEN + (area.size() - area.overlap(room)) * OUTSIDE
        };
        let best = candidates(label, steps).min_by_key(cost);
        let (_, area) = best.unwrap_or((0, side_area(label, 1, -1, 0)));
        taken.push(area);
        found.push(area);
    }
    found
}

/// Places around the point, with the cost of their distance and side.
fn candidates<'a>(label: &'a Label, steps: &'a [i32]) -> impl Iterator<Item = (i64, Area)> + 'a {
    const SIDES: [(i32, i32); 8] = [(1, -1), (-1, -1), (1, 1), (-1, 1), (1, 0), (-1, 0), (0, -1), (0, 1)];
    steps.iter().flat_map(move |step| {
        (0..)
            .zip(SIDES)
            .map(move |(rank, (x, y))| (rank + i64::from(*step) * 8, side_area(label, x, y, *step)))
    })
}

/// The label at one side of its point: -1 is left or above, 1 right or below, 0 centred.
fn side_area(label: &Label, x: i32, y: i32, step: i32) -> Area {
    let Label { at, width, height } = *label;
    let left = match x {
        0 => at.0 - width / 2,
        1 => at.0 + GAP + step,
        _ => at.0 - GAP - step - width,
    };
    // Above its point, a label at its side ends at the point's height, and a centred one ends above the mark.
    let clear = if x == 0 { GAP } else { 0 };
    let top = match y {
        0 => at.1 - height / 2,
        1 => at.1 + clear + step,
        _ => at.1 - clear - step - height,
    };
    Area { left, top, right: left + width, bottom: top + height }
}

/// Small squares along a line.
fn squares_along([from, to]: &[Pixel; 2]) -> Vec<Area> {
    let (dx, dy) = (f64::from(to.0 - from.0), f64::from(to.1 - from.1));
    let count = (dx.hypot(dy) / LINE_STEP).ceil().clamp(1.0, 1e4) as i32;
    let square = |i: i32| {
        let share = f64::from(i) / f64::from(count);
        let (x, y) = (from.0 + (dx * share) as i32, from.1 + (dy * share) as i32);
        Area { left: x - 1, top: y - 1, right: x + 1, bottom: y + 1 }
    };
    (0..=count).map(square).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const ROOM: Area = Area { left: 100, top: 50, right: 900, bottom: 600 };

    fn labels(points: &[Pixel]) -> Vec<Label> {
        points.iter().map(|at| Label { at: *at, width: 110, height: 20 }).collect()
    }

    fn placed(points: &[Pixel]) -> Vec<Area> {
        place(&labels(points), &Drawn { marks: points.to_vec(), lines: Vec::new() }, ROOM)
    }

    #[test]
    fn a_single_label_is_above_and_right_of_its_point_or_left_at_the_edge() {
        assert_eq!(placed(&[(300, 300)]), [Area { left: 309, top: 280, right: 419, bottom: 300 }]);
        assert_eq!(placed(&[(890, 300)])[0].right, 881);
    }

    #[test]
    fn a_label_avoids_a_line_where_there_is_room() {
        let drawn = Drawn { marks: vec![(300, 300)], lines: vec![[(300, 300), (500, 250)]] };
        let area = place(&labels(&[(300, 300)]), &drawn, ROOM)[0];
        assert!(
            drawn.lines.iter().flat_map(squares_along).all(|square| square.overlap(area) == 0),
            "{area:?}"
        );
    }

    #[test]
    fn too_many_labels_are_still_all_placed() {
        let points: Vec<Pixel> = (0..500).map(|i| (200 + i % 7, 200)).collect();
        assert_eq!(placed(&points).len(), 500);
    }

    #[test]
    fn labels_of_a_dozen_points_overlap_neither_each_other_nor_points() {
        let points: Vec<Pixel> = (0..12).map(|i| (130 + i % 4 * 180, 80 + i / 4 * 150)).collect();
        let areas = placed(&points);
        for (i, area) in areas.iter().enumerate() {
            assert!(areas[..i].iter().all(|other| other.overlap(*area) == 0), "{areas:?}");
            let covers =
                |p: &Pixel| area.left <= p.0 && p.0 < area.right && area.top <= p.1 && p.1 < area.bottom;
            assert!(!points.iter().any(covers), "{area:?} on {points:?}");
        }
    }

    proptest! {
        /// Labels of crowded points may overlap, because places are chosen greedily.
        #[test]
        fn every_point_has_a_label(points in prop::collection::vec((100..900_i32, 50..600_i32), 0..12)) {
            prop_assert_eq!(placed(&points).len(), points.len());
        }
    }
}
