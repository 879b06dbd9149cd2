//! `simulate`: the scheduler with simulated workers, in virtual time.

use std::io::{self, Write};
use std::path::Path;

use rayfarm_tracer::files::read_within;
use serde::Serialize;

use crate::app::cli::{Profile, SimulateArgs};
use crate::error::CommandError;
use crate::measure::simulator::{
    CostProfile, Distribution, DistributionSetup, Measured, Schedule, ScheduleOutcome, Setup, distribute,
    measure, run_schedule,
};

/// Largest file of costs, in bytes.
const MAX_COSTS_BYTES: u64 = 16 << 20;

/// A line of JSON: a setup and its figures.
#[derive(Serialize)]
struct Line<'a> {
    workers: u32,
    threads: u32,
    segment: String,
    pipeline: bool,
    seed: u64,
    #[serde(flatten)]
    measured: &'a Measured,
}

/// A line of JSON about the transfer of an asset to all workers.
#[derive(Serialize)]
struct PassedLine {
    workers: u32,
    seed: u64,
    alone: Distribution,
    passed_on: Distribution,
}

/// A line of JSON about fault schedules without a failure.
#[derive(Serialize)]
struct Survived {
    first_seed: u64,
    schedules: u64,
    workers: u64,
    frames_requested: u64,
    frames_completed: u64,
    hours: f64,
}

/// Runs the simulation and prints its figures on standard output.
///
/// # Errors
/// Costs of rows that cannot be read; a violated invariant, with the command that reproduces it.
pub(super) fn run(args: &SimulateArgs) -> Result<(), CommandError> {
    match (args.faults, args.assets()) {
        (true, _) => run_schedules(args),
        (false, assets) if assets.is_empty() => measure_all(args),
        (false, assets) => pass_all(args, assets),
    }
}

/// Prints the time of a transfer to all workers, and the number of copies that the master sends.
fn pass_all(args: &SimulateArgs, assets: Vec<[DistributionSetup; 2]>) -> Result<(), CommandError> {
    if !args.json {
        print("workers  from the master alone        passed on")?;
    }
    for setups in assets {
        let workers = setups[0].workers;
        let [alone, passed_on] = setups.map(|setup| distribute(&setup));
        if args.json {
            print_line(&PassedLine { workers, seed: args.seed, alone, passed_on })?;
        } else {
            let figures = |p: Distribution| format!("{:8.2} s, {:6.2} copies", p.seconds, p.master_copies);
            print(&format!("{workers:7}  {}   {}", figures(alone), figures(passed_on)))?;
        }
    }
    Ok(())
}

fn measure_all(args: &SimulateArgs) -> Result<(), CommandError> {
    let costs = match (&args.rows, args.costs) {
        (Some(path), _) => read_costs(path)?,
        (None, Profile::Flat) => CostProfile::Flat,
        (None, Profile::Bust) => CostProfile::Bust,
        (None, Profile::Corner) => CostProfile::Corner,
    };
    if !args.json {
        print(
            "workers    FPS   ideal  efficiency  cutting  wasted  leases   idle   tail  frame ms  worst  latency",
        )?;
    }
    for setup in args.setups() {
        let setup = Setup { costs: costs.clone(), ..setup };
        let measured = measure(&setup).ok_or_else(|| {
            CommandError::Failed(format!("{} workers did not finish within an hour", setup.workers))
        })?;
        if args.json { print_line(&line(&setup, &measured))? } else { print(&row(&setup, &measured))? }
    }
    Ok(())
}

fn read_costs(path: &Path) -> Result<CostProfile, CommandError> {
    let refuse = |problem: String| CommandError::WrongInput(format!("{}: {problem}", path.display()));
    let bytes = read_within(path, MAX_COSTS_BYTES).map_err(|error| refuse(error.to_string()))?;
    let bytes = bytes.ok_or_else(|| refuse(format!("has more than {MAX_COSTS_BYTES} bytes, the limit")))?;
    let text =
        String::from_utf8(bytes).map_err(|_| refuse("not UTF-8 text: numbers are expected".to_owned()))?;
    CostProfile::from_text(&text).map_err(refuse)
}

fn line<'a>(setup: &Setup, measured: &'a Measured) -> Line<'a> {
    let Setup { workers, threads, pipeline, seed, .. } = *setup;
    Line { workers, threads, segment: setup.policy.to_string(), pipeline, seed, measured }
}

fn row(setup: &Setup, m: &Measured) -> String {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    format!(
        "{:7} {:6.1} {:7.1}  {:>10}  {:>7}  {:>6}  {:>6} {:>6} {:>6}  {:8.2} {:6.2}  {:7.2}",
        setup.workers,
        m.fps,
        m.ideal_fps,
        percent(m.useful),
        percent(m.cutting),
        percent(m.wasted),
        percent(m.leases),
        percent(m.idle),
        percent(m.idle_tail),
        m.frame_ms,
        m.worst_frame_ms,
        m.latency_ms,
    )
}

fn run_schedules(args: &SimulateArgs) -> Result<(), CommandError> {
    let mut all = ScheduleOutcome::default();
    for seed in (args.seed..).take(usize::try_from(args.schedules).unwrap_or(usize::MAX)) {
        let outcome = run_schedule(Schedule { seed }).map_err(|problem| {
            CommandError::Failed(format!(
                "schedule {seed}: {problem}; to reproduce it: rayfarm-master simulate --faults --seed {seed}"
            ))
        })?;
        all.completed += outcome.completed;
        all.requested += outcome.requested;
        all.workers += outcome.workers;
        all.virtual_ns += outcome.virtual_ns;
    }
    let hours = all.virtual_ns as f64 / 3.6e12;
    if args.json {
        return print_line(&Survived {
            first_seed: args.seed,
            schedules: args.schedules,
            workers: all.workers,
            frames_requested: all.requested,
            frames_completed: all.completed,
            hours,
        });
    }
    print(&format!(
        "{} schedules survived: {} workers, {} frames requested, {} completed, {hours:.1} hours of virtual time",
        args.schedules, all.workers, all.requested, all.completed
    ))
}

fn print_line(line: &impl Serialize) -> Result<(), CommandError> {
    let text = serde_json::to_string(line).map_err(|error| CommandError::Failed(error.to_string()))?;
    print(&text)
}

fn print(line: &str) -> Result<(), CommandError> {
    writeln!(io::stdout().lock(), "{line}")
        .map_err(|error| CommandError::Failed(format!("standard output: {error}")))
}
