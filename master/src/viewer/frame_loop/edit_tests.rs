//! The viewer of a scene that is edited and whose files change, over a farm of workers that render it.

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;

use rayfarm_farm::{FarmOptions, FarmScene};
use rayfarm_tracer::scene::{LoadLimits, LoadOptions, RenderScale, SceneLoader, load};
use rayfarm_tracer::{CompiledScene, PreparedFrame, render_rows};

use super::tests::{Running, STILL};
use super::*;
use crate::test_worker;
use crate::viewer::edits::{EditCommand, EditorHandle, SceneEditor};

const SCENE: &str = r#"
[render]
width = 48
height = 36
integrator = "direct"
samples = 4

[camera]
position = [0, 0, 5]
look_at = [0, 0, 0]

[background]
color = [0.2, 0.3, 0.6]

[material.red]
diffuse = [0.8, 0.1, 0.1]

[[light]]
position = [3, 5, 4]

[[sphere]]
name = "ball"
center = [0, 0, 0]
radius = 0.8
material = "red"
"#;

/// A view of the scene file in a folder, with workers.
struct Edited {
    folder: tempfile::TempDir,
    viewer: Running,
    editor: EditorHandle,
}

impl Edited {
    async fn start(scene: &str, workers: u32) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.toml");
        std::fs::write(&path, scene).unwrap();
        let mut loader = SceneLoader::new(LoadOptions::default(), LoadLimits::default());
        let loaded = loader.load(&path).unwrap();
        let editor = SceneEditor::new(&path, loader, &loaded.scene, None).unwrap();
        let view = FrameView::of(&loaded.scene);
        let listen = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
        let options = FarmOptions { listen, ..FarmOptions::default() };
        let drawn = FarmScene { scene: loaded.scene, meshes: loaded.meshes, textures: loaded.textures };
        let farm = Farm::start(options, drawn).await.unwrap();
        for _ in 0..workers {
            test_worker::start(farm.address());
        }
        let config = ViewerConfig {
            request: ViewRequest { view, scale: RenderScale::Full },
            camera: CameraControl::new(view.camera, None),
            policy: RequestPolicy { animation: STILL, limit: None, continuous: false },
            log: None,
            controller: None,
            denoised: false,
        };
        let viewer = Running::of(farm, config);
        let editor = EditorHandle::start(editor, viewer.handle.knob_sender()).unwrap();
        Self { folder, viewer, editor }
    }

    /// Performs a command on a blocking thread, as connections do.
    async fn edit(&self, line: &str) {
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        let command = EditCommand::parse(word, rest).unwrap().unwrap();
        let (editor, line) = (self.editor.clone(), line.to_owned());
        let done = tokio::task::spawn_blocking(move || editor.perform(command, &line));
        done.await.unwrap().unwrap();
    }

    /// Waits for a picture with the bytes of a scene file.
    async fn shows(&mut self, scene: &str) -> Arc<PresentedFrame> {
        let expected = rendered(self.folder.path(), scene);
        self.viewer.frame(|_| (), |frame| frame.frame.pixels[..] == expected).await
    }
}

/// The bytes of a fresh render of a scene file, with its own camera.
fn rendered(folder: &Path, scene: &str) -> Vec<u8> {
    let path = folder.join("fresh.toml");
    std::fs::write(&path, scene).unwrap();
    let loaded = load(&path).unwrap();
    let view = FrameView::of(&loaded.scene);
    let compiled = CompiledScene::new(loaded.scene, loaded.meshes, loaded.textures).unwrap();
    let frame = PreparedFrame::new(Arc::new(compiled), &view).unwrap();
    let mut bytes = vec![0; view.format.bytes_of(view.width, view.height)];
    render_rows(&frame, 0..view.height, &mut bytes, &|| false).unwrap();
    bytes
}

fn with_ball_at(x: &str) -> String {
    SCENE.replace("center = [0, 0, 0]", &format!("center = [{x}, 0, 0]"))
}

#[tokio::test(flavor = "multi_thread")]
async fn an_edit_is_shown_and_undone_to_the_byte() {
    for (integrator, samples) in [("direct", "4"), ("path", "3")] {
        let with = |scene: String| {
            scene
                .replace("\"direct\"", &format!("\"{integrator}\""))
                .replace("= 4\n", &format!("= {samples}\n"))
        };
        let mut edited = Edited::start(&with(SCENE.to_owned()), 3).await;
        let first = edited.shows(&with(SCENE.to_owned())).await.frame.pixels.to_vec();
        for x in ["0.25", "0.5", "0.75"] {
            edited.edit("object move ball 0.25 0 0").await;
            let shown = edited.shows(&with(with_ball_at(x))).await;
            assert!(shown.frame.pixels[..] != first, "the ball is seen to move");
        }
        for _ in 0..3 {
            edited.edit("undo").await;
        }
        edited.shows(&with(SCENE.to_owned())).await;
        edited.edit("redo").await;
        edited.shows(&with(with_ball_at("0.25"))).await;
        edited.edit("render exposure 1").await;
        edited.shows(&with(with_ball_at("0.25").replace("[render]", "[render]\nexposure = 1"))).await;
        // Workers join once: all three are there only if no session has ended.
        edited.viewer.until(|status, _| status.workers.len() == 3).await;
        edited.viewer.end().await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_changed_file_is_shown_and_a_broken_one_leaves_the_picture() {
    let mut edited = Edited::start(SCENE, 1).await;
    edited.shows(SCENE).await;
    let path = edited.folder.path().join("s.toml");
    std::fs::write(&path, with_ball_at("0.5")).unwrap();
    edited.shows(&with_ball_at("0.5")).await;
    std::fs::write(&path, "[[sphere]]\nradius = 1\n").unwrap();
    let has_fault = |word: &'static str| {
        move |_: &rayfarm_farm::FarmStatus, figures: &crate::viewer::Statistics| {
            figures
                .scene_fault
                .as_ref()
                .is_some_and(|fault| fault.contains(word) && fault.contains("s.toml:1:"))
        }
    };
    edited.viewer.until(has_fault("`center`")).await;
    let completed = edited.viewer.completed();
    // The former scene is still shown, and moved.
    edited.viewer.send(super::tests::TURN);
    edited.viewer.until(|_, figures| figures.completed > completed).await;
    edited.viewer.send(InputAction::ResetCamera);
    edited.shows(&with_ball_at("0.5")).await;
    std::fs::write(&path, with_ball_at("-0.5")).unwrap();
    edited.shows(&with_ball_at("-0.5")).await;
    edited.viewer.until(|_, figures| figures.scene_fault.is_none()).await;
    edited.viewer.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_camera_is_kept_when_the_scene_changes_and_reset_to_that_of_the_new_scene() {
    let mut edited = Edited::start(SCENE, 1).await;
    let first = edited.shows(SCENE).await.frame.view.camera;
    edited.viewer.send(super::tests::TURN);
    let turned = edited.viewer.frame(|_| (), |frame| frame.frame.view.camera != first).await;
    let turned = turned.frame.view.camera;
    let moved =
        SCENE.replace("position = [0, 0, 5]", "position = [0, 1, 6]").replace("samples = 4", "samples = 1");
    std::fs::write(edited.folder.path().join("s.toml"), &moved).unwrap();
    let shown = edited.viewer.frame(|_| (), |frame| frame.frame.view.samples == 1).await;
    assert_eq!(shown.frame.view.camera, turned);
    edited.viewer.send(InputAction::ResetCamera);
    edited.shows(&moved).await;
    edited.viewer.end().await;
}
