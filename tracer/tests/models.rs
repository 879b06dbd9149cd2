//! The scenes that come with the project: they load, they are what their README says, and the generator makes them.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::fs;
use std::path::{Path, PathBuf};

use rayfarm_tracer::CompiledScene;
use rayfarm_tracer::scene::{LightKind, LoadedScene, load};

#[path = "../examples/make_models/mod.rs"]
mod generator;

const SCENES: [&str; 4] = ["room.toml", "product.toml", "instances.toml", "lights.toml"];
const MAX_FOLDER_BYTES: u64 = 10_000_000;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../models")
}

fn loaded(name: &str) -> LoadedScene {
    load(&folder().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { files.extend(files_below(&path)) } else { files.push(path) }
    }
    files
}

#[test]
fn every_scene_loads_without_warnings_and_compiles() {
    for name in SCENES {
        let scene = loaded(name);
        assert!(scene.warnings.is_empty(), "{name}: {:?}", scene.warnings);
        CompiledScene::new(scene.scene, scene.meshes).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}

#[test]
fn every_scene_file_is_tested() {
    let mut scenes: Vec<String> = files_below(&folder())
        .iter()
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .map(|path| path.file_name().unwrap().to_string_lossy().into_owned())
        .collect();
    scenes.sort();
    let mut expected = SCENES.map(str::to_owned);
    expected.sort();
    assert_eq!(scenes, expected);
}

#[test]
fn the_default_scene_is_rich_enough() {
    let room = loaded("room.toml");
    let lights = &room.scene.lights;
    assert!(lights.iter().any(|light| matches!(light.kind, LightKind::Point { .. }) && light.shadows));
    assert!(lights.iter().any(|light| {
        matches!(light.kind, LightKind::Spot { penumbra, .. } if penumbra > 0.0) && light.shadows
    }));
    let compiled = CompiledScene::new(room.scene, room.meshes).unwrap();
    assert!(compiled.triangle_count() >= 50_000, "{} triangles", compiled.triangle_count());
}

#[test]
fn the_generator_writes_exactly_the_files_in_the_repository() {
    let generated = generator::files();
    for file in &generated {
        let path = folder().join(&file.path);
        let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        // Not assert_eq: a difference would print megabytes.
        assert!(text == file.text, "{} is not what the generator writes: run it again", path.display());
        assert_eq!(file.triangles > 0, file.path.ends_with(".obj"), "{}", file.path);
    }
    let meshes = files_below(&folder())
        .into_iter()
        .filter(|path| path.extension().is_some_and(|extension| extension == "obj" || extension == "mtl"));
    assert_eq!(meshes.count(), generated.len(), "a mesh in models/ that the generator does not know");
}

#[test]
fn the_readme_names_every_mesh_and_its_triangles() {
    let readme = fs::read_to_string(folder().join("README.md")).unwrap();
    for file in generator::files().iter().filter(|file| file.triangles > 0) {
        let row = format!("| `{}` | {} |", file.path, file.triangles);
        assert!(readme.contains(&row), "models/README.md should have a row that begins {row}");
    }
    for name in SCENES {
        let scene = loaded(name);
        let triangles = CompiledScene::new(scene.scene, scene.meshes).unwrap().triangle_count();
        let row = readme.lines().find(|line| line.starts_with(&format!("| `{name}`"))).unwrap_or_default();
        assert!(
            row.contains(&format!("| {triangles} |")),
            "models/README.md: {name} has {triangles} triangles"
        );
    }
}

#[test]
fn the_folder_stays_small() {
    let bytes: u64 = files_below(&folder()).iter().map(|path| fs::metadata(path).unwrap().len()).sum();
    assert!(bytes <= MAX_FOLDER_BYTES, "{bytes} bytes in models/, at most {MAX_FOLDER_BYTES}");
}
