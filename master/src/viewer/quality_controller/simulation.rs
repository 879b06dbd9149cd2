//! The governor against simulated costs: steady, noisy, in steps and ramps, and different from the table.

use std::collections::VecDeque;
use std::time::Duration;

use proptest::prelude::*;

use super::governor::Governor;
use crate::measure::simulator::Rng;

/// Requests in flight: a decision of the governor takes effect after as many frames.
const IN_FLIGHT: usize = 2;
/// Frames after which everything has settled.
const SETTLING: usize = 300;
/// Costs of the rungs by the table of these tests.
const TABLE: [f64; 6] = [1.0, 0.75, 0.6, 0.4, 0.28, 0.15];
/// 100 frames a second, in seconds a frame.
const BUDGET: f64 = 0.01;

/// A farm with given costs.
struct Simulation {
    governor: Governor,
    truth: Vec<f64>,
    noise: f64,
    dice: Rng,
    in_flight: VecDeque<usize>,
}

/// A finished frame.
#[derive(Clone, Copy, Debug)]
struct Frame {
    rung: usize,
    /// Time without noise, in seconds.
    expected: f64,
}

impl Simulation {
    /// Costs of the table, with noise of up to `noise` either way.
    fn new(noise: f64, seed: u64) -> Self {
        Self::with_truth(&TABLE, &TABLE, noise, seed)
    }

    fn with_truth(table: &[f64], truth: &[f64], noise: f64, seed: u64) -> Self {
        let governor = Governor::new(table.iter().copied(), Duration::from_secs_f64(BUDGET));
        let in_flight = VecDeque::from([0; IN_FLIGHT]);
        Self { governor, truth: truth.to_vec(), noise, dice: Rng::new(seed), in_flight }
    }

    /// Renders a frame where the full one takes `load` budgets.
    fn frame(&mut self, load: f64) -> Frame {
        let rung = self.in_flight.pop_front().unwrap();
        let expected = BUDGET * load * self.truth[rung];
        let noise = 1.0 + self.noise * (2.0 * self.dice.fraction() - 1.0);
        self.governor.observe(rung, Duration::from_secs_f64(expected * noise));
        self.in_flight.push_back(self.governor.rung());
        Frame { rung, expected }
    }

    fn frames(&mut self, load: f64, count: usize) -> Vec<Frame> {
        (0..count).map(|_| self.frame(load)).collect()
    }

    /// Changes of the rung at a steady load, after settling.
    fn changes(&mut self, load: f64) -> usize {
        self.frames(load, SETTLING);
        changes(&self.frames(load, 1000))
    }
}

fn changes(frames: &[Frame]) -> usize {
    frames.windows(2).filter(|pair| pair[0].rung != pair[1].rung).count()
}

/// The rung of least loss that takes at most this part of the budget.
fn best(truth: &[f64], load: f64, part: f64) -> usize {
    truth.iter().position(|ratio| ratio * load <= part).unwrap_or(truth.len() - 1)
}

#[test]
fn a_steady_load_gets_the_best_rung_that_holds_and_keeps_it() {
    for load in [0.3, 0.8, 1.1, 1.3, 2.0, 3.0, 5.0] {
        let mut simulation = Simulation::new(0.0, 0);
        assert_eq!(simulation.changes(load), 0, "{load}");
        assert_eq!(simulation.governor.rung(), best(&TABLE, load, 0.87), "{load}");
    }
}

#[test]
fn noise_causes_neither_oscillation_nor_loss_of_quality() {
    for seed in 0..200 {
        let load = 0.3 + 0.03 * seed as f64;
        let mut simulation = Simulation::new(0.2, seed);
        assert_eq!(simulation.changes(load), 0, "load {load}, seed {seed}");
        let rung = simulation.governor.rung();
        assert!(
            (best(&TABLE, load, 1.06)..=best(&TABLE, load, 0.78)).contains(&rung),
            "{load} {seed} {rung}"
        );
    }
}

#[test]
fn the_governor_recovers_within_ten_frames_of_a_step_either_way() {
    for (before, after) in
        [(0.8, 3.0), (1.0, 5.0), (0.5, 1.3), (2.0, 2.8), (5.0, 1.0), (3.0, 0.5), (2.6, 1.2)]
    {
        for seed in 0..50 {
            let mut simulation = Simulation::new(0.05, seed);
            simulation.frames(before, SETTLING);
            simulation.frames(after, 10);
            let held = |frame: &Frame| frame.rung >= best(&TABLE, after, 1.03);
            let no_worse = |frame: &Frame| frame.rung <= best(&TABLE, after, 0.8);
            let frames = simulation.frames(after, 15);
            let recovered = |frame| if before < after { held(frame) } else { no_worse(frame) };
            assert!(frames.iter().all(recovered), "{before} to {after}, {seed}: {frames:?}");
            let frames = simulation.frames(after, 15);
            assert!(frames.iter().all(|f| held(f) && no_worse(f)), "{before} to {after}, {seed}: {frames:?}");
        }
    }
}

#[test]
fn a_step_in_noise_is_held_within_ten_frames_too() {
    for seed in 0..100 {
        let mut simulation = Simulation::new(0.2, seed);
        simulation.frames(0.8, SETTLING);
        simulation.frames(3.0, 10);
        let late = simulation.frames(3.0, 30).iter().filter(|frame| frame.expected > 1.05 * BUDGET).count();
        assert_eq!(late, 0, "seed {seed}");
    }
}

#[test]
fn a_ramp_is_followed() {
    for (from, to) in [(0.5_f64, 5.0_f64), (5.0, 0.5)] {
        for seed in 0..20 {
            let mut simulation = Simulation::new(0.1, seed);
            simulation.frames(from, SETTLING);
            let at = |step: usize| from * (to / from).powf(step as f64 / 300.0);
            let frames: Vec<Frame> = (0..300).map(|step| simulation.frame(at(step))).collect();
            let mean = frames.iter().map(|frame| frame.expected).sum::<f64>() / 300.0;
            assert!(mean < BUDGET, "{from} to {to}: {mean}");
            assert!(changes(&frames) <= 2 * TABLE.len(), "{from} to {to}: {}", changes(&frames));
        }
    }
}

#[test]
fn a_rung_that_is_dearer_than_the_table_says_is_tried_once() {
    // Without shadows, a scene that has none is as slow as with them.
    let truth = [1.0, 0.98, 0.97, 0.4, 0.28, 0.15];
    for seed in 0..50 {
        let mut simulation = Simulation::with_truth(&TABLE, &truth, 0.2, seed);
        let first = simulation.frames(1.2, SETTLING);
        assert!(first.iter().filter(|frame| (1..3).contains(&frame.rung)).count() < 40, "seed {seed}");
        assert_eq!(simulation.changes(1.2), 0, "seed {seed}");
        assert_eq!(simulation.governor.rung(), 3);
    }
}

#[test]
fn estimated_costs_of_rungs_are_the_true_ones() {
    let truth = [1.0, 0.95, 0.8, 0.6, 0.4, 0.2];
    let mut simulation = Simulation::with_truth(&TABLE, &truth, 0.1, 7);
    for load in [0.5, 1.0, 1.2, 1.5, 2.0, 4.0, 1.0, 0.5] {
        simulation.frames(load, 200);
    }
    let load = simulation.governor.predicted(0).unwrap().as_secs_f64();
    for rung in 2..5 {
        let ratio = simulation.governor.predicted(rung).unwrap().as_secs_f64() / load;
        assert!((ratio / truth[rung]).ln().abs() < 0.15, "rung {rung}: {ratio} for {}", truth[rung]);
    }
}

#[test]
fn a_load_beyond_all_rungs_is_reported_until_it_eases() {
    let mut simulation = Simulation::new(0.2, 3);
    simulation.frames(5.0, 100);
    assert!(!simulation.governor.is_beaten());
    simulation.frames(9.0, 30);
    assert!(simulation.governor.is_beaten());
    assert_eq!(simulation.governor.rung(), TABLE.len() - 1);
    assert_eq!(simulation.changes(9.0), 0);
    simulation.frames(5.0, 30);
    assert!(!simulation.governor.is_beaten());
}

#[test]
fn frames_at_rest_determine_the_rung_of_moving_ones() {
    let mut governor = Governor::new(TABLE, Duration::from_secs_f64(BUDGET));
    (0..20).for_each(|_| governor.observe(0, Duration::from_secs_f64(3.0 * BUDGET)));
    assert_eq!(governor.rung(), best(&TABLE, 3.0, 0.87));
    (0..20).for_each(|_| governor.observe(0, Duration::from_secs_f64(0.5 * BUDGET)));
    assert_eq!(governor.rung(), 0);
}

/// The cost of one rung may change without the others, as that of adaptive anti-aliasing does when the camera comes to edges:
/// the load seems to have jumped, and only the worst rung to hold.
#[test]
fn one_rung_that_becomes_dear_does_not_rule_out_the_others() {
    for seed in 0..50 {
        let mut simulation = Simulation::new(0.05, seed);
        simulation.frames(2.0, SETTLING);
        assert_eq!(simulation.governor.rung(), 3, "seed {seed}");
        simulation.frames(1.25, SETTLING);
        assert_eq!(simulation.governor.rung(), 2, "seed {seed}");
        simulation.truth[2] = 1.5;
        simulation.frames(1.25, 120);
        assert_eq!(simulation.governor.rung(), 3, "seed {seed}");
    }
}

/// Falling costs of up to eight rungs, the first being 1.
fn ladders() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(0.4..0.95_f64, 0..7).prop_map(|factors| {
        let falling = factors.iter().scan(1.0, |cost, factor| {
            *cost *= factor;
            Some(*cost)
        });
        std::iter::once(1.0).chain(falling).collect()
    })
}

proptest! {
    #[test]
    fn a_steady_load_never_oscillates(
        table in ladders(),
        errors in prop::collection::vec(0.6..1.7_f64, 7),
        load in 0.1..20.0_f64,
        noise in 0.0..0.2_f64,
        seed: u64,
    ) {
        let errors = std::iter::once(1.0).chain(errors);
        let truth: Vec<f64> = table.iter().zip(errors).map(|(ratio, error)| ratio * error).collect();
        let mut simulation = Simulation::with_truth(&table, &truth, noise, seed);
        let settling = simulation.frames(load, SETTLING);
        prop_assert!(changes(&settling) <= 3 * table.len(), "{}", changes(&settling));
        // A rung that has never been tried may be tried late, once: to it and back.
        prop_assert!(changes(&simulation.frames(load, 1000)) <= 2);
        let rung = simulation.governor.rung();
        let holds = |rung: &usize| truth[*rung] * load <= 1.07;
        prop_assert!(holds(&rung) || simulation.governor.is_beaten() || truth.iter().all(|r| r * load > 0.8));
    }

    #[test]
    fn any_frames_are_accepted(
        ratios in prop::collection::vec(any::<f64>(), 0..9),
        budget in 0_u64..10_000_000_000,
        frames in prop::collection::vec((0_usize..12, any::<u64>()), 0..200),
    ) {
        let rungs = ratios.len();
        let mut governor = Governor::new(ratios, Duration::from_nanos(budget));
        for (rung, nanos) in frames {
            governor.observe(rung, Duration::from_nanos(nanos));
            prop_assert!(governor.rung() < rungs.max(1));
        }
    }
}
