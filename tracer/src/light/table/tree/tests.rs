//! Probabilities of many lights: they add up to the share of numbers that select one, and every light that reaches a point has one.

use proptest::prelude::*;

use super::*;
use crate::simd::{self, best, dispatch};

/// Numbers in [0, 1) that differ from use to use (Steele et al., "Fast Splittable Pseudorandom Number Generators", 2014).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn place(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }

    fn direction(&mut self) -> DVec3 {
        loop {
            let place = self.place();
            if place.length() > 0.1 && place.length() < 1.0 {
                return place.normalize();
            }
        }
    }

    fn receiver(&mut self) -> Receiver {
        receiver(self.place(), self.direction())
    }
}

fn receiver(point: DVec3, normal: DVec3) -> Receiver {
    Receiver { point: point.as_vec3().to_array(), normal: normal.as_vec3().to_array() }
}

/// A light of a test, with what its bound was made of.
#[derive(Clone, Copy, Debug)]
enum Lamp {
    Ball(DVec3, f64),
    Triangle([DVec3; 3], DVec3),
    Spot(DVec3, DVec3, f64),
}

fn lamp(kind: usize, numbers: &mut Numbers) -> Lamp {
    let place = numbers.place();
    match kind {
        0 => Lamp::Ball(place, 0.001 + 0.1 * numbers.next().powi(3)),
        1 => {
            let size = 0.3 * numbers.next().powi(2);
            let corners = [place, place + numbers.direction() * size, place + numbers.direction() * size];
            let front = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
            Lamp::Triangle(corners, front)
        }
        _ => Lamp::Spot(place, numbers.direction(), 0.05 + 1.5 * numbers.next()),
    }
}

fn bound(lamp: &Lamp, strength: f64) -> Bound {
    let falling = Strength { inverse_square: strength, constant: 0.0 };
    match *lamp {
        Lamp::Ball(center, radius) => Bound::of_ball(center, radius, falling),
        Lamp::Triangle(corners, front) => Bound::of_triangle(corners, front, falling),
        Lamp::Spot(place, axis, half_angle) => {
            let strength = Strength { inverse_square: 0.0, constant: strength };
            Bound::of_beam(Bound::of_ball(place, 0.0, strength), axis, half_angle)
        }
    }
}

fn tree_of(bounds: &[Bound]) -> LightTree {
    let lights: Vec<(u32, Bound)> = (0..).zip(bounds.iter().copied()).collect();
    LightTree::new(&lights, lights.len(), 1.0).unwrap()
}

/// Lamps of all kinds and their tree.
fn random(count: usize, seed: u64) -> (Vec<Lamp>, LightTree) {
    let mut numbers = Numbers(seed);
    let lamps: Vec<Lamp> = (0..count).map(|index| lamp(index % 3, &mut numbers)).collect();
    let bounds: Vec<Bound> = lamps.iter().map(|lamp| bound(lamp, 0.1 + numbers.next())).collect();
    (lamps, tree_of(&bounds))
}

fn probability(tree: &LightTree, to: &Receiver, selection: Selection, source: usize) -> f32 {
    dispatch!(best(), simd => tree.probability(simd, to, selection, source as u32))
}

fn select(tree: &LightTree, to: &Receiver, selection: Selection, number: f32) -> Option<(u32, f32)> {
    dispatch!(best(), simd => tree.select_one(simd, to, selection, number))
}

fn probabilities(tree: &LightTree, to: &Receiver, selection: Selection) -> Vec<f32> {
    (0..tree.trails.len()).map(|source| probability(tree, to, selection, source)).collect()
}

/// Asserts that evenly spread numbers select sources as often as their probabilities say, and that both agree to the bit.
fn assert_selected_as_probable(tree: &LightTree, to: &Receiver, selection: Selection) {
    let expected = probabilities(tree, to, selection);
    let steps = 1 << 14;
    let mut lost = 0.0;
    let mut counts = vec![0; expected.len()];
    for step in 0..steps {
        let number = (step as f32 + 0.5) / steps as f32;
        let Some((source, probability)) = select(tree, to, selection, number) else {
            lost += 1.0;
            continue;
        };
        assert_eq!(probability.to_bits(), expected[source as usize].to_bits());
        counts[source as usize] += 1;
    }
    // Each node without a source that reaches the point has one interval of the numbers.
    let (sum, nodes) = (expected.iter().sum::<f32>(), tree.nodes.len() as f32);
    let share = lost / steps as f32;
    assert!((sum + share - 1.0).abs() < (nodes + 1.0) / steps as f32 + 1e-4, "{sum} and {share}");
    for (count, probability) in counts.into_iter().zip(&expected) {
        let expected = f64::from(*probability) * f64::from(steps);
        // The share of a source is one interval.
        assert!((f64::from(count) - expected).abs() < 1.1 + 1e-3 * expected, "{count}, not {expected}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn probabilities_add_up_to_one_at_most(seed in any::<u64>(), count in 17_usize..400, flat in any::<bool>()) {
        let (_, tree) = random(count, seed);
        let mut numbers = Numbers(!seed);
        for selection in [Selection::All, Selection::Extended] {
            let mut to = numbers.receiver();
            if flat {
                to.normal = [0.0; 3];
            }
            let sum: f64 = probabilities(&tree, &to, selection).into_iter().map(f64::from).sum();
            prop_assert!(sum < 1.0 + 1e-4, "{sum}");
            if let Some((source, found)) = select(&tree, &to, selection, 0.5) {
                prop_assert_eq!(found, probability(&tree, &to, selection, source as usize));
            }
        }
    }

    #[test]
    fn selections_follow_the_probabilities(seed in any::<u64>(), count in 17_usize..120) {
        let (_, tree) = random(count, seed);
        let to = Numbers(!seed).receiver();
        assert_selected_as_probable(&tree, &to, Selection::All);
        assert_selected_as_probable(&tree, &to, Selection::Extended);
    }

    #[test]
    fn every_light_that_reaches_a_point_has_a_probability(seed in any::<u64>(), count in 17_usize..300) {
        let (lamps, tree) = random(count, seed);
        let mut numbers = Numbers(!seed);
        for (source, lamp) in lamps.iter().enumerate() {
            let (point, normal) = (numbers.place(), numbers.direction());
            let [a, b] = [numbers.next().sqrt(), numbers.next()];
            let (place, reaches) = match *lamp {
                Lamp::Ball(center, radius) => {
                    let place = center + numbers.direction() * radius;
                    (place, (place - center).dot(point - place) > 0.0)
                }
                Lamp::Triangle([p, q, r], front) => {
                    let place = p + (q - p) * (a * (1.0 - b)) + (r - p) * (a * b);
                    (place, front.dot(point - place) > 0.0)
                }
                Lamp::Spot(place, axis, half_angle) => {
                    (place, axis.angle_between(point - place) < half_angle)
                }
            };
            if reaches && normal.dot(place - point) > 0.0 {
                let found = probability(&tree, &receiver(point, normal), Selection::All, source);
                prop_assert!(found > 0.0, "{lamp:?} from {point}, {normal}");
            }
        }
    }

    #[test]
    fn points_at_lights_and_on_their_boxes_have_probabilities(seed in any::<u64>()) {
        let (lamps, tree) = random(60, seed);
        for lamp in &lamps {
            let place = match *lamp {
                Lamp::Ball(place, radius) => place + DVec3::X * radius,
                Lamp::Triangle([place, ..], _) | Lamp::Spot(place, ..) => place,
            };
            for normal in [DVec3::ZERO, DVec3::Y] {
                let to = receiver(place, normal);
                let all = probabilities(&tree, &to, Selection::All);
                prop_assert!(all.iter().all(|p| (0.0..=1.0001).contains(p)));
                let sum: f32 = all.iter().sum();
                prop_assert!(sum > 0.0 && sum < 1.0 + 1e-4, "{sum}");
            }
        }
    }
}

/// Balls in a grid on the plane y = 1.
fn ceiling() -> Vec<Bound> {
    let strength = Strength { inverse_square: 1.0, constant: 0.0 };
    let place = |i: u32| DVec3::new(f64::from(i % 8) - 3.5, 4.0, f64::from(i / 8) - 3.5) / 4.0;
    (0..64).map(|i| Bound::of_ball(place(i), 0.01, strength)).collect()
}

#[test]
fn lights_behind_a_surface_are_not_selected() {
    let tree = tree_of(&ceiling());
    let down = receiver(DVec3::ZERO, DVec3::NEG_Y);
    assert!(select(&tree, &down, Selection::All, 0.3).is_none());
    assert!(probabilities(&tree, &down, Selection::All).iter().all(|&p| p == 0.0));
    let up = receiver(DVec3::ZERO, DVec3::Y);
    assert!(probabilities(&tree, &up, Selection::All).iter().all(|&p| p > 0.0));
}

#[test]
fn shares_are_near_the_irradiance() {
    let tree = tree_of(&ceiling());
    let to = receiver(DVec3::new(0.1, 0.2, -0.3), DVec3::Y);
    let found = probabilities(&tree, &to, Selection::All);
    let irradiance = |bound: &Bound| {
        let way = bound.center - DVec3::new(0.1, 0.2, -0.3);
        way.y / way.length().powi(3)
    };
    let all: Vec<f64> = ceiling().iter().map(irradiance).collect();
    let total: f64 = all.iter().sum();
    for (found, exact) in found.iter().zip(&all) {
        // Groups are bounded by spheres: their shares are near the true ones.
        let ratio = f64::from(*found) * total / exact;
        assert!((0.4..2.5).contains(&ratio), "{ratio}");
    }
}

#[test]
fn lights_without_extent_are_selected_only_among_all() {
    let strength = Strength { inverse_square: 1.0, constant: 0.5 };
    let mut lights = ceiling();
    lights.extend((0..20).map(|i| Bound::of_ball(DVec3::X * f64::from(i), 0.0, strength)));
    let tree = tree_of(&lights);
    let to = receiver(DVec3::new(0.3, -0.5, 0.2), DVec3::Y);
    let among = |selection| -> f32 { probabilities(&tree, &to, selection)[64..].iter().sum() };
    assert!(among(Selection::All) > 0.1);
    assert_eq!(among(Selection::Extended), 0.0);
    assert_selected_as_probable(&tree, &to, Selection::Extended);
}

#[test]
fn few_lights_and_lights_without_strength_have_no_tree() {
    let lights = |count: u32, strength: f64| -> Vec<(u32, Bound)> {
        let strength = Strength { inverse_square: strength, constant: 0.0 };
        (0..count).map(|i| (i, Bound::of_ball(DVec3::X * f64::from(i), 0.1, strength))).collect()
    };
    let few = MIN_LIGHTS as u32 - 1;
    assert!(LightTree::new(&lights(few, 1.0), few as usize, 1.0).is_none());
    assert!(LightTree::new(&lights(few + 1, 1.0), MIN_LIGHTS, 1.0).is_some());
    assert!(LightTree::new(&lights(few + 1, 0.0), MIN_LIGHTS, 1.0).is_none());
}

#[test]
fn all_levels_select_the_same_to_the_bit() {
    let (_, tree) = random(500, 7);
    let mut numbers = Numbers(8);
    for _ in 0..200 {
        let (to, number) = (numbers.receiver(), numbers.next() as f32);
        let expected = select(&tree, &to, Selection::All, number);
        for level in simd::all() {
            let found = dispatch!(level, simd => tree.select_one(simd, &to, Selection::All, number));
            assert_eq!(found.map(|(s, p)| (s, p.to_bits())), expected.map(|(s, p)| (s, p.to_bits())));
        }
    }
}

#[test]
fn extreme_places_and_strengths_have_finite_probabilities() {
    let mut lights = ceiling();
    let huge = Strength { inverse_square: 1e30, constant: 0.0 };
    let tiny = Strength { inverse_square: 1e-30, constant: 0.0 };
    lights.push(Bound::of_ball(DVec3::splat(1e15), 0.0, huge));
    lights.push(Bound::of_ball(DVec3::ZERO, 0.0, tiny));
    let tree = tree_of(&lights);
    let places = [DVec3::ZERO, DVec3::splat(1e15), DVec3::splat(-1e25), DVec3::splat(1e-30)];
    for place in places {
        for normal in [DVec3::ZERO, DVec3::Y, DVec3::NEG_Y] {
            let to = receiver(place, normal);
            let all = probabilities(&tree, &to, Selection::All);
            assert!(all.iter().all(|p| (0.0..=1.0001).contains(p)), "{place}: {all:?}");
            for number in [0.0, 0.5, 1.0 - f32::EPSILON / 2.0] {
                if let Some((source, probability)) = select(&tree, &to, Selection::All, number) {
                    assert!(probability > 0.0 && probability == all[source as usize]);
                }
            }
        }
    }
}

#[test]
fn the_last_part_with_a_weight_gets_the_end_of_the_numbers() {
    let mut weights = [0.0; LANES];
    weights[3] = 0.1;
    weights[7] = 0.3;
    let last = Share::select(&weights, 1.0 - f32::EPSILON / 2.0).unwrap();
    assert_eq!((last.slot, last.rest < 1.0), (7, true));
    assert_eq!(Share::select(&weights, 0.0).unwrap().slot, 3);
    assert_eq!(Share::select(&[0.0; LANES], 0.5), None);
    assert!((f64::from(Share::of(&weights, 7)) - 0.75).abs() < 1e-6 && Share::of(&weights, 0) == 0.0);
}
