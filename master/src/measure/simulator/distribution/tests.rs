//! Distribution with and without chain replication, and with failing workers.

use proptest::prelude::*;

use super::*;

/// Number of workers of a setup that neither exit nor hang.
fn live_workers(setup: &DistributionSetup) -> u32 {
    setup.workers.saturating_sub(setup.exits + setup.hangs)
}

fn setup(workers: u32, relay: bool) -> DistributionSetup {
    DistributionSetup {
        workers,
        asset_bytes: 91_000_000,
        relay,
        link_bits: 1e9,
        round_trip: 200_000,
        exits: 0,
        hangs: 0,
        seed: 1,
    }
}

#[test]
fn with_chain_replication_the_master_sends_one_copy() {
    for workers in [1, 8, 32] {
        let (alone, relayed) = (distribute(&setup(workers, false)), distribute(&setup(workers, true)));
        assert!((alone.master_copies - f64::from(workers)).abs() < 1e-9, "{alone:?}");
        assert!((relayed.master_copies - 1.0).abs() < 1e-9, "{relayed:?}");
        assert_eq!((alone.workers, relayed.workers), (workers, workers));
        assert!(relayed.seconds < 1.3, "{workers}: {relayed:?}");
        assert!(workers < 8 || alone.seconds > 5.0 * relayed.seconds, "{alone:?} {relayed:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn every_live_worker_gets_the_asset_despite_failures(seed: u64, exits in 0..4u32, hangs in 0..3u32) {
        let setup = DistributionSetup { exits, hangs, seed, asset_bytes: 20_000_000, ..setup(32, true) };
        let relayed = distribute(&setup);
        prop_assert_eq!(relayed.workers, live_workers(&setup));
        // The first copy, and at worst the rest of another one for each failed worker.
        prop_assert!(relayed.master_copies <= f64::from(1 + exits + hangs) + 0.1, "{:?}", relayed);
        prop_assert!(relayed.seconds < 8.0, "{:?}", relayed);
    }
}

#[test]
fn two_failures_cost_less_than_two_more_copies() {
    for seed in 0..20 {
        let relayed = distribute(&DistributionSetup { exits: 1, hangs: 1, seed, ..setup(32, true) });
        assert!(relayed.master_copies < 3.0, "{relayed:?}");
    }
}
