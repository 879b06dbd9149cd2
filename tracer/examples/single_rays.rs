//! Times single rays: random ones, from within the bounds of a scene's models in all directions.
//!
//! `cargo run --release --example single_rays -p rayfarm-tracer -- SCENE --rays N --seed S` prints one line of JSON:
//! the number of rays, the number of hits, the mean distance of the hits in world units, and nanoseconds per ray for
//! the closest hit and for any hit, on one thread. Only the scene's models are traced. Rays come from a fixed
//! generator, so that another tracer can trace the same.

use std::error::Error;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;
use rayfarm_tracer::scene::{self, FrameView};
use rayfarm_tracer::{CompiledScene, PreparedFrame};

/// Number of runs per measurement, of which the median counts.
const REPEATS: usize = 7;

const USAGE: &str = "usage: single_rays SCENE [--rays N] [--seed S]";

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::read(std::env::args().skip(1))?;
    let frame = models_only(&arguments.scene)?;
    let bounds = frame.bounds().ok_or("the scene has no model")?;
    let mut random = SplitMix(arguments.seed);
    let rays: Vec<Ray> = (0..arguments.rays).map(|_| random.ray(bounds)).collect();

    let hits: Vec<f64> = rays.iter().filter_map(|ray| closest(&frame, ray)).collect();
    let closest_ns = median_ns(&rays, |ray| closest(&frame, ray).is_some());
    let any_ns = median_ns(&rays, |ray| frame.any_hit(ray.origin, ray.direction, f64::INFINITY));
    println!(
        "{{\"rays\":{},\"hits\":{},\"mean_t\":{:.6},\"ns_per_ray\":{closest_ns:.1},\"ns_per_ray_any_hit\":{any_ns:.1}}}",
        rays.len(),
        hits.len(),
        hits.iter().sum::<f64>() / hits.len().max(1) as f64,
    );
    Ok(())
}

struct Ray {
    origin: DVec3,
    direction: DVec3,
}

fn closest(frame: &PreparedFrame, ray: &Ray) -> Option<f64> {
    frame.closest_hit(ray.origin, ray.direction, f64::INFINITY).map(|hit| hit.t)
}

/// The scene with its models only.
fn models_only(path: &Path) -> Result<PreparedFrame, Box<dyn Error>> {
    let mut loaded = scene::load(path)?;
    loaded.scene.triangles.clear();
    loaded.scene.spheres.clear();
    loaded.scene.planes.clear();
    let view = FrameView::of(&loaded.scene);
    let compiled = Arc::new(CompiledScene::new(loaded.scene, loaded.meshes, loaded.textures)?);
    Ok(PreparedFrame::new(compiled, &view)?)
}

/// Median time per ray, in nanoseconds.
fn median_ns(rays: &[Ray], trace: impl Fn(&Ray) -> bool) -> f64 {
    let mut times: Vec<f64> = (0..REPEATS)
        .map(|_| {
            let started = Instant::now();
            black_box(rays.iter().filter(|ray| trace(ray)).count());
            started.elapsed().as_secs_f64() * 1e9 / rays.len().max(1) as f64
        })
        .collect();
    times.sort_unstable_by(f64::total_cmp);
    times[REPEATS / 2]
}

/// Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014.
struct SplitMix(u64);

impl SplitMix {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1_u32 << 24) as f32
    }

    /// Uniform origins in a box, uniform directions.
    fn ray(&mut self, (lo, hi): (DVec3, DVec3)) -> Ray {
        let mut origin = lo;
        for axis in 0..3 {
            origin[axis] += (hi[axis] - lo[axis]) * f64::from(self.unit());
        }
        loop {
            let [x, y, z] = [(); 3].map(|()| 2.0 * self.unit() - 1.0);
            let squared = x * x + y * y + z * z;
            if 0.0001 < squared && squared <= 1.0 {
                let direction = DVec3::new(x.into(), y.into(), z.into()).normalize();
                return Ray { origin, direction };
            }
        }
    }
}

struct Arguments {
    scene: PathBuf,
    rays: usize,
    seed: u64,
}

impl Arguments {
    fn read(mut words: impl Iterator<Item = String>) -> Result<Self, Box<dyn Error>> {
        let mut arguments = Self { scene: PathBuf::new(), rays: 200_000, seed: 1 };
        while let Some(word) = words.next() {
            match word.as_str() {
                "--rays" => arguments.rays = words.next().ok_or(USAGE)?.parse()?,
                "--seed" => arguments.seed = words.next().ok_or(USAGE)?.parse()?,
                _ => arguments.scene = word.into(),
            }
        }
        if arguments.scene.as_os_str().is_empty() { Err(USAGE.into()) } else { Ok(arguments) }
    }
}
