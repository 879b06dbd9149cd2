//! Build times of trees over patterns, compared with the same number of triangles or spheres at random positions.
//!
//! Prints a line per pattern, separated by tabs: its kind, its name, milliseconds (the least of three), and the ratio
//! to the random pattern of its kind. `--count N` sets the number of primitives (default: a million); names of
//! patterns select these. Ends with status 1 where a ratio is above two.

mod common;

use std::f64::consts::TAU;
use std::time::{Duration, Instant};

use glam::{DVec2, DVec3};
use rayfarm_tracer::CompiledScene;
use rayfarm_tracer::mesh::{BuildQuality, CompileOptions, CompiledMesh, Mesh, NamedMaterial};
use rayfarm_tracer::scene::{Background, Camera, CameraKind, Material, RenderSettings, Scene, Sphere};

/// Largest accepted ratio to the random pattern.
const LIMIT: f64 = 2.0;

/// Name of the pattern with which the others are compared.
const RANDOM: &str = "random";

/// Corners of a triangle, from its index and the number of triangles.
type Corners = fn(usize, usize) -> [DVec3; 3];

const MESHES: [(&str, Corners); 11] = [
    (RANDOM, |i, n| small(scattered(i), 1.0 / (n as f64).cbrt())),
    ("row", |i, _| small(DVec3::new(i as f64, 0.0, 0.0), 1.0)),
    ("diagonal row", |i, _| small(DVec3::splat(i as f64), 1.0)),
    ("ribbon", |i, _| {
        let corner = |i: usize| DVec3::new((i / 2) as f64, (i % 2) as f64, 0.0);
        [corner(i), corner(i + 1), corner(i + 2)]
    }),
    ("fan", |i, n| {
        let rim = |i: usize| DVec2::from_angle(i as f64 / n as f64 * TAU).extend(0.0);
        [DVec3::ZERO, rim(i), rim(i + 1)]
    }),
    ("grid", |i, n| {
        let side = (n as f64).sqrt() as usize;
        small(DVec3::new((i % side) as f64, 0.0, (i / side) as f64), 1.0)
    }),
    ("row of powers", |i, n| {
        let at = libm::exp2(i as f64 / n as f64 * 60.0);
        small(DVec3::new(at, 0.0, 0.0), at * 40.0 / n as f64)
    }),
    ("row whose gaps grow", |i, n| small(DVec3::new((i as f64 / n as f64).powi(2), 0.0, 0.0), 1e-6)),
    ("same box", |i, _| [DVec3::ZERO, DVec3::ONE, scattered(i)]),
    ("inside each other", |i, n| small(DVec3::ZERO, (i + 1) as f64 / n as f64)),
    ("same triangle", |_, _| small(DVec3::ZERO, 1.0)),
];

/// Centre and radius of a sphere, from its index and the number of spheres.
type Ball = fn(usize, usize) -> (DVec3, f64);

const SPHERES: [(&str, Ball); 6] = [
    (RANDOM, |i, n| (scattered(i), 0.5 / (n as f64).cbrt())),
    ("row", |i, _| (DVec3::new(i as f64, 0.0, 0.0), 0.4)),
    ("diagonal row", |i, _| (DVec3::splat(i as f64), 0.4)),
    ("cube", |i, n| {
        let side = (n as f64).cbrt() as usize;
        (DVec3::new((i % side) as f64, (i / side % side) as f64, (i / side / side) as f64), 0.3)
    }),
    ("same sphere", |_, _| (DVec3::ZERO, 1.0)),
    ("inside each other", |i, n| (DVec3::ZERO, (i + 1) as f64 / n as f64)),
];

/// Pseudo-random points in a cube.
fn scattered(index: usize) -> DVec3 {
    let number = |salt: u64| {
        let mixed = (index as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(salt as u32 * 21);
        let mixed = (mixed ^ mixed >> 32).wrapping_mul(0xD6E8_FEB8_6659_FD93);
        ((mixed ^ mixed >> 32) >> 11) as f64 / (1_u64 << 53) as f64
    };
    DVec3::new(number(1), number(2), number(3))
}

fn small(at: DVec3, side: f64) -> [DVec3; 3] {
    [at, at + DVec3::new(side, 0.0, side * 0.1), at + DVec3::new(0.0, side, 0.0)]
}

fn main() {
    let (count, names) = arguments();
    let wanted = |name: &str| name == RANDOM || names.is_empty() || names.iter().any(|n| n == name);
    println!("of\tpattern\tms\ttimes as long");
    let mut slow = false;
    for (kind, patterns) in [("triangles", MESHES.len()), ("spheres", SPHERES.len())] {
        let mut random = None;
        for index in 0..patterns {
            let (name, took) = match kind {
                "triangles" if wanted(MESHES[index].0) => {
                    (MESHES[index].0, compile_mesh(MESHES[index].1, count))
                }
                "spheres" if wanted(SPHERES[index].0) => {
                    (SPHERES[index].0, compile_spheres(SPHERES[index].1, count))
                }
                _ => continue,
            };
            let times = took.as_secs_f64() / random.get_or_insert(took).as_secs_f64();
            println!("{kind}\t{name}\t{:.0}\t{times:.2}", took.as_secs_f64() * 1e3);
            slow |= times > LIMIT;
        }
    }
    if slow {
        eprintln!("a pattern takes more than {LIMIT} times as long as random places");
        std::process::exit(1);
    }
}

/// The number of primitives and the names of patterns. Cargo adds `--bench`.
fn arguments() -> (usize, Vec<String>) {
    let (mut count, mut names) = (1_000_000, Vec::new());
    let mut given = std::env::args().skip(1).filter(|argument| argument != "--bench");
    while let Some(argument) = given.next() {
        if argument == "--count" {
            let number = given.next().and_then(|count| count.parse().ok());
            let Some(number) = number.filter(|number| (1..=1_000_000).contains(number)) else {
                eprintln!("--count: a number from 1 to 1000000 is expected");
                std::process::exit(2);
            };
            count = number;
        } else {
            names.push(argument);
        }
    }
    (count, names)
}

/// The least of three times: other load of the machine only adds to a time.
fn least(mut work: impl FnMut()) -> Duration {
    let mut timed = || {
        let started = Instant::now();
        work();
        started.elapsed()
    };
    (0..3).map(|_| timed()).min().unwrap_or_default()
}

fn compile_mesh(corners: Corners, count: usize) -> Duration {
    let positions: Vec<DVec3> = (0..count).flat_map(|index| corners(index, count)).collect();
    let mesh = Mesh {
        triangles: (0..count as u32).map(|index| [3 * index, 3 * index + 1, 3 * index + 2]).collect(),
        triangle_materials: vec![0; count],
        materials: vec![NamedMaterial::plain("any", Material::NEUTRAL)],
        positions,
        ..Mesh::default()
    };
    let options = CompileOptions { normals: false, quality: BuildQuality::Default };
    least(|| {
        if let Err(error) = CompiledMesh::compile_with(&mesh, options) {
            common::stop(&error);
        }
    })
}

fn compile_spheres(ball: Ball, count: usize) -> Duration {
    let sphere = |index| {
        let (center, radius) = ball(index, count);
        Sphere { center, radius, material: 0, inside_out: false, uv_rotate: DVec3::ZERO }
    };
    let scene = Scene {
        ambient: glam::Vec3::ONE,
        render: RenderSettings::default(),
        camera: Camera {
            position: DVec3::ONE,
            look_at: DVec3::ZERO,
            up: DVec3::Y,
            fov: 45.0,
            zoom: 1.0,
            kind: CameraKind::PINHOLE,
        },
        background: Background::Color(glam::Vec3::ZERO),
        lights: vec![],
        materials: vec![Material::NEUTRAL],
        textures: vec![],
        models: vec![],
        spheres: (0..count).map(sphere).collect(),
        planes: vec![],
        triangles: vec![],
        background_visible: true,
        disks: Vec::new(),
        ..Scene::default()
    };
    least(|| {
        if let Err(error) = CompiledScene::new(scene.clone(), [], []) {
            common::stop(&error);
        }
    })
}
