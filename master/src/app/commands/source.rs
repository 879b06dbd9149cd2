//! Sources of scenes: the file of the command line, or the room from rayfarm's models.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayfarm_farm::ViewRequest;
use rayfarm_tracer::CompiledScene;
use rayfarm_tracer::mesh::CompiledMesh;
use rayfarm_tracer::scene::{
    FrameView, Integrator, LoadLimits, LoadedScene, Scene, SceneAnimation, SceneLoader,
};
use rayfarm_tracer::texture::Texture;

use crate::app::cli::{LightArgs, ModelArgs, PictureArgs, QualityArgs, Size};
use crate::error::CommandError;
use crate::viewer::orbit::Animation;

/// Scene without a file on the command line, in a folder of models.
const DEFAULT_SCENE: &str = "room.toml";
/// Environment variable with the folder of models.
const MODELS_VARIABLE: &str = "RAYFARM_MODELS";

/// A scene with its models and textures, loaded and validated.
pub(super) struct Source {
    /// Name of the file, for titles and messages.
    pub(super) name: String,
    /// Path of the file.
    pub(super) path: PathBuf,
    /// The scene as data.
    pub(super) scene: Scene,
    /// Meshes of its models.
    pub(super) meshes: Vec<Arc<CompiledMesh>>,
    /// Files of the meshes, as the scene names them.
    pub(super) mesh_files: Vec<PathBuf>,
    /// Textures of its materials.
    pub(super) textures: Vec<Arc<Texture>>,
    /// The loader, with the files that it has read.
    pub(super) loader: SceneLoader,
    /// Movements over frames, if the scene has keys.
    pub(super) animation: Option<SceneAnimation>,
}

impl Source {
    /// Loads a scene file or a bare model, for pictures of `size` if that is given. Warnings go to the log.
    ///
    /// # Errors
    /// The mistake in the file, with its line where there is one.
    pub(super) fn load(path: &Path, models: ModelArgs, size: Option<Size>) -> Result<Self, CommandError> {
        let mut loader = SceneLoader::new(models.load_options(size), LoadLimits::default());
        let LoadedScene { scene, meshes, mesh_files, textures, warnings, animation } =
            loader.load(path).map_err(CommandError::wrong_input)?;
        for warning in warnings {
            tracing::warn!("{warning}");
        }
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        Ok(Self { name, path: path.to_owned(), scene, meshes, mesh_files, textures, loader, animation })
    }

    /// Request of the first frame: settings of the scene, overridden by the command line.
    ///
    /// # Errors
    /// A combination that cannot be rendered.
    pub(super) fn request(&self, picture: &PictureArgs) -> Result<ViewRequest, CommandError> {
        self.still_request(picture.size, &picture.light, &picture.quality)
    }

    /// Request of a picture without animation.
    ///
    /// # Errors
    /// A combination that cannot be rendered.
    pub(super) fn still_request(
        &self,
        size: Option<Size>,
        light: &LightArgs,
        options: &QualityArgs,
    ) -> Result<ViewRequest, CommandError> {
        let mut view = light.over(FrameView::of(&self.scene));
        if let Some(size) = size {
            (view.width, view.height) = (size.width, size.height);
        }
        let setting = options.over(view.setting(self.scene.render.scale));
        let view = view.with_setting(&setting);
        view.validate().map_err(CommandError::wrong_input)?;
        warn_about_idle_options(&view, light, options);
        let is_direct = view.integrator == Integrator::Direct;
        if is_direct && options.selects("adaptive", "on") && view.samples == 1 {
            let message = "--adaptive omits samples, but there is only one per pixel: \
                           request more with --samples 4, 9, 16, ..., or leave --adaptive out";
            return Err(CommandError::WrongInput(message.into()));
        }
        Ok(ViewRequest { view, scale: setting.scale })
    }

    /// Compiles the scene for the tracer.
    ///
    /// # Errors
    /// A scene that cannot be traced.
    pub(super) fn compiled(&self) -> Result<CompiledScene, CommandError> {
        let (meshes, textures) = (self.meshes.iter().cloned(), self.textures.iter().cloned());
        CompiledScene::new(self.scene.clone(), meshes, textures).map_err(CommandError::wrong_input)
    }
}

/// Warns about options that have no effect on a view.
fn warn_about_idle_options(view: &FrameView, light: &LightArgs, knobs: &QualityArgs) {
    let reason = match view.integrator {
        Integrator::Direct => "with the direct integrator",
        Integrator::Path(_) => "with the path integrator",
    };
    let of_knobs = knobs.idle_with(&view.integrator).map(|option| (option, reason));
    for (option, reason) in light.idle_on(view).into_iter().chain(of_knobs) {
        tracing::warn!("--{option} has no effect {reason}");
    }
}

/// Animation of a command line, over `frames` frames.
pub(super) fn animation(picture: &PictureArgs, frames: u32) -> Animation {
    Animation { orbit: picture.orbit, spin: picture.spin, frames }
}

/// Scene file without one on the command line.
///
/// # Errors
/// A file that is in none of the folders; the message lists them and the remedy.
pub(super) fn default_scene() -> Result<PathBuf, CommandError> {
    let named = std::env::var_os(MODELS_VARIABLE).map(PathBuf::from);
    let executable = std::env::current_exe().and_then(std::fs::canonicalize).ok();
    find_default(&candidates(named.as_deref(), executable.as_deref()))
}

/// Folders of models to search, in order: the named one (and then no other), the one in the current folder, those next to and
/// above the executable (a build's output is below the checkout).
fn candidates(named: Option<&Path>, executable: Option<&Path>) -> Vec<PathBuf> {
    if let Some(named) = named {
        return vec![named.to_owned()];
    }
    let above = executable.into_iter().flat_map(|path| path.ancestors().skip(1).take(4));
    std::iter::once(Path::new(".")).chain(above).map(|folder| folder.join("models")).collect()
}

fn find_default(folders: &[PathBuf]) -> Result<PathBuf, CommandError> {
    let files: Vec<PathBuf> = folders.iter().map(|folder| folder.join(DEFAULT_SCENE)).collect();
    files.iter().find(|file| file.is_file()).cloned().ok_or_else(|| {
        let places: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
        CommandError::WrongInput(format!(
            "no scene was named, and rayfarm's own is not at {}; \
             name a scene, or set {MODELS_VARIABLE} to rayfarm's folder of models",
            places.join(", ")
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_named_folder_is_the_only_place() {
        let folders = candidates(Some(Path::new("/m")), Some(Path::new("/a/target/release/rayfarm-master")));
        assert_eq!(folders, [Path::new("/m")]);
    }

    #[test]
    fn the_checkout_above_a_build_is_found() {
        let folders = candidates(None, Some(Path::new("/a/target/release/rayfarm-master")));
        let expected = ["./models", "/a/target/release/models", "/a/target/models", "/a/models", "/models"]
            .map(PathBuf::from);
        assert_eq!(folders, expected);
        assert_eq!(candidates(None, None), [Path::new("./models")]);
    }

    #[test]
    fn the_first_existing_file_is_used() {
        let here = tempfile::tempdir().unwrap();
        let there = tempfile::tempdir().unwrap();
        let folders = [here.path().to_owned(), there.path().to_owned()];
        let message = find_default(&folders).unwrap_err().to_string();
        for part in [here.path().join(DEFAULT_SCENE).to_str().unwrap(), MODELS_VARIABLE, "name a scene"] {
            assert!(message.contains(part), "{message}");
        }
        std::fs::write(there.path().join(DEFAULT_SCENE), "").unwrap();
        assert_eq!(find_default(&folders).unwrap(), there.path().join(DEFAULT_SCENE));
        std::fs::write(here.path().join(DEFAULT_SCENE), "").unwrap();
        assert_eq!(find_default(&folders).unwrap(), here.path().join(DEFAULT_SCENE));
    }
}
