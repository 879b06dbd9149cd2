//! `view`: a window on the main thread, the farm beside it.

use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

use super::interrupt::cancelled_by_signals;
use super::ladder::turned;
use super::observability::Observability;
use super::source::{Source, animation, default_scene};
use crate::app::cli::ViewArgs;
use crate::app::error::CommandError;
use crate::app::reports::FpsLog;
use crate::delivered::as_text;
use crate::display::window::{About, Display, Link};
use crate::farm::{Farm, FarmScene};
use crate::viewer::camera_control::CameraControl;
use crate::viewer::frame_loop::{self, NewsDesk, Orders};
use crate::viewer::requests::{Pace, WindowState};

/// `--orbit` without `--frames` goes round over this many frames, and on.
const FRAMES_PER_ORBIT: u32 = 360;

/// Shows a scene until the user has seen enough, or `--frames` are done.
///
/// # Errors
/// A wrong scene; no display; a farm that cannot listen or go on.
pub(super) fn run(args: ViewArgs) -> Result<(), CommandError> {
    let path = args.scene.clone().map_or_else(default_scene, Ok)?;
    let source = Source::load(&path, args.models, args.picture.size)?;
    let asked = source.wanted(&args.picture)?;
    let animation = animation(&args.picture, args.frames.unwrap_or(FRAMES_PER_ORBIT));
    let (picture, quality_controller) = turned(&args.quality_control, &source, asked, animation.is_moving())?;
    let view = picture.view;
    let compiled = source.compiled()?;
    let about = About {
        name: source.name.clone(),
        triangles: compiled.triangle_count(),
        local_workers: args.farm.local_workers(),
    };
    let camera = CameraControl::new(view.camera, compiled.bounds());
    drop(compiled);
    let log = args.fps_log.as_deref().map(FpsLog::create).transpose()?;
    let mut observability = Observability::new(&args.observability)?;
    let display = Display::open(about, view.width, view.height).map_err(|problem| {
        CommandError::Failed(format!(
            "cannot open a window: {problem}; without a display, run: rayfarm-master render {} -o picture.png",
            path.display()
        ))
    })?;

    let runtime = super::runtime()?;
    let (wanted, wishes) = watch::channel(WindowState { picture, hidden: false });
    let limit = args.frames.map(u64::from);
    // A number of frames is for measuring: they are rendered although nothing changes.
    let pace = Pace { animation, limit, continuous: args.continuous || limit.is_some() };
    let orders = Orders { wanted: wishes, pace, log, controller: quality_controller };
    let interrupted = runtime.block_on(async { cancelled_by_signals() });
    let stop = interrupted.child_token();
    let (link, farm) = runtime.block_on(start(&args, source, wanted, orders, &observability, stop))?;
    let shown = display.run(picture, camera, &link).map_err(CommandError::Failed);
    let ended = runtime.block_on(farm).map_err(CommandError::failed)?;
    ended.and(shown).and(observability.end()).and_then(|()| all_shown(&args, &link, &interrupted))
}

/// Starts the farm and the task that keeps it busy.
async fn start(
    args: &ViewArgs,
    source: Source,
    wanted: watch::Sender<WindowState>,
    orders: Orders,
    observability: &Observability,
    stop: CancellationToken,
) -> Result<(Link, JoinHandle<Result<(), CommandError>>), CommandError> {
    let scene = FarmScene { scene: source.scene, meshes: source.meshes, textures: source.textures };
    let farm = Farm::start(args.farm.options(), scene).await.map_err(CommandError::failed)?;
    if let Some(frames) = args.frames {
        farm.expect_frames(frames.into());
    }
    observability.begin(&farm, &stop)?;
    let link = Link { wanted, desk: NewsDesk::new(), control: farm.control(), address: farm.address(), stop };
    let task = tokio::spawn(frame_loop::run(farm, orders, link.desk.clone(), link.stop.clone()));
    Ok((link, task))
}

/// Who closes the window has seen enough; a signal may come before all frames that were asked for.
fn all_shown(args: &ViewArgs, link: &Link, interrupted: &CancellationToken) -> Result<(), CommandError> {
    let wrong = link.control.wrong_frames();
    if wrong.count() > 0 {
        return Err(CommandError::Failed(format!(
            "{} of the frames that were shown have rows of workers that sent wrong pixels: {}",
            wrong.count(),
            as_text(wrong.runs())
        )));
    }
    match args.frames.map(u64::from) {
        Some(frames) if interrupted.is_cancelled() && link.desk.completed() < frames => {
            Err(CommandError::Interrupted(format!("{} of {frames} frames were shown", link.desk.completed())))
        }
        _ => Ok(()),
    }
}
