//! Frames of scenes with keys.

use rayfarm_farm::{FarmScene, ViewRequest};
use rayon::prelude::*;

use crate::app::cli::RenderArgs;
use crate::app::commands::source::Source;
use crate::app::output::OutputPattern;
use crate::app::plan::Plan;
use crate::error::CommandError;
use crate::viewer::KeyedScene;

/// Number of frames of the run: up to the last key where the command line has none, and the output is for many.
pub(super) fn frames(args: &RenderArgs, pattern: &OutputPattern, source: &Source) -> u32 {
    let is_for_many = matches!(pattern, OutputPattern::Sequence { .. } | OutputPattern::Video { .. });
    let until_last_key = source.animation.as_ref().filter(|_| is_for_many);
    let usual =
        until_last_key.map_or(1, |animation| args.fps.unwrap_or_default().frames_until(animation.end()));
    args.frames.unwrap_or(usual)
}

/// The frames of a scene with keys. Warns about a rate without an effect.
pub(super) fn keys(args: &RenderArgs, source: &Source) -> Option<KeyedScene> {
    let Some(animation) = source.animation.clone() else {
        if args.fps.is_some() && OutputPattern::parse(&args.output, 1).is_ok_and(|it| it.video().is_none()) {
            tracing::warn!("--fps has no effect on pictures of a scene without keys");
        }
        return None;
    };
    let loaded = FarmScene {
        scene: source.scene.clone(),
        meshes: source.meshes.clone(),
        textures: source.textures.clone(),
    };
    Some(KeyedScene::new(animation, loaded, args.fps.unwrap_or_default()))
}

/// Checks all frames of a plan before the first one is rendered.
///
/// # Errors
/// The first frame with a camera or an object that is impossible at its time.
pub(super) fn check(
    keys: Option<&KeyedScene>,
    request: &ViewRequest,
    plan: &Plan,
) -> Result<(), CommandError> {
    let Some(keys) = keys else { return Ok(()) };
    let fault = plan.frames.par_iter().find_map_first(|number| keys.check(request, *number).err());
    fault.map_or(Ok(()), |fault| Err(CommandError::WrongInput(fault)))
}
