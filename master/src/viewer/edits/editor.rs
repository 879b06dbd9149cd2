//! The editor of one scene: its text with its history, and the loader that checks each text.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use rayfarm_farm::ViewRequest;
use rayfarm_tracer::files::{FileStamp, read_within, write_whole};
use rayfarm_tracer::scene::{Background, LoadOptions, LoadedScene, Scene, SceneLoader, Up};
use serde_json::{Value as Json, json};

use super::apply::applied;
use super::document::Document;
use super::edit::EditCommand;
use super::files::moved;
use super::history::History;
use crate::viewer::scene_update::view_of;

/// Largest size of a scene file, as of the loader, in bytes.
const MAX_SCENE_BYTES: u64 = 64 << 20;

/// A scene that can be edited.
#[derive(Debug)]
pub(crate) struct SceneEditor {
    /// The path that the text is loaded as: that of the scene file, or one next to a bare model.
    path: PathBuf,
    /// Whether there is a scene file at the path.
    has_file: bool,
    loader: SceneLoader,
    history: History,
    /// Text of the scene file when it was read last.
    file_text: String,
    /// Files of the scene, with their state before they were read last.
    watched: Vec<FileStamp>,
    /// View of the shown scene, as its file has it.
    view: ViewRequest,
}

/// Function that shows a loaded scene. Its first argument is the view of the former scene, which remains after an error.
pub(crate) type Show<'s> = dyn FnMut(ViewRequest, LoadedScene) -> Result<(), String> + 's;

impl SceneEditor {
    /// An editor of the scene that `loader` has loaded last from `path`: a scene file, or a bare model with `options`.
    ///
    /// # Errors
    /// A scene file that cannot be read again.
    pub(crate) fn new(
        path: &Path,
        loader: SceneLoader,
        scene: &Scene,
        bare: Option<LoadOptions>,
    ) -> Result<Self, String> {
        let watched = distinct(loader.files());
        let (path, loader, text) = match bare {
            None => (path.to_owned(), loader, read(path)?),
            Some(options) => {
                let text = of_model(path, scene, options);
                // The keys of the text replace the options.
                let options = LoadOptions { up: None, crease_angle: None, ..options };
                (path.with_extension("toml"), loader.with_options(options), text)
            }
        };
        let (file_text, history) = (text.clone(), History::new(text));
        let view = view_of(scene);
        Ok(Self { path, has_file: bare.is_none(), loader, history, file_text, watched, view })
    }

    /// Performs a command. `line` names the change when it is undone; `show` receives the changed scene. Returns the answer for
    /// the user.
    ///
    /// # Errors
    /// The reason for which the scene is not changed, or not written.
    pub(crate) fn perform(
        &mut self,
        command: &EditCommand,
        line: &str,
        show: &mut Show<'_>,
    ) -> Result<Json, String> {
        match command {
            EditCommand::Change(edit) => {
                let text = applied(self.history.text(), edit)?;
                self.load(&text, show)?;
                self.history.change(line.to_owned(), text);
                Ok(json!({ "ok": true }))
            }
            EditCommand::Undo => {
                let former = self.history.former().ok_or("there is no change to undo")?;
                let (text, what) = (former.0.to_owned(), former.1.to_owned());
                self.load(&text, show)?;
                self.history.undo();
                Ok(json!({ "ok": true, "undone": what }))
            }
            EditCommand::Redo => {
                let later = self.history.later().ok_or("there is no change to redo")?;
                let (text, what) = (later.0.to_owned(), later.1.to_owned());
                self.load(&text, show)?;
                self.history.redo();
                Ok(json!({ "ok": true, "redone": what }))
            }
            EditCommand::Save(file) => {
                self.save(file)?;
                Ok(json!({ "ok": true, "file": file.to_string_lossy() }))
            }
            EditCommand::ListObjects => {
                let objects = Document::parse(self.history.text())?.list();
                Ok(json!({ "ok": true, "objects": objects }))
            }
        }
    }

    /// Loads the scene again if one of its files has changed, appeared or disappeared. A changed scene file replaces the
    /// edited text, which can be restored by undoing.
    pub(crate) fn reload_if_changed(&mut self, show: &mut Show<'_>) -> Option<Result<(), String>> {
        if !self.watched.iter().any(FileStamp::has_changed) {
            return None;
        }
        // The state of the files before they are read, so that the next check finds a change during the load.
        let before: Vec<FileStamp> = self.watched.iter().map(|stamp| FileStamp::of(stamp.path())).collect();
        let result = self.reload(show);
        self.watched = match &result {
            Ok(_) => self.of_this_load(&before),
            // The files behind a fault were not read: a change of one of them may be the remedy.
            Err(_) => distinct(before.into_iter().chain(self.loader.files())),
        };
        Some(result)
    }

    fn reload(&mut self, show: &mut Show<'_>) -> Result<(), String> {
        if !self.has_file {
            let loaded = self.loader.load_text(&self.path, self.history.text());
            return self.shown(loaded.map_err(|error| error.to_string())?, show);
        }
        let text = read(&self.path)?;
        let is_other = text != self.file_text;
        let shown = if is_other { text.as_str() } else { self.history.text() };
        let loaded = self.loader.load_text(&self.path, shown).map_err(|error| error.to_string())?;
        self.shown(loaded, show)?;
        if is_other {
            if text != self.history.text() {
                self.history.change("the scene file has changed".to_owned(), text.clone());
            }
            self.file_text = text;
        }
        Ok(())
    }

    /// Loads a text and shows it. Files of the former text are watched until that succeeds.
    fn load(&mut self, text: &str, show: &mut Show<'_>) -> Result<(), String> {
        let loaded = self.loader.load_text(&self.path, text).map_err(|error| error.message())?;
        self.shown(loaded, show)?;
        let before = std::mem::take(&mut self.watched);
        self.watched = self.of_this_load(&before);
        Ok(())
    }

    fn shown(&mut self, loaded: LoadedScene, show: &mut Show<'_>) -> Result<(), String> {
        let after = view_of(&loaded.scene);
        show(self.view, loaded)?;
        self.view = after;
        Ok(())
    }

    /// The files of the last load. The scene file itself was read earlier than its text was loaded, so its state is taken from
    /// `before`.
    fn of_this_load(&self, before: &[FileStamp]) -> Vec<FileStamp> {
        let is_main = |stamp: &FileStamp| stamp.path() == self.path;
        let main = before.iter().find(|stamp| stamp.path() == self.path).cloned();
        distinct(main.into_iter().chain(self.loader.files().into_iter().filter(|stamp| !is_main(stamp))))
    }

    /// Writes the scene to a file that loads to the same scene. Changes of the scene file that are not loaded, because they have a
    /// fault or are too new, are not overwritten.
    fn save(&mut self, file: &Path) -> Result<(), String> {
        if file.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("toml")) {
            return Err(format!("{}: a scene file ends in .toml", file.display()));
        }
        let folder = |path: &Path| path.parent().unwrap_or(Path::new("")).to_owned();
        let text = moved(self.history.text(), &folder(&self.path), &folder(file))?;
        let load = |loader: &mut SceneLoader, path: &Path, text: &str| {
            loader.load_text(path, text).map(|loaded| loaded.scene).map_err(|error| error.to_string())
        };
        let saved = load(&mut self.loader, file, &text)?;
        let shown = load(&mut self.loader, &self.path, self.history.text())?;
        if saved != shown {
            return Err(format!(
                "{}: the scene would not be the same there; save it next to {}",
                file.display(),
                self.path.display()
            ));
        }
        let is_own = self.has_file && is_same(file, &self.path);
        if is_own && read(file).as_ref() != Ok(&self.file_text) {
            return Err(format!(
                "{}: the file has changed since the scene was loaded from it; save to another file",
                file.display()
            ));
        }
        write_whole(file, text.as_bytes())
            .map_err(|error| format!("cannot write {}: {error}", file.display()))?;
        if is_own {
            self.file_text = text;
        }
        Ok(())
    }
}

/// The first stamp of each file: materials may share pictures.
fn distinct(stamps: impl IntoIterator<Item = FileStamp>) -> Vec<FileStamp> {
    let mut seen = BTreeSet::new();
    stamps.into_iter().filter(|stamp| seen.insert(stamp.path().to_owned())).collect()
}

/// Whether two paths name the same existing file.
fn is_same(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

fn read(path: &Path) -> Result<String, String> {
    let failed = |error: String| format!("cannot read {}: {error}", path.display());
    let bytes = read_within(path, MAX_SCENE_BYTES).map_err(|error| failed(error.to_string()))?;
    let bytes = bytes.ok_or_else(|| failed(format!("it has more than {MAX_SCENE_BYTES} bytes")))?;
    String::from_utf8(bytes).map_err(|_| failed("it is not valid UTF-8; save it in that encoding".to_owned()))
}

/// The text of a scene file that loads to the scene of a bare model.
fn of_model(path: &Path, scene: &Scene, options: LoadOptions) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
    let quoted = toml_edit::Value::from(name.as_ref());
    let camera = &scene.camera;
    let [position, look_at] = [camera.position, camera.look_at].map(|point| point.to_array());
    let ambient = scene.ambient.to_array();
    let background = match scene.background {
        Background::Color(color) => color.to_array(),
        _ => [0.0; 3],
    };
    let up = match options.up {
        Some(Up::Z) => "up = \"z\"\n",
        Some(Up::Y) | None => "",
    };
    let crease = options.crease_angle.map_or_else(String::new, |angle| format!("crease_angle = {angle:?}\n"));
    format!(
        "ambient = {ambient:?}\n\n[camera]\nposition = {position:?}\nlook_at = {look_at:?}\nfov = {:?}\n\n\
         [background]\ncolor = {background:?}\n\n[[model]]\nname = \"model\"\nfile = {quoted}\n{up}{crease}",
        camera.fov
    )
}
