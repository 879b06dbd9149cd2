//! The checks of `numerics` on the project's own scenes.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;

use rayfarm_tracer::numerics::{Check, Effort, Outcome, Subject, run};
use rayfarm_tracer::scene::load;

fn check(name: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models").join(name);
    let effort = Effort { rays: 70_000, side: 96, oracle_work: 1_000_000, pixels: None };
    let outcomes = run(&Subject::new(name, load(&path).unwrap()), &effort).unwrap();
    let broken: Vec<&Outcome> = outcomes.iter().filter(|outcome| !outcome.holds()).collect();
    assert!(broken.is_empty(), "{name}: {broken:#?}");
    // An aim that nearly always misses the point tests nothing.
    let aimed = outcomes.iter().filter(|outcome| outcome.check == Check::Leaks);
    assert!(aimed.clone().all(|outcome| outcome.at_edges * 2 < outcome.tested), "{name}: {outcomes:#?}");
}

#[test]
fn the_product_holds() {
    check("product.toml");
}

#[test]
fn the_lights_hold() {
    check("lights.toml");
}

#[test]
fn the_textures_hold() {
    check("textured.toml");
}

#[test]
fn the_instances_hold() {
    check("instances.toml");
}

#[test]
fn the_room_holds() {
    check("room.toml");
}
