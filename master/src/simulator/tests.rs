//! Fixed seeds and fresh ones; how well workers are used; what a lost one costs.

use proptest::prelude::*;

use super::machine::Ailment;
use super::world::World;
use super::{CostProfile, SECOND, Schedule, Setup, measure, survive};
use crate::scheduler::SegmentPolicy;

#[test]
fn fixed_schedules_are_survived() {
    for seed in 0..25 {
        if let Err(what) = survive(Schedule { seed }) {
            panic!("{what}; to see it again: rayfarm-master simulate --faults --seed {seed}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(15))]

    #[test]
    fn fresh_schedules_are_survived(seed: u64) {
        let survived = survive(Schedule { seed });
        prop_assert!(survived.is_ok(), "{survived:?}: rayfarm-master simulate --faults --seed {seed}");
    }
}

#[test]
fn the_same_seed_is_the_same_run() {
    let run = |seed| survive(Schedule { seed }).unwrap();
    assert_eq!(run(42), run(42));
    assert_ne!(run(42), run(43));
}

fn efficiency(workers: u32, costs: CostProfile, policy: SegmentPolicy) -> f64 {
    measure(&Setup { workers, costs, policy, tile_share: 0.0, frames: 60, ..Setup::default() })
        .unwrap()
        .useful
}

#[test]
fn workers_are_used_nearly_to_the_full() {
    for costs in [CostProfile::Bust, CostProfile::Corner] {
        for (workers, least) in [(1, 0.95), (8, 0.95), (32, 0.9), (128, 0.8)] {
            let reached = efficiency(workers, costs.clone(), SegmentPolicy::Adaptive);
            assert!(reached > least, "{costs:?} with {workers} workers: {reached}");
        }
        let reached = |policy| efficiency(8, costs.clone(), policy);
        assert!(reached(SegmentPolicy::Adaptive) > reached(SegmentPolicy::Static(16)));
    }
}

#[test]
fn a_worker_that_fails_makes_a_frame_late_by_a_frame_at_most() {
    let ailments = [None, Some(Ailment::Stopped), Some(Ailment::Slow(10.0)), Some(Ailment::Stuck)];
    for pipeline in [false, true] {
        for ailment in ailments {
            for victim in [1, 5] {
                let setup = Setup { pipeline, tile_share: 0.0, ..Setup::default() };
                let [usual, worst] = World::new(setup).struck(victim, ailment, SECOND * 3).unwrap();
                assert!(worst < 2.2 * usual, "{ailment:?} of {victim}: {worst} ms after {usual} ms");
            }
        }
    }
}

#[test]
fn costs_sum_to_one_whatever_the_profile() {
    let rows = CostProfile::from_text("1, 2\n3;0").unwrap();
    for costs in [CostProfile::Flat, CostProfile::Bust, CostProfile::Corner, rows] {
        for height in [1, 7, 768] {
            let sum: f64 = costs.shares(100, height).iter().sum();
            assert!((sum - 1.0).abs() < 1e-9, "{costs:?} {height}: {sum}");
        }
    }
    for wrong in ["", "1 two", "-1", "0 0", "inf"] {
        assert!(CostProfile::from_text(wrong).is_err(), "{wrong}");
    }
}
