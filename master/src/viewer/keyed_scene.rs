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

#[cfg(test)]
pub(super) mod tests {
    use rayfarm_tracer::scene::load;

    use super::*;

    /// A camera and a sphere that move by one and by two units a second, at ten frames a second.
    const MOVING: &str = "[camera]\nposition = [0, 0, 9]\nlook_at = [0, 0, 0]\n\
        [[camera_key]]\ntime = 0\nposition = [0, 0, 9]\n[[camera_key]]\ntime = 9\nposition = [9, 0, 9]\n\
        [[sphere]]\nradius = 1\nkey = [{ time = 0, center = [0, 0, 0] }, { time = 9, center = [0, 18, 0] }]\n";

    /// The frames of a scene file.
    pub(in crate::viewer) fn keyed(text: &str) -> (KeyedScene, ViewRequest) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.toml");
        std::fs::write(&path, text).unwrap();
        let loaded = load(&path).unwrap();
        let request = FrameView::of(&loaded.scene).into();
        let scene = FarmScene { scene: loaded.scene, meshes: loaded.meshes, textures: loaded.textures };
        let rate = VideoRate::parse("10").unwrap();
        (KeyedScene::new(loaded.animation.unwrap(), scene, rate), request)
    }

    /// The frames of a camera and a sphere that move.
    pub(in crate::viewer) fn moving() -> (KeyedScene, ViewRequest) {
        keyed(MOVING)
    }

    #[test]
    fn a_frame_has_the_camera_and_the_scene_of_its_time() {
        let (keys, request) = moving();
        let camera = |number| keys.request(&request, number).view.camera.position.x;
        assert!((camera(30) - 3.0).abs() < 1e-12 && camera(0) == 0.0 && camera(999) == 9.0);
        let scene = |number| keys.assets(number).unwrap().unwrap().scene();
        assert_eq!(scene(30), scene(30));
        assert!(scene(30) != scene(31) && scene(90) == scene(1000));
        assert_eq!(keys.check(&request, 45), Ok(()));
    }

    #[test]
    fn a_camera_alone_changes_no_scene() {
        let camera = MOVING.split("[[sphere]]").next().unwrap();
        let (keys, _) = keyed(&format!("{camera}[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n"));
        assert!(keys.assets(5).unwrap().is_none());
    }

    #[test]
    fn an_impossible_frame_is_named() {
        let through = MOVING.replace("position = [9, 0, 9]", "position = [0, 0, -9]");
        let (keys, request) = keyed(&through);
        assert_eq!(keys.check(&request, 44), Ok(()));
        let fault = keys.check(&request, 45).unwrap_err();
        assert!(fault.contains("frame 45 (4.500 s)"), "{fault}");
    }
}
