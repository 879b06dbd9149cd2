//! Frames of a scene whose camera or objects have keys.

use std::sync::Arc;

use rayfarm_farm::{Assets, FarmScene, ViewRequest};
use rayfarm_tracer::scene::{FrameView, SceneAnimation};

use super::video_rate::VideoRate;

/// A scene with keys, and the times of its frames.
///
/// Camera and scene of a frame depend on its number only, so it is the same in whatever run, and from wherever that begins.
#[derive(Clone)]
pub(crate) struct KeyedScene(Arc<Keyed>);

struct Keyed {
    animation: SceneAnimation,
    /// The scene as it was loaded, with all meshes and textures.
    loaded: FarmScene,
    rate: VideoRate,
}

impl KeyedScene {
    /// The frames of an animation of a scene, at a rate.
    pub(crate) fn new(animation: SceneAnimation, loaded: FarmScene, rate: VideoRate) -> Self {
        Self(Arc::new(Keyed { animation, loaded, rate }))
    }

    /// `base` with the camera of a frame.
    pub(crate) fn request(&self, base: &ViewRequest, number: u64) -> ViewRequest {
        let Keyed { animation, rate, .. } = &*self.0;
        let camera = animation.camera(&base.view.camera, rate.time(number));
        ViewRequest { view: FrameView { camera, ..base.view }, ..*base }
    }

    /// What workers receive as the scene of a frame; `None` where all frames have the same scene. Meshes and textures have the same
    /// names in all of them, so workers fetch them once.
    ///
    /// # Errors
    /// An object that cannot be placed at that time, or a scene that cannot be sent.
    pub(crate) fn assets(&self, number: u64) -> Result<Option<Arc<Assets>>, String> {
        let Keyed { animation, loaded, rate } = &*self.0;
        if !animation.moves_objects() {
            return Ok(None);
        }
        let scene = animation.scene(&loaded.scene, rate.time(number)).map_err(|error| error.to_string())?;
        let frame = FarmScene { scene, ..loaded.clone() };
        Assets::new(frame).map(Arc::new).map(Some).map_err(|error| error.to_string())
    }

    /// Checks a frame: its camera, and its scene.
    ///
    /// # Errors
    /// The fault, with the number of the frame.
    pub(crate) fn check(&self, base: &ViewRequest, number: u64) -> Result<(), String> {
        let named = |fault: String| format!("frame {number} ({:.3} s): {fault}", self.0.rate.time(number));
        self.request(base, number).view.validate().map_err(|fault| named(fault.to_string()))?;
        self.assets(number).map(drop).map_err(named)
    }
}
