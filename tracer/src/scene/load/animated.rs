//! The scene of a file at any time of its animation.

use std::path::{Path, PathBuf};

use super::scene_file::located;
use crate::scene::animation::CameraPath;
use crate::scene::data::{Camera, Scene};
use crate::scene::import::SceneError;
use crate::scene::toml::{self, SceneText};

/// The movements of a scene file: the path of its camera, and objects, groups and lights with keys.
///
/// The scene at a time depends only on the text of the file and on the loaded meshes and textures, so each frame is the same in
/// any order and in any run.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneAnimation {
    path: PathBuf,
    /// Text of the scene file as it was loaded; empty where no object moves.
    text: String,
    camera: CameraPath,
    end: f64,
}

impl SceneAnimation {
    /// The animation of a scene file; `None` where nothing has keys.
    pub(super) fn of(path: &Path, text: &str, read: &SceneText) -> Option<Self> {
        let is_animated = read.moves || !read.camera_path.is_empty();
        is_animated.then(|| Self {
            path: path.to_owned(),
            text: if read.moves { text.to_owned() } else { String::new() },
            camera: read.camera_path.clone(),
            end: read.last_key,
        })
    }

    /// Time of the last key, in seconds.
    pub fn end(&self) -> f64 {
        self.end
    }

    /// Whether objects, groups or lights move, so that each time has another scene.
    pub fn moves_objects(&self) -> bool {
        !self.text.is_empty()
    }

    /// Whether the camera moves.
    pub fn moves_camera(&self) -> bool {
        !self.camera.is_empty()
    }

    /// The camera at a time, in seconds, of a scene whose camera is `base`.
    pub fn camera(&self, base: &Camera, time: f64) -> Camera {
        self.camera.camera(base, time)
    }

    /// The scene at a time, in seconds. `loaded` is the scene of the file at any time; its camera is kept. Meshes and textures are
    /// those of `loaded`.
    ///
    /// # Errors
    /// An object that cannot be placed at that time, such as a sphere that a group stretches.
    pub fn scene(&self, loaded: &Scene, time: f64) -> Result<Scene, SceneError> {
        if !self.moves_objects() {
            return Ok(loaded.clone());
        }
        let read = toml::read(&self.text, time).map_err(|fault| located(&self.path, &self.text, fault))?;
        let scene = posed(loaded, read);
        scene.validate().map_err(|fault| {
            let message = format!("at {time} s of its animation: {fault}");
            SceneError::in_file(&self.path, message)
        })?;
        Ok(scene)
    }
}

/// A scene with the values that may have keys replaced by those of `text`, which is read from the same file.
fn posed(loaded: &Scene, text: SceneText) -> Scene {
    let mut scene = loaded.clone();
    for (model, text) in scene.models.iter_mut().zip(&text.models) {
        (model.translate, model.rotate, model.scale) = (text.translate, text.rotate, text.scale);
        model.group = text.group;
    }
    (scene.spheres, scene.disks, scene.triangles) = (text.spheres, text.disks, text.triangles);
    scene.motions = text.motions;
    if !scene.has_default_light {
        scene.lights = text.lights;
    }
    scene
}
