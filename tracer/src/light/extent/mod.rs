//! Lights with an extent: the points of a ball that shadow rays go to.
//!
//! A surface point sees a ball as a disc, and S_j is the share of that disc which is not occluded. It is the mean over n points of
//! a *set* in the ball whose density grows towards the surface as 1 / sqrt(1 - d^2): seen from any direction such points are
//! uniform on the disc. The points do not depend on where the ball is seen from, so all shadow rays of a tile to one of them end
//! at a common point, as the rays to a light without extent do.
//!
//! The mean of n equal hard shadows has n + 1 steps, which are visible as bands. So there are four sets, for the four places of a
//! pattern of 2 x 2 samples of the picture: neighbouring samples have their steps in different places, and with four or more
//! samples a pixel each pixel has all of them. With [`MANY`] points or more the steps are invisible, and one set is all.
//!
//! For 16 points, pictures of the shadows of an edge and of a ball show: with one set five to eight bands; with two sets in a
//! checkerboard the same bands, paler; with four sets a fine pattern and no bands; with sixteen sets in 4 x 4 samples a coarser
//! pattern, which is more visible, for four times as many queries of a sixteenth of the rays each.
//!
//! ```text
//!   relax   the points of the sets
//! ```

mod relax;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec3;

/// Sets of a light with less than [`MANY`] points a set: one for each place of a pattern of 2 x 2 samples.
const SETS: usize = 4;

/// Points of a set from which there is only one set: a step is less than two of the 255 values of a white surface in 8-bit sRGB.
const MANY: u16 = 64;

/// The ball of a light, in eye space.
#[derive(Clone, Debug)]
pub(crate) struct Extent {
    center: DVec3,
    radius: f64,
    sets: Arc<Sets>,
}

/// The points of the unit ball, set by set.
#[derive(Debug)]
pub(crate) struct Sets(Vec<Vec<DVec3>>);

impl Extent {
    /// The ball around `center`, with `samples` points in a set, at least one.
    pub(super) fn new(center: DVec3, radius: f64, samples: u16) -> Self {
        Self { center, radius, sets: Sets::of(samples.max(1)) }
    }

    /// The centre of the ball.
    pub(crate) fn center(&self) -> DVec3 {
        self.center
    }

    /// Radius of the ball in eye units.
    pub(crate) fn radius(&self) -> f64 {
        self.radius
    }

    /// The points in the unit ball.
    pub(crate) fn sets(&self) -> &Sets {
        &self.sets
    }

    /// The points of a set in eye space, in their order.
    pub(crate) fn points(&self, set: usize) -> impl Iterator<Item = DVec3> {
        self.sets.points(set).iter().map(|&point| self.center + point * self.radius)
    }
}

impl Sets {
    /// The sets of `samples` points each, from 1 to 1024: a function of their number alone, the same on every machine. They take
    /// some 20 milliseconds, so they are kept for later frames: at most 1024 entries of at most 24 kB.
    pub(crate) fn of(samples: u16) -> Arc<Self> {
        static KNOWN: Mutex<BTreeMap<u16, Arc<Sets>>> = Mutex::new(BTreeMap::new());
        let count = if samples < MANY { SETS } else { 1 };
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        let create = || Arc::new(Self(relax::sets(usize::from(samples), count)));
        Arc::clone(known.entry(samples).or_insert_with(create))
    }

    /// Number of sets.
    pub(crate) fn count(&self) -> usize {
        self.0.len()
    }

    /// The points of a set in the unit ball.
    pub(crate) fn points(&self, set: usize) -> &[DVec3] {
        &self.0[set % self.0.len()]
    }

    /// The set of a sample, by its place in the pattern: see [`place_in_pattern`].
    pub(crate) fn at(&self, place: u8) -> usize {
        usize::from(place) % self.0.len()
    }
}

/// The place of a sample in the pattern of 2 x 2 samples, from 0 to 3. `column` and `row` are in samples from the top left corner
/// of the picture: with a grid of g x g samples a pixel, sample i of pixel x is in column g x + i.
#[inline(always)]
pub(crate) fn place_in_pattern(column: f64, row: f64) -> u8 {
    let odd = |along: f64| (along.floor() as i64 & 1) as u8;
    odd(column) + 2 * odd(row)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    fn directions(count: u32) -> Vec<DVec3> {
        let direction = |index: u32| {
            let z = 1.0 - 2.0 * (f64::from(index) + 0.5) / f64::from(count);
            let (sine, cosine) = libm::sincos(TAU * 0.618_033_988_75 * f64::from(index));
            let around = (1.0 - z * z).sqrt();
            DVec3::new(around * cosine, around * sine, z)
        };
        (0..count).map(direction).collect()
    }

    /// Largest difference between the distribution of points along a direction and that of a uniform disc.
    fn discrepancy(points: &[DVec3], direction: DVec3) -> f64 {
        let mut along: Vec<f64> = points.iter().map(|point| point.dot(direction)).collect();
        along.sort_by(f64::total_cmp);
        let share = |count: usize| count as f64 / along.len() as f64;
        let apart = |(index, &x): (usize, &f64)| {
            let exact = relax::below(x);
            (exact - share(index)).abs().max((exact - share(index + 1)).abs())
        };
        along.iter().enumerate().map(apart).fold(0.0, f64::max)
    }

    /// Mean and largest discrepancy over 100 directions.
    fn discrepancies(points: &[DVec3]) -> (f64, f64) {
        let all: Vec<f64> = directions(100).into_iter().map(|along| discrepancy(points, along)).collect();
        (all.iter().sum::<f64>() / all.len() as f64, all.iter().copied().fold(0.0, f64::max))
    }

    fn together(sets: &Sets) -> Vec<DVec3> {
        (0..sets.count()).flat_map(|set| sets.points(set).to_vec()).collect()
    }

    /// Mean and largest discrepancy of n independent points are about 0.87 and 1.5 over the root of n.
    #[test]
    fn each_set_and_all_together_are_uniform_on_the_disc_of_every_direction() {
        // Samples, the bounds of one set, the bounds of all sets.
        let bounds = [
            (4, (0.28, 0.48), (0.13, 0.21)),
            (16, (0.12, 0.21), (0.053, 0.085)),
            (63, (0.056, 0.09), (0.024, 0.042)),
            (64, (0.052, 0.085), (0.052, 0.085)),
            (1024, (0.0105, 0.017), (0.0105, 0.017)),
        ];
        for (samples, (mean, most), all) in bounds {
            let sets = Sets::of(samples);
            assert_eq!(sets.count(), if samples < 64 { 4 } else { 1 });
            for set in 0..sets.count() {
                let found = discrepancies(sets.points(set));
                assert!(found.0 < mean && found.1 < most, "{samples}, set {set}: {found:?}");
            }
            let found = discrepancies(&together(&sets));
            assert!(found.0 < all.0 && found.1 < all.1, "{samples}, all sets: {found:?}");
        }
    }

    #[test]
    fn every_number_of_points_is_inside_of_the_ball() {
        for samples in [1, 2, 3, 5, 7, 16, 17, 100, 1024] {
            let sets = Sets::of(samples);
            for set in 0..sets.count() {
                let points = sets.points(set);
                assert_eq!(points.len(), usize::from(samples));
                let inside = |point: &DVec3| point.length() <= 1.0 + 1e-12;
                assert!(points.iter().all(inside), "{samples} points");
            }
        }
    }

    /// The share of a uniform disc within the radius q is q^2.
    #[test]
    fn points_are_uniform_from_the_middle_of_the_disc_to_its_edge() {
        let points = together(&Sets::of(16));
        for direction in directions(100) {
            for radius in [0.5, 0.7, 0.85] {
                let within = |point: &&DVec3| point.reject_from_normalized(direction).length() < radius;
                let share = points.iter().filter(within).count() as f64 / points.len() as f64;
                assert!((share - radius * radius).abs() < 0.13, "{share} within {radius} along {direction}");
            }
        }
    }

    #[test]
    fn places_repeat_every_second_sample() {
        let places = |from: f64| {
            [0.0, 1.0].map(|row| [0.0, 1.0].map(|column| place_in_pattern(from + column, row + 0.5)))
        };
        assert_eq!(places(0.5), [[0, 1], [2, 3]]);
        assert_eq!(places(7.5), [[1, 0], [3, 2]]);
        assert_eq!(places(16384.0), [[0, 1], [2, 3]]);
    }
}
