//! With and without passing on, and with workers that fall.

use proptest::prelude::*;

use super::*;

/// The workers of a setup that neither die nor stand still.
fn survivors(setup: &PassingSetup) -> u32 {
    setup.workers.saturating_sub(setup.deaths + setup.hangs)
}

fn setup(workers: u32, pass_on: bool) -> PassingSetup {
    PassingSetup {
        workers,
        asset_bytes: 91_000_000,
        pass_on,
        link_bits: 1e9,
        round_trip: 200_000,
        deaths: 0,
        hangs: 0,
        seed: 1,
    }
}

#[test]
fn the_master_sends_one_copy_where_workers_pass_it_on() {
    for workers in [1, 8, 32] {
        let (alone, passed) = (pass(&setup(workers, false)), pass(&setup(workers, true)));
        assert!((alone.master_copies - f64::from(workers)).abs() < 1e-9, "{alone:?}");
        assert!((passed.master_copies - 1.0).abs() < 1e-9, "{passed:?}");
        assert_eq!((alone.workers, passed.workers), (workers, workers));
        assert!(passed.seconds < 1.3, "{workers}: {passed:?}");
        assert!(workers < 8 || alone.seconds > 5.0 * passed.seconds, "{alone:?} {passed:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn everybody_who_lives_gets_it_whoever_falls(seed: u64, deaths in 0..4u32, hangs in 0..3u32) {
        let setup = PassingSetup { deaths, hangs, seed, asset_bytes: 20_000_000, ..setup(32, true) };
        let passed = pass(&setup);
        prop_assert_eq!(passed.workers, survivors(&setup));
        // The first copy, and at worst the rest of another for each that falls.
        prop_assert!(passed.master_copies <= f64::from(1 + deaths + hangs) + 0.1, "{:?}", passed);
        prop_assert!(passed.seconds < 8.0, "{:?}", passed);
    }
}

#[test]
fn two_that_fall_cost_less_than_a_second_copy_each() {
    for seed in 0..20 {
        let passed = pass(&PassingSetup { deaths: 1, hangs: 1, seed, ..setup(32, true) });
        assert!(passed.master_copies < 3.0, "{passed:?}");
    }
}
