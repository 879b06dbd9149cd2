//! The quality controller over a simulated farm, whose frames take the longer of render threads and wire.

use std::collections::VecDeque;
use std::time::Duration;

use glam::{DVec3, Vec3};
use rayfarm_farm::accounting::{Parts, WorkerAccount};
use rayfarm_farm::testing::test_scene;
use rayfarm_tracer::scene::{
    Attenuation, ColorDepth, FrameView, Light, LightKind, RenderScale, Shading, Sphere,
};

use super::*;
use crate::measure::simulator::Rng;
use crate::measure::tradeoff::ladder::ladder as measured_ladder;
use crate::measure::tradeoff::table::Table;

const ROOM: &[u8] = include_bytes!("../../../../models/tradeoff/room.csv");
const SETTLING: usize = 300;

/// A farm that renders the requests of a quality controller, in an animation.
struct Simulation {
    controller: QualityController,
    /// Seconds of the full picture: of the threads and of the wire.
    threads: f64,
    wire: f64,
    noise: f64,
    dice: Rng,
    now: Duration,
    in_flight: VecDeque<(QualityMode, Rung)>,
}

impl Simulation {
    fn new(ladder: Ladder, target_fps: f64, threads: f64, wire: f64) -> Self {
        let controller = QualityController::new(ladder, target_fps, true);
        let mut simulation = Self {
            controller,
            threads,
            wire,
            noise: 0.0,
            dice: Rng::new(1),
            now: Duration::ZERO,
            in_flight: VecDeque::new(),
        };
        (0..2).for_each(|_| simulation.request());
        simulation
    }

    fn request(&mut self) {
        let mode = self.controller.next(self.now);
        let rung = *self.controller.rung(mode).unwrap();
        self.in_flight.push_back((mode, rung));
    }

    /// Renders a frame. Returns its setting and its time in seconds.
    fn frame(&mut self) -> (Rung, f64) {
        let (mode, rung) = self.in_flight.pop_front().unwrap();
        let noise = 1.0 + self.noise * (2.0 * self.dice.fraction() - 1.0);
        let busy = self.threads * rung.cost * noise;
        let took = busy.max(self.wire * rung.wire * noise);
        let nanos = |seconds: f64| (seconds * 1e9) as u64;
        let parts = Parts { trace: nanos(busy), send: nanos(took - busy), ..Parts::default() };
        let worker = WorkerAccount { parts, ..WorkerAccount::default() };
        let account = FrameAccount { workers: vec![worker], segments: Vec::new() };
        let requested_at = self.now;
        self.now += Duration::from_secs_f64(took);
        self.controller.finished(self.now, Duration::from_secs_f64(took), mode, requested_at, &account);
        self.request();
        (rung, took)
    }

    fn frames(&mut self, count: usize) -> Vec<(Rung, f64)> {
        (0..count).map(|_| self.frame()).collect()
    }

    fn lines(&self) -> Vec<String> {
        self.controller.lines(self.in_flight.back().unwrap().0)
    }
}

fn wanted(samples: u32) -> ViewRequest {
    ViewRequest { view: FrameView { samples, ..test_scene::view() }, scale: RenderScale::Full }
}

/// The general ladder of a scene with shadows and highlights.
fn general(samples: u32) -> Ladder {
    let mut scene = test_scene::scene();
    let kind = LightKind::Point { position: DVec3::Y };
    scene.lights = vec![Light {
        kind,
        color: Vec3::ONE,
        attenuation: Attenuation::None,
        shadows: true,
        radius: 0.0,
        shadow_samples: None,
    }];
    scene.materials[0].specular = Vec3::ONE;
    scene.spheres = vec![Sphere {
        center: DVec3::ZERO,
        radius: 1.0,
        material: 0,
        inside_out: false,
        uv_rotate: DVec3::ZERO,
    }];
    prior_ladder(&scene, &wanted(samples))
}

fn room(samples: u32) -> Ladder {
    measured_ladder(&Table::parse(ROOM).unwrap(), &wanted(samples)).unwrap()
}

fn changes(frames: &[(Rung, f64)]) -> usize {
    frames.windows(2).filter(|pair| pair[0].0.setting != pair[1].0.setting).count()
}

#[test]
fn a_slow_wire_reduces_only_knobs_that_save_bytes() {
    for (wire, seed) in
        [0.06, 0.1, 0.2, 0.4].into_iter().flat_map(|wire| (0..5).map(move |seed| (wire, seed)))
    {
        let mut simulation = Simulation::new(general(1), 30.0, 0.01, wire);
        (simulation.noise, simulation.dice) = (0.1, Rng::new(seed));
        simulation.frames(SETTLING);
        let frames = simulation.frames(1000);
        assert_eq!(changes(&frames), 0, "{wire}, {seed}");
        let (rung, took) = frames[999];
        assert!(
            rung.setting.quality.shadows && rung.setting.quality.shading == Shading::Full,
            "{wire}: {rung:?}"
        );
        assert!(rung.wire < 0.6 && took < 1.1 / 30.0, "{wire}: {took} at {rung:?}");
    }
}

#[test]
fn where_the_smallest_scale_is_not_enough_colours_are_reduced_before_shadows_are_dropped() {
    let mut simulation = Simulation::new(general(1), 30.0, 0.01, 0.6);
    simulation.frames(SETTLING);
    let (rung, took) = simulation.frame();
    assert_eq!(
        (rung.setting.quality.colors, rung.setting.scale),
        (ColorDepth::Reduced, RenderScale::Quarter)
    );
    assert!(rung.setting.quality.shadows && took < 1.0 / 30.0, "{took} at {rung:?}");
}

#[test]
fn the_bottleneck_is_named_with_the_loss() {
    let mut slow_wire = Simulation::new(general(1), 30.0, 0.01, 0.2);
    slow_wire.frames(SETTLING);
    // Within the target the wait for the wire is within the budget; out of reach, it is not.
    slow_wire.wire = 5.0;
    slow_wire.frames(SETTLING);
    let lines = slow_wire.lines();
    assert!(lines[0].starts_with("moving: loses about FLIP 0."), "{lines:?}");
    assert_eq!(lines[1..], ["by the general table", "30 FPS: out of reach", "waits for the wire"]);

    let mut slow_threads = Simulation::new(room(16), 30.0, 20.0, 0.01);
    slow_threads.frames(SETTLING);
    let lines = slow_threads.lines();
    assert_eq!(lines[1..], ["by the scene's table", "30 FPS: out of reach", "waits for render threads"]);
}

#[test]
fn the_controller_follows_a_wire_that_becomes_slow_and_fast_again() {
    let mut simulation = Simulation::new(general(1), 30.0, 0.04, 0.005);
    simulation.frames(SETTLING);
    let before = simulation.frame().0;
    assert!(before.wire > 0.2, "{before:?}");
    simulation.wire = 0.3;
    simulation.frames(SETTLING);
    let (slow, took) = simulation.frame();
    assert!(took < 1.05 / 30.0 && slow.setting.quality.shadows, "{took} at {slow:?}");
    simulation.wire = 0.005;
    let last = *simulation.frames(2 * SETTLING).last().unwrap();
    assert!(last.1 < 1.05 / 30.0, "{last:?}");
}

/// Without shadows the room looks very different, so at 60 frames a second they stay as long as any setting with shadows
/// holds.
#[test]
fn the_room_keeps_its_shadows_while_a_setting_with_shadows_holds_the_rate() {
    let target = 1.0 / 60.0;
    for samples in [1, 4, 9, 16] {
        let ladder = room(samples);
        let shadowed = ladder.rungs().iter().filter(|rung| rung.setting.quality.shadows);
        let cheapest = shadowed.map(|rung| rung.cost).fold(1.0, f64::min);
        assert!(ladder.rungs().iter().any(|rung| rung.setting.scale == RenderScale::Quarter));
        for share in [0.2, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 50.0] {
            let threads = target * share;
            if threads * cheapest > 0.7 * target {
                continue;
            }
            for wire in [0.001, 0.8 * threads] {
                let mut simulation = Simulation::new(ladder.clone(), 60.0, threads, wire);
                simulation.noise = 0.1;
                let frames = simulation.frames(1000);
                let dark = frames.iter().filter(|(rung, _)| !rung.setting.quality.shadows).count();
                assert_eq!(dark, 0, "{samples} samples, {threads} s of threads, {wire} s of wire");
            }
        }
    }
}
