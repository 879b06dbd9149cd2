//! Videos as outputs.

use rayfarm_farm::ViewRequest;

use crate::app::cli::RenderArgs;
use crate::app::output::OutputPattern;
use crate::app::plan::Plan;
use crate::app::video::{VideoSettings, VideoWriter};
use crate::error::CommandError;

/// Checks a video before anything is loaded for it.
///
/// # Errors
/// Options that need a file for each frame; a missing encoder.
pub(super) fn check(args: &RenderArgs, pattern: &OutputPattern) -> Result<(), CommandError> {
    let Some((_, format)) = pattern.video() else { return Ok(()) };
    let kept = [(args.resume, "--resume"), (args.skip_existing, "--skip-existing")];
    if let Some((_, option)) = kept.into_iter().find(|(given, _)| *given) {
        return Err(CommandError::WrongInput(format!(
            "{option} keeps the files of single frames, and a video is one file that is written whole: render pictures, as \
             in -o frame-%04d.png, and encode them when all are there, or leave {option} out"
        )));
    }
    if args.farm.verifies() {
        return Err(CommandError::WrongInput(
            "--verify may find a wrong frame after later ones, and frames of a video cannot be replaced: render pictures, as \
             in -o frame-%04d.png, or leave --verify out"
                .to_owned(),
        ));
    }
    format.refusal().map_or(Ok(()), |refusal| Err(CommandError::Failed(refusal)))
}

/// Starts the encoder of the video, if the output is one.
///
/// # Errors
/// A rate that the format does not have; a file or a program that cannot be started.
pub(super) fn start(
    args: &RenderArgs,
    pattern: &OutputPattern,
    request: &ViewRequest,
    plan: &Plan,
) -> Result<Option<VideoWriter>, CommandError> {
    let Some((path, format)) = pattern.video() else { return Ok(None) };
    let settings = VideoSettings {
        format,
        width: request.view.width,
        height: request.view.height,
        // At most as many as --frames allows.
        frames: plan.frames.len() as u32,
        rate: args.fps.unwrap_or_default(),
    };
    VideoWriter::start(path, settings).map(Some).map_err(CommandError::wrong_input)
}
