//! Repeated loads by one loader.

use super::*;
use crate::scene::{LoadLimits, LoadOptions, SceneLoader};

fn loader() -> SceneLoader {
    SceneLoader::new(LoadOptions::default(), LoadLimits::default())
}

/// Names of the files of the last load, sorted, each once.
fn files(loader: &SceneLoader) -> Vec<String> {
    let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
    let mut names: Vec<String> = loader.files().iter().map(|stamp| name(stamp.path())).collect();
    names.sort();
    names.dedup();
    names
}

const SCENE: &str = "[[model]]\nfile = \"m/a.obj\"\n";

#[test]
fn unchanged_files_are_the_same_in_memory_and_changed_ones_are_read_again() {
    let folder = wooden(SCENE);
    let mut loader = loader();
    let first = loader.load(&folder.path("s.toml")).unwrap();
    assert_eq!(files(&loader), ["a.mtl", "a.obj", "s.toml", "wood.png"]);
    let moved = format!("{CAMERA}{SCENE}translate = [1, 0, 0]\n");
    let second = loader.load_text(&folder.path("s.toml"), &moved).unwrap();
    assert!(Arc::ptr_eq(&first.meshes[0], &second.meshes[0]), "it is not compiled again");
    assert!(Arc::ptr_eq(&first.textures[0], &second.textures[0]), "it is not decoded again");
    assert_eq!(second.scene.models[0].translate, DVec3::X);
    assert!(loader.files().iter().all(|stamp| !stamp.has_changed()));
    std::fs::write(folder.path("m/a.mtl"), "newmtl wood\nKd 0 0.5 1\n").unwrap();
    assert!(loader.files().iter().any(|stamp| stamp.has_changed()));
    let third = loader.load_text(&folder.path("s.toml"), &moved).unwrap();
    assert!(third.textures.is_empty() && third.meshes[0].id() != second.meshes[0].id());
    let fresh = load(&folder.path("s.toml")).unwrap();
    assert_eq!(third.meshes[0].id(), fresh.meshes[0].id());
}

#[test]
fn files_of_a_load_that_fails_are_known_as_well() {
    let folder = wooden("[[model]]\nfile = \"m/none.obj\"\n");
    let mut loader = loader();
    assert!(loader.load(&folder.path("s.toml")).is_err());
    assert_eq!(files(&loader), ["none.obj", "s.toml"]);
    std::fs::write(folder.path("m/none.obj"), format!("mtllib later.mtl\nusemtl a\n{TRIANGLE}")).unwrap();
    assert!(loader.files().iter().any(|stamp| stamp.has_changed()));
    loader.load(&folder.path("s.toml")).unwrap();
    assert_eq!(files(&loader), ["later.mtl", "none.obj", "s.toml"], "a missing library is watched");
}

#[test]
fn a_text_names_files_as_the_file_at_its_path_would() {
    let folder = wooden(SCENE);
    let text = std::fs::read_to_string(folder.path("s.toml")).unwrap();
    let loaded = loader().load_text(&folder.path("not-there.toml"), &text).unwrap();
    assert_eq!(loaded.scene, folder.load("s.toml").scene);
    let error = loader().load_text(&folder.path("s.toml"), "[camera]\nfov = 400\n").unwrap_err();
    assert!(error.to_string().contains("s.toml:"), "{error}");
    assert!(!error.message().contains("s.toml"), "{}", error.message());
}

#[test]
fn a_bare_model_and_a_scene_of_it_share_its_mesh() {
    let folder = wooden("");
    let mut loader = loader();
    let bare = loader.load(&folder.path("m/a.obj")).unwrap();
    let scene = loader.load_text(&folder.path("m/s.toml"), "[[model]]\nfile = \"a.obj\"\n").unwrap();
    assert!(
        Arc::ptr_eq(&bare.meshes[0], &scene.meshes[0]) && Arc::ptr_eq(&bare.textures[0], &scene.textures[0])
    );
}
