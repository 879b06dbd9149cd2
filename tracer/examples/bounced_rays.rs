//! Writes the secondary rays of a scene to a file, or times the rays of such a file.
//!
//! `cargo run --release --example bounced_rays -p rayfarm-tracer -- dump SCENE FILE --rays N` renders the scene and writes about N
//! of its reflected and transmitted rays: runs of sixteen in the order in which they are traced, evenly spread over the
//! picture. A ray has six little-endian `f32`: origin and unit direction in world space. The origin is moved off the surface
//! that the ray starts on, by 10^-4 of the diagonal of the models, so that no tracer needs to know this surface.
//!
//! `bounced_rays time SCENE FILE [--hits FILE]` traces the rays against the models and triangles of a scene, on one thread, and
//! prints one line of JSON: numbers of rays and of hits, and nanoseconds per ray for the closest hit and any hit of single
//! rays and of sixteen rays together. Of several passes, `median_ns` is the median of their times; `min_ns` takes for each 1,024
//! rays the pass that was fastest there: other work of the machine hardly changes it. `--hits` writes the distance of each hit as `f32`, -1 without a hit.

use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use glam::{DVec3, Vec3};
use rayfarm_tracer::scene::{self, FrameView, LoadedScene};
use rayfarm_tracer::{CompiledScene, PreparedFrame, RaySegment, Stage, Watch, render_rows_watched};

/// Number of passes over all rays per measurement.
const REPEATS: usize = 9;

/// Rays that are timed together.
const TIMED: usize = 1024;

/// Rays that are traced together.
const TOGETHER: usize = 16;

/// Part of the diagonal of the models by which origins are moved.
const MOVED: f64 = 1e-4;

const USAGE: &str =
    "usage: bounced_rays dump SCENE FILE [--rays N]\n       bounced_rays time SCENE FILE [--hits FILE]";

type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments[..] {
        ["dump", scene, file] => dump(scene, file, 200_000),
        ["dump", scene, file, "--rays", count] => dump(scene, file, count.parse()?),
        ["time", scene, file] => time(scene, file, None),
        ["time", scene, file, "--hits", hits] => time(scene, file, Some(hits)),
        _ => Err(USAGE.into()),
    }
}

/// Collects secondary rays, each generation of a tile as it is traced.
#[derive(Default)]
struct Collected(Vec<RaySegment>);

impl Watch for Collected {
    fn enter(&mut self, _: Stage) {}

    fn secondary_rays(&mut self, rays: impl Iterator<Item = RaySegment>) {
        self.0.extend(rays);
    }
}

fn dump(scene: &str, file: &str, count: usize) -> Outcome<()> {
    let frame = prepared(scene::load(Path::new(scene))?)?;
    let (lo, hi) = frame.bounds().ok_or("the scene has no model")?;
    let moved = MOVED * (hi - lo).length();
    let mut collected = Collected::default();
    let mut pixels = vec![0; frame.row_bytes() * frame.height() as usize];
    render_rows_watched(&frame, 0..frame.height(), &mut pixels, &|| false, &mut collected)?;
    let runs = collected.0.chunks_exact(TOGETHER);
    let step = (runs.len() * TOGETHER).div_ceil(count.max(1)).max(1);
    let mut bytes = Vec::new();
    for ray in runs.step_by(step).flatten() {
        let direction = ray.direction.normalize();
        let numbers = (ray.origin + direction * moved).as_vec3().to_array().into_iter();
        numbers.chain(direction.as_vec3().to_array()).for_each(|number| bytes.extend(number.to_le_bytes()));
    }
    println!("{{\"secondary\":{},\"written\":{}}}", collected.0.len(), bytes.len() / 24);
    Ok(std::fs::write(file, bytes)?)
}

fn time(scene: &str, file: &str, hits_file: Option<&str>) -> Outcome<()> {
    let mut loaded = scene::load(Path::new(scene))?;
    loaded.scene.spheres.clear();
    loaded.scene.disks.clear();
    loaded.scene.planes.clear();
    let frame = prepared(loaded)?;
    let rays = read(file)?;
    let single = |ray: &RaySegment| frame.closest_hit(ray.origin, ray.direction, f64::INFINITY);
    let distance = |ray: &RaySegment| single(ray).map_or(-1.0, |hit| hit.t) as f32;
    let hits: Vec<f32> = rays.iter().map(distance).collect();
    if let Some(path) = hits_file {
        std::fs::write(path, hits.iter().flat_map(|t| t.to_le_bytes()).collect::<Vec<u8>>())?;
    }
    let measures = [
        ("closest", times(&rays, |rays| rays.iter().filter_map(single).count())),
        ("closest_sixteen", times(&rays, |rays| frame.closest_hits(rays).iter().flatten().count())),
        ("any", {
            let any = |ray: &&RaySegment| frame.any_hit(ray.origin, ray.direction, f64::INFINITY);
            times(&rays, |rays| rays.iter().filter(any).count())
        }),
        ("any_sixteen", times(&rays, |rays| frame.any_hits(rays).count_ones() as usize)),
    ];
    let hit = hits.iter().filter(|t| **t >= 0.0).count();
    let ns = measures.map(|(name, [least, median])| {
        format!("\"{name}\":{{\"min_ns\":{least:.2},\"median_ns\":{median:.2}}}")
    });
    println!("{{\"rays\":{},\"hits\":{hit},{}}}", rays.len(), ns.join(","));
    Ok(())
}

fn prepared(loaded: LoadedScene) -> Outcome<PreparedFrame> {
    let view = FrameView::of(&loaded.scene);
    let compiled = Arc::new(CompiledScene::new(loaded.scene, loaded.meshes, loaded.textures)?);
    Ok(PreparedFrame::new(compiled, &view)?)
}

fn read(file: &str) -> Outcome<Vec<RaySegment>> {
    let bytes = std::fs::read(file)?;
    let (rays, rest) = bytes.as_chunks::<24>();
    if !rest.is_empty() || rays.is_empty() {
        return Err(format!("{file}: rays of 24 bytes are expected").into());
    }
    let vector = |ray: &[u8; 24], first: usize| -> DVec3 {
        let (numbers, _) = ray.as_chunks::<4>();
        let [x, y, z] = [0, 1, 2].map(|axis| f32::from_le_bytes(numbers[first + axis]));
        Vec3::new(x, y, z).as_dvec3()
    };
    let segment = |ray| RaySegment {
        origin: vector(ray, 0),
        direction: vector(ray, 3),
        t_max: f64::INFINITY,
        starts_on: None,
    };
    Ok(rays.iter().map(segment).collect())
}

/// Least and median time per ray in nanoseconds, of rays that are traced sixteen by sixteen.
fn times(rays: &[RaySegment], trace: impl Fn(&[RaySegment]) -> usize) -> [f64; 2] {
    let timed = |rays: &[RaySegment]| {
        let started = Instant::now();
        black_box(rays.chunks(TOGETHER).map(&trace).sum::<usize>());
        started.elapsed().as_secs_f64()
    };
    let mut least = vec![f64::INFINITY; rays.len().div_ceil(TIMED)];
    let mut passes = [0.0; REPEATS];
    for pass in &mut passes {
        for (least, rays) in least.iter_mut().zip(rays.chunks(TIMED)) {
            let seconds = timed(rays);
            *least = least.min(seconds);
            *pass += seconds;
        }
    }
    passes.sort_unstable_by(f64::total_cmp);
    [least.iter().sum(), passes[REPEATS / 2]].map(|seconds| seconds * 1e9 / rays.len() as f64)
}
