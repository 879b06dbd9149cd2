//! `tradeoff`: time and error of each setting, as table, plots and pictures in a folder.

use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use rayfarm_tracer::files::write_whole;
use rayfarm_tracer::image::{self, RgbImage};
use rayfarm_tracer::reference::Oracle;
use rayfarm_tracer::scene::{FrameView, Integrator, PathSettings};
use rayfarm_tracer::simd_level;

use super::interrupt::cancelled_by_signals;
use super::runtime;
use super::source::Source;
use crate::app::cli::{LightArgs, QualityArgs, TradeoffArgs};
use crate::app::output::check_writable;
use crate::app::reports::print_json;
use crate::error::CommandError;
use crate::in_process::all_cores;
use crate::measure::tradeoff::measure::{MeasureContext, summary};
use crate::measure::tradeoff::oracle::{ReferenceCheck, affordable_pixels, check_pixels, sample_pixels};
use crate::measure::tradeoff::report::{Report, chart, difference_name, markdown, noise_chart, picture_name};
use crate::measure::tradeoff::setting::MeasuredSetting;
use crate::measure::tradeoff::steps::Steps;
use crate::measure::tradeoff::table::{Row, Table};

/// Table of all settings, written last: where it exists, all other files do.
const TABLE: &str = "tradeoff.csv";
const PAGE: &str = "tradeoff.md";
const PLOTS: [&str; 2] = ["front.svg", "front.png"];
const NOISE_PLOTS: [&str; 2] = ["noise.svg", "noise.png"];
const REFERENCE: &str = "reference.png";

/// Measures a scene and writes the folder, or reads an existing table; prints the Pareto front on standard output.
///
/// # Errors
/// A wrong scene, folder or table; Ctrl-C; a full disk.
pub(super) fn run(args: &TradeoffArgs) -> Result<(), CommandError> {
    match (&args.scene, &args.saved) {
        (_, Some(table)) => show_saved(table, args.json),
        (Some(scene), None) => measure_and_write(scene, args),
        (None, None) => Err(CommandError::WrongInput("expected a scene, or --saved with a table".to_owned())),
    }
}

fn show_saved(path: &Path, json: bool) -> Result<(), CommandError> {
    let table = Table::read(path).map_err(CommandError::wrong_input)?;
    for row in table.rows.iter().filter(|row| MeasuredSetting::named(&row.setting).is_none()) {
        tracing::warn!("{}: unknown setting {}, perhaps of another version", path.display(), row.setting);
    }
    if json { print_json(&table) } else { print(&front(&table)) }
}

fn measure_and_write(scene: &Path, args: &TradeoffArgs) -> Result<(), CommandError> {
    let source = Source::load(scene, args.models, args.size)?;
    let light = LightArgs { integrator: args.integrator, ..LightArgs::default() };
    let view = with_all_samples(source.still_request(args.size, &light, &QualityArgs::default())?.view);
    let scene = Arc::new(source.compiled()?);
    let folder = Folder::open(&args.output)?;
    let runtime = runtime()?;
    let interrupted = runtime.block_on(async { cancelled_by_signals() });
    let cancelled = || interrupted.is_cancelled();
    let threads = args.threads.unwrap_or_else(all_cores);
    let context = MeasureContext { scene, view, threads, cancelled: &cancelled };
    let report = measure(args.repeats, &source, &context, &folder)?;
    folder.write_report(&report)?;
    if args.json {
        return print_json(&report);
    }
    print(&format!("{}the rest is in {}\n", front(&report.table), args.output.join(PAGE).display()))
}

/// The view without a limit of noise, which would end its samples before the measured number.
fn with_all_samples(view: FrameView) -> FrameView {
    match view.integrator {
        Integrator::Path(settings) if settings.max_noise > 0.0 => {
            tracing::info!(
                "max_noise of the scene is left out: settings are measured with all their samples"
            );
            FrameView { integrator: Integrator::Path(PathSettings { max_noise: 0.0, ..settings }), ..view }
        }
        _ => view,
    }
}

fn measure(
    repeats: u32,
    source: &Source,
    context: &MeasureContext,
    folder: &Folder,
) -> Result<Report, CommandError> {
    let steps = Steps::new();
    let settings = MeasuredSetting::applicable(&context.scene.features(), &context.view);
    let reference_view = context.reference_view();
    steps.part(&format!("reference, {} samples", reference_view.samples), context.reference_rows());
    let reference = context.reference(&|rows| steps.done(u64::from(rows)))?;
    folder.save(REFERENCE, &reference)?;
    // The oracle has direct light.
    let reference_check = (reference_view.integrator == Integrator::Direct)
        .then(|| check(source, context, &reference_view, &reference, &steps))
        .transpose()?;
    let mut rows = compare(context, &settings, &reference, folder, &steps)?;
    for (row, times) in rows.iter_mut().zip(time(context, &settings, repeats, &steps)?) {
        (row.median_ms, row.min_ms) = summary(&times);
    }
    let table = Table {
        scene: source.name.clone(),
        width: context.view.width,
        height: context.view.height,
        threads: context.threads,
        simd_level: simd_level().to_owned(),
        rows,
    };
    let front = table.front().into_iter().map(|index| table.rows[index].setting.clone()).collect();
    let reference_samples = reference_view.samples;
    Ok(Report { table, repeats, reference_samples, reference_check, front })
}

/// Compares some pixels of the reference with the tracer in double precision.
fn check(
    source: &Source,
    context: &MeasureContext,
    view: &FrameView,
    reference: &RgbImage,
    steps: &Steps,
) -> Result<ReferenceCheck, CommandError> {
    let pixels = sample_pixels(view.width, view.height, affordable_pixels(&context.scene, view));
    steps.part("reference against the oracle", pixels.len() as u64);
    let oracle = Oracle::new(&source.scene, &source.meshes, &source.textures, view);
    check_pixels(&oracle, reference, &pixels, context.threads, context.cancelled, &|| steps.done(1))
        .ok_or_else(stopped)
}

/// Renders each setting, compares it with the reference, and writes its two pictures.
fn compare(
    context: &MeasureContext,
    settings: &[MeasuredSetting],
    reference: &RgbImage,
    folder: &Folder,
    steps: &Steps,
) -> Result<Vec<Row>, CommandError> {
    steps.part("pictures", settings.len() as u64);
    let one = |setting: &MeasuredSetting| {
        let compared = context.compare(setting, reference)?;
        folder.save(&picture_name(&compared.row.setting), &compared.picture)?;
        folder.save(&difference_name(&compared.row.setting), &compared.errors.picture())?;
        steps.done(1);
        Ok(compared.row)
    };
    settings.iter().map(one).collect()
}

/// Times of each setting, over `repeats` rounds of all settings.
fn time(
    context: &MeasureContext,
    settings: &[MeasuredSetting],
    repeats: u32,
    steps: &Steps,
) -> Result<Vec<Vec<Duration>>, CommandError> {
    steps.part("times", u64::from(repeats) * settings.len() as u64);
    let mut times = vec![Vec::new(); settings.len()];
    for round in 0..repeats {
        context.time_round(settings, &mut times, round % 2 == 1, &|| steps.done(1))?;
    }
    Ok(times)
}

fn stopped() -> CommandError {
    CommandError::Interrupted("no table was written".to_owned())
}

/// Folder of the results.
struct Folder<'a>(&'a Path);

impl<'a> Folder<'a> {
    /// Creates the folder if it does not exist, and checks that it is writable.
    fn open(path: &'a Path) -> Result<Self, CommandError> {
        fs::create_dir_all(path).map_err(|error| {
            CommandError::WrongInput(format!("{}: {error}; name a folder with -o", path.display()))
        })?;
        check_writable(&path.join(TABLE))?;
        Ok(Self(path))
    }

    fn save(&self, name: &str, picture: &RgbImage) -> Result<(), CommandError> {
        image::save(&self.0.join(name), picture).map_err(CommandError::failed)
    }

    fn write(&self, name: &str, bytes: &[u8]) -> Result<(), CommandError> {
        let path = self.0.join(name);
        write_whole(&path, bytes)
            .map_err(|error| CommandError::Failed(format!("{}: {error}", path.display())))
    }

    /// Writes plots, page and, last, the table.
    fn write_report(&self, report: &Report) -> Result<(), CommandError> {
        let chart = chart(report);
        for plot in PLOTS {
            chart.save(&self.0.join(plot)).map_err(CommandError::failed)?;
        }
        if let Some(chart) = noise_chart(report) {
            for plot in NOISE_PLOTS {
                chart.save(&self.0.join(plot)).map_err(CommandError::failed)?;
            }
        }
        self.write(PAGE, markdown(report).as_bytes())?;
        self.write(TABLE, &report.table.to_csv().map_err(CommandError::failed)?)
    }
}

/// Text with a line for each setting on the Pareto front.
fn front(table: &Table) -> String {
    let rows: Vec<&Row> = table.front().into_iter().filter_map(|index| table.rows.get(index)).collect();
    let width = rows.iter().map(|row| row.setting.len()).max().unwrap_or(0);
    let line =
        |row: &&Row| format!("  {:width$} {:9.2} ms  FLIP {:.4}\n", row.setting, row.median_ms, row.flip);
    let lines: String = rows.iter().map(line).collect();
    format!("Pareto front, from the fastest to the best:\n{lines}")
}

fn print(text: &str) -> Result<(), CommandError> {
    io::stdout()
        .lock()
        .write_all(text.as_bytes())
        .map_err(|error| CommandError::Failed(format!("standard output: {error}")))
}
