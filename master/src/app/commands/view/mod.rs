//! `view`: displays on their threads over a viewer on the runtime.

mod displays;

use std::sync::Arc;

use rayfarm_farm::as_text;
use rayfarm_farm::{Farm, FarmControl, FarmScene};
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;

use displays::OpenDisplays;

use super::interrupt::cancelled_by_signals;
use super::observability::Observability;
use super::quality::view_quality;
use super::source::{Source, animation, default_scene};
use crate::app::cli::ViewArgs;
use crate::app::control::Console;
use crate::app::picture::DENOISE_NEEDS_PATHS;
use crate::app::trust;
use crate::display::SceneInfo;
use crate::error::CommandError;
use crate::viewer::edits::{EditorHandle, SceneEditor};
use crate::viewer::film::passes::has_passes;
use crate::viewer::{
    CameraControl, FrameLogFile, RequestPolicy, Statistics, Viewer, ViewerConfig, ViewerHandle,
};

/// Frames of one turn of `--orbit` without `--frames`.
const FRAMES_PER_ORBIT: u32 = 360;

/// Shows a scene until the user ends it, or `--frames` are complete.
///
/// # Errors
/// A wrong scene; no display; a farm that cannot listen or go on.
pub(super) fn run(args: ViewArgs) -> Result<(), CommandError> {
    let path = args.scene.clone().map_or_else(default_scene, Ok)?;
    // Before the scene is compiled, which can take minutes.
    OpenDisplays::check_build(&args.display, &path)?;
    let source = Source::load(&path, args.models, args.picture.size)?;
    let requested = source.request(&args.picture)?;
    let animation = animation(&args.picture, args.frames.unwrap_or(FRAMES_PER_ORBIT));
    let (request, controller) =
        view_quality(&args.quality_control, &source, requested, animation.is_moving())?;
    let view = request.view;
    if args.denoise && !has_passes(&view) {
        return Err(CommandError::WrongInput(DENOISE_NEEDS_PATHS.to_owned()));
    }
    let compiled = source.compiled()?;
    let info = SceneInfo {
        name: source.name.clone(),
        triangles: compiled.triangle_count(),
        local_workers: args.farm.local_workers(),
    };
    let camera = CameraControl::new(view.camera, compiled.bounds());
    drop(compiled);
    let record_bytes = args.observability.record_bytes();
    let log = args.fps_log.as_deref().map(|path| FrameLogFile::create(path, record_bytes)).transpose()?;
    let mut observability = Observability::new(&args.observability)?;
    let displays = OpenDisplays::open(&args.display, &args.farm, &info, (view.width, view.height), &path)?;

    let limit = args.frames.map(u64::from);
    // A number of frames is for measuring: they are rendered although nothing changes.
    let policy = RequestPolicy { animation, limit, continuous: args.continuous || limit.is_some() };
    let denoised = args.denoise;
    let config = ViewerConfig { request, camera, policy, log, controller, denoised };
    let runtime = super::runtime()?;
    let interrupted = runtime.block_on(async { cancelled_by_signals() });
    let stop = interrupted.child_token();
    let quit = stop.clone();
    let Started { viewer, handle, control, editor } =
        runtime.block_on(start(&args, source, config, &observability, &stop))?;
    let _announced = runtime.block_on(async { trust::announce(&args.farm, handle.entrance(), &stop) });
    let statistics = handle.statistics_receiver();
    let rendering = runtime.spawn(async move {
        let (farm, result) = viewer.run(&stop).await;
        farm.shut_down().await;
        result
    });
    let console = Console::new(control.clone(), Some(handle.knob_sender()), quit).with_editor(editor);
    let shown = displays.run(handle, &console).map_err(CommandError::from);
    let rendered = runtime.block_on(rendering).map_err(CommandError::failed)?;
    rendered.map_err(CommandError::from).and(shown).and(observability.end())?;
    check_frames(&control)?;
    check_count(&args, &statistics, &interrupted)
}

/// A farm with a viewer over it.
struct Started {
    viewer: Viewer,
    handle: ViewerHandle,
    control: FarmControl,
    /// `None` where the scene cannot be edited.
    editor: Option<EditorHandle>,
}

/// Starts the farm and a viewer over it.
async fn start(
    args: &ViewArgs,
    source: Source,
    config: ViewerConfig,
    observability: &Observability,
    stop: &CancellationToken,
) -> Result<Started, CommandError> {
    let editor = editor(&source, args);
    let scene = FarmScene { scene: source.scene, meshes: source.meshes, textures: source.textures };
    let security = trust::security(&args.farm)?;
    let farm = Farm::start(args.farm.options(security), scene).await.map_err(CommandError::failed)?;
    if let Some(frames) = args.frames {
        farm.expect_frames(frames.into());
    }
    let control = farm.control();
    let (viewer, handle) = Viewer::interactive(farm, config);
    let knobs = handle.knob_sender();
    let editor = editor
        .map(|editor| EditorHandle::start(editor, knobs.clone()))
        .transpose()
        .map_err(CommandError::failed)?;
    observability.begin(viewer.farm(), Some((knobs, editor.clone())), stop)?;
    Ok(Started { viewer, handle, control, editor })
}

/// The editor of the scene, which also watches its files. Where there is none, the scene is shown as it is.
fn editor(source: &Source, args: &ViewArgs) -> Option<SceneEditor> {
    let is_scene = source.path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    let bare = (!is_scene).then(|| args.models.load_options(args.picture.size));
    let editor = SceneEditor::new(&source.path, source.loader.clone(), &source.scene, bare);
    editor.inspect_err(|error| tracing::warn!("the scene cannot be edited: {error}")).ok()
}

/// Fails if frames were shown that have rows of workers which sent wrong pixels.
fn check_frames(control: &FarmControl) -> Result<(), CommandError> {
    let wrong = control.wrong_frames();
    if wrong.count() == 0 {
        return Ok(());
    }
    Err(CommandError::Failed(format!(
        "{} of the frames that were shown have rows of workers that sent wrong pixels: {}",
        wrong.count(),
        as_text(wrong.runs())
    )))
}

/// Fails if a signal came before all frames of `--frames`. Closing the window is no failure.
fn check_count(
    args: &ViewArgs,
    statistics: &watch::Receiver<Arc<Statistics>>,
    interrupted: &CancellationToken,
) -> Result<(), CommandError> {
    let completed = statistics.borrow().completed;
    match args.frames.map(u64::from) {
        Some(frames) if interrupted.is_cancelled() && completed < frames => {
            Err(CommandError::Interrupted(format!("{completed} of {frames} frames were shown")))
        }
        _ => Ok(()),
    }
}
