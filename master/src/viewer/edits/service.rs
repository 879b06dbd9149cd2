//! The editor on a thread of its own, which performs commands and watches the files of the scene.
//!
//! Files are checked by their size and the time of their last change, twice a second. Notifications of the operating system
//! would be faster, but network drives send none, and operating systems report the replacement of a file differently. The
//! time of the checks is too short to be measured.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant};

use rayfarm_farm::{Assets, FarmScene, ViewRequest};
use rayfarm_tracer::scene::LoadedScene;
use serde_json::Value as Json;

use super::edit::EditCommand;
use super::editor::SceneEditor;
use crate::viewer::KnobSender;
use crate::viewer::scene_update::{SceneUpdate, view_of};

/// Interval of the checks of files.
const CHECK_EVERY: Duration = Duration::from_millis(500);
/// Commands that wait for the editor at most.
const MAX_WAITING: usize = 64;

/// A command with the place for its answer.
struct Request {
    command: EditCommand,
    /// The command as text, which names the change when it is undone.
    line: String,
    answer: SyncSender<Result<Json, String>>,
}

/// Access to the editor of a view.
#[derive(Clone, Debug)]
pub(crate) struct EditorHandle(SyncSender<Request>);

impl EditorHandle {
    /// Starts an editor that shows changed scenes in `view`, and ends with it.
    ///
    /// # Errors
    /// A thread that cannot be started.
    pub(crate) fn start(editor: SceneEditor, view: KnobSender) -> std::io::Result<Self> {
        let (sender, requests) = sync_channel(MAX_WAITING);
        let thread = std::thread::Builder::new().name("editor".to_owned());
        thread.spawn(move || run(editor, &requests, &view))?;
        Ok(Self(sender))
    }

    /// Performs a command, and waits until its scene is loaded.
    ///
    /// # Errors
    /// The reason for which the scene is not changed; a view that has ended.
    pub(crate) fn perform(&self, command: EditCommand, line: &str) -> Result<Json, String> {
        let (answer, answered) = sync_channel(1);
        let request = Request { command, line: line.to_owned(), answer };
        let ended = "the view has ended";
        self.0.send(request).map_err(|_| ended)?;
        answered.recv().map_err(|_| ended)?
    }
}

/// Performs commands and watches files until the view ends.
fn run(mut editor: SceneEditor, requests: &Receiver<Request>, view: &KnobSender) {
    let mut next_check = Instant::now() + CHECK_EVERY;
    let mut has_requests = true;
    while view.is_running() {
        let wait = next_check.saturating_duration_since(Instant::now());
        let received =
            if has_requests { requests.recv_timeout(wait) } else { Err(RecvTimeoutError::Timeout) };
        match received {
            Ok(Request { command, line, answer }) => {
                let result = editor.perform(&command, &line, &mut |before, scene| show(before, scene, view));
                // The connection of the command may have ended.
                let _ = answer.send(result);
            }
            Err(RecvTimeoutError::Timeout) if !has_requests => std::thread::sleep(wait),
            Err(RecvTimeoutError::Timeout) => {}
            // Without a console there are no commands, and the files are still watched.
            Err(RecvTimeoutError::Disconnected) => has_requests = false,
        }
        if next_check <= Instant::now() {
            check(&mut editor, view);
            next_check = Instant::now() + CHECK_EVERY;
        }
    }
}

/// Shows the scene again if its files have changed; a fault in them is reported over the picture of the former scene.
fn check(editor: &mut SceneEditor, view: &KnobSender) {
    let shown = match editor.reload_if_changed(&mut |before, scene| show(before, scene, view)) {
        None => return,
        Some(Ok(())) => {
            tracing::info!("the scene is loaded again: its files have changed");
            Ok(())
        }
        Some(Err(fault)) => {
            tracing::error!("the former scene remains: {fault}");
            view.report_fault(fault)
        }
    };
    if let Err(error) = shown {
        tracing::debug!("the fault of the scene is not shown: {error}");
    }
}

/// Shows a loaded scene in place of one with the view `before`. Writes warnings about the scene to the log.
fn show(before: ViewRequest, loaded: LoadedScene, view: &KnobSender) -> Result<(), String> {
    let LoadedScene { scene, meshes, textures, warnings, .. } = loaded;
    let after = view_of(&scene);
    let assets = Assets::new(FarmScene { scene, meshes, textures }).map_err(|error| error.to_string())?;
    view.show_scene(SceneUpdate::new(before, Arc::new(assets), after))?;
    for warning in warnings {
        tracing::warn!("{warning}");
    }
    Ok(())
}
