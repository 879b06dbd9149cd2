//! The checks of `numerics` on the project's own scenes.

use std::path::Path;

use rayfarm_tracer::numerics::{Check, Effort, Outcome, Subject, run};
use rayfarm_tracer::scene::load;

/// Asserts that all checks pass.
fn check(name: &str) -> Vec<Outcome> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models").join(name);
    // The default number of rays of `check-numerics`.
    let effort = Effort { side: 96, oracle_work: 1_000_000, pixels: None, ..Effort::default() };
    let outcomes = run(&Subject::new(name, load(&path).unwrap()), &effort).unwrap();
    let broken: Vec<&Outcome> = outcomes.iter().filter(|outcome| !outcome.holds()).collect();
    assert!(broken.is_empty(), "{name}: {broken:#?}");
    outcomes
}

/// Aims that nearly always miss their target would test nothing.
fn assert_aims_hit(outcomes: &[Outcome], whichever: impl Fn(&Outcome) -> bool) {
    let aimed = outcomes.iter().filter(|outcome| outcome.check == Check::Leaks && whichever(outcome));
    assert!(aimed.clone().count() > 0);
    assert!(aimed.clone().all(|outcome| outcome.at_edges * 2 < outcome.tested), "{outcomes:#?}");
}

#[test]
fn the_product_passes() {
    assert_aims_hit(&check("product.toml"), |_| true);
}

#[test]
fn the_lights_pass() {
    assert_aims_hit(&check("lights.toml"), |_| true);
}

#[test]
fn the_textures_pass() {
    assert_aims_hit(&check("textured.toml"), |_| true);
}

#[test]
fn the_instances_pass() {
    assert_aims_hit(&check("instances.toml"), |_| true);
}

#[test]
fn the_room_passes() {
    // Its leaves and books are so small that at a distance of 10^6 rooms few of them are hit.
    assert_aims_hit(&check("room.toml"), |outcome| !outcome.case.contains("1e6 extents"));
}
