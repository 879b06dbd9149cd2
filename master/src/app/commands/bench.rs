//! `bench`: the tracer alone, in one process: the upper bound of a farm with one worker.

use std::io::{self, Write};
use std::sync::Arc;
use std::time::{Duration, Instant};

use rayfarm_farm::ViewRequest;
use rayfarm_tracer::image::RgbImage;
use rayfarm_tracer::scene::FrameView;
use rayfarm_tracer::{CompiledScene, PreparedFrame, RayCounts};

use super::source::{Source, animation};
use crate::app::cli::BenchArgs;
use crate::app::reports::{BenchReport, Knobs, MsPerFrame, print_json};
use crate::display::numbers::{counted, grouped};
use crate::error::CommandError;
use crate::in_process::{all_cores, trace};
use crate::quantile::round_to_us;
use crate::viewer::frame_counts::RaysPerFrame;

/// Measures the frames of a scene and prints the figures on standard output.
///
/// # Errors
/// A wrong scene.
pub(super) fn run(args: &BenchArgs) -> Result<(), CommandError> {
    let started = Instant::now();
    let source = Source::load(&args.scene, args.models, args.picture.size)?;
    let request = source.request(&args.picture)?;
    let view = request.rendered();
    let scene = Arc::new(source.compiled()?);
    let load = started.elapsed();
    let threads = args.threads.unwrap_or_else(all_cores);
    let animation = animation(&args.picture, args.frames);

    let mut bench = Bench::new(scene, request, threads);
    bench.frame(&view)?; // warms caches and page tables
    bench.reset();
    for index in 0..u64::from(args.frames) {
        bench.frame(&animation.view(&view, index))?;
    }
    let report = bench.report(load);
    if args.json { print_json(&report) } else { print_table(&report) }
}

struct Bench {
    scene: Arc<CompiledScene>,
    request: ViewRequest,
    threads: usize,
    /// The newest frame, in the size in which it is delivered.
    picture: RgbImage,
    times: Vec<Duration>,
    rays: RayCounts,
}

impl Bench {
    fn new(scene: Arc<CompiledScene>, request: ViewRequest, threads: usize) -> Self {
        let picture = RgbImage::new(0, 0);
        Self { scene, request, threads, picture, times: Vec::new(), rays: RayCounts::default() }
    }

    /// Renders and times one frame: preparation for its camera, tracing, and enlargement where it is traced at a smaller scale.
    fn frame(&mut self, view: &FrameView) -> Result<(), CommandError> {
        let mut picture = std::mem::replace(&mut self.picture, RgbImage::new(0, 0));
        if (picture.width, picture.height) != (view.width, view.height) {
            picture = RgbImage::new(view.width, view.height);
        }
        let started = Instant::now();
        let frame = PreparedFrame::new(Arc::clone(&self.scene), view).map_err(CommandError::failed)?;
        let rays = trace(&frame, &mut picture.pixels, self.threads, &|| false, &|_| ())
            .map_err(|_| CommandError::Failed("the tracer stopped without being cancelled".to_owned()))?;
        self.picture = self.request.delivered(picture).map_err(CommandError::failed)?;
        self.times.push(started.elapsed());
        self.rays += rays;
        Ok(())
    }

    fn reset(&mut self) {
        self.times.clear();
        self.rays = RayCounts::default();
    }

    fn report(&self, load: Duration) -> BenchReport {
        let view = &self.request.view;
        let frames = u32::try_from(self.times.len()).unwrap_or(u32::MAX);
        let RayCounts { primary, shadow, secondary, .. } = self.rays;
        let rays = RaysPerFrame { primary, shadow, secondary };
        let seconds = self.times.iter().sum::<Duration>().as_secs_f64();
        BenchReport {
            frames,
            width: view.width,
            height: view.height,
            samples: view.samples,
            quality: Knobs::of(self.request.setting()),
            threads: self.threads,
            triangles: self.scene.triangle_count(),
            load_ms: round_to_us(load),
            rays_per_frame: rays.mean(frames),
            ms_per_frame: MsPerFrame::of(&self.times),
            rays_per_second: if seconds > 0.0 { rays.total() as f64 / seconds } else { 0.0 },
            blake3: blake3::hash(&self.picture.pixels).to_hex().to_string(),
        }
    }
}

fn print_table(report: &BenchReport) -> Result<(), CommandError> {
    let BenchReport { ms_per_frame: ms, rays_per_frame: rays, .. } = report;
    let text = format!(
        "{} of {} x {}, {}, {}, {}\n\
         ms per frame: {:.2} median, {:.2} min, {:.2} p95, {:.2} max ({:.1} FPS)\n\
         rays per frame: {} primary, {} shadow, {} secondary; {:.1} million per second\n\
         read and built in {:.0} ms; pixels {}",
        counted(report.frames.into(), "frame"),
        report.width,
        report.height,
        counted(report.samples.into(), "sample"),
        counted(report.triangles, "triangle"),
        counted(report.threads as u64, "thread"),
        ms.median,
        ms.min,
        ms.p95,
        ms.max,
        if ms.median > 0.0 { 1e3 / ms.median } else { 0.0 },
        grouped(rays.primary),
        grouped(rays.shadow),
        grouped(rays.secondary),
        report.rays_per_second / 1e6,
        report.load_ms,
        report.blake3,
    );
    writeln!(io::stdout().lock(), "{text}")
        .map_err(|error| CommandError::Failed(format!("standard output: {error}")))
}
