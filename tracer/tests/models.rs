//! The scenes of the project: they load, match their README, and are the output of the generator.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use glam::DVec3;
use rayfarm_tracer::CompiledScene;
use rayfarm_tracer::image::{self, SkyPixels};
use rayfarm_tracer::scene::{FrameView, LightKind, LoadedScene, load};

#[path = "../examples/make_models/mod.rs"]
mod generator;

use generator::Content;

const SCENES: [&str; 16] = [
    "room.toml",
    "room-soft.toml",
    "table.toml",
    "showroom.toml",
    "product.toml",
    "instances.toml",
    "lights.toml",
    "textured.toml",
    "carousel.toml",
    "box.toml",
    "balls-glass.toml",
    "balls-metal.toml",
    "balls-random.toml",
    "balls-10000.toml",
    "product-path.toml",
    "showroom-path.toml",
];
const MAX_FOLDER_BYTES: u64 = 11_600_000;

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
        CompiledScene::new(scene.scene, scene.meshes, scene.textures)
            .unwrap_or_else(|error| panic!("{name}: {error}"));
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
    let compiled = CompiledScene::new(room.scene, room.meshes, room.textures).unwrap();
    assert!(compiled.triangle_count() >= 50_000, "{} triangles", compiled.triangle_count());
}

#[test]
fn the_soft_room_differs_from_the_room_in_its_lights_only() {
    let (room, soft) = (loaded("room.toml"), loaded("room-soft.toml"));
    let has_soft_shadows = |scene: &LoadedScene| {
        scene.scene.lights.iter().filter(|light| light.shadows).all(|light| light.radius > 0.0)
    };
    assert!(has_soft_shadows(&soft) && !has_soft_shadows(&room));
    for (soft, hard) in soft.scene.lights.iter().zip(&room.scene.lights) {
        assert_eq!(
            (soft.color, soft.attenuation, soft.shadows),
            (hard.color, hard.attenuation, hard.shadows)
        );
    }
    let mut alike = soft.scene;
    alike.lights = room.scene.lights.clone();
    assert!(alike == room.scene, "room-soft.toml is not room.toml with other lights");
}

/// Number of faces of a generated mesh at each directed edge, over positions.
fn directed_edges(text: &str) -> BTreeMap<(&str, &str), usize> {
    let positions: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("v ")).collect();
    let mut edges = BTreeMap::new();
    for face in text.lines().filter_map(|line| line.strip_prefix("f ")) {
        let corners: Vec<&str> =
            face.split(' ').map(|corner| positions[corner.parse::<usize>().unwrap() - 1]).collect();
        for (i, from) in corners.iter().enumerate() {
            *edges.entry((*from, corners[(i + 1) % corners.len()])).or_default() += 1;
        }
    }
    edges
}

/// Six times the volume of a generated mesh, positive where its front is outside.
fn sixfold_volume(text: &str) -> f64 {
    let numbers = |line: &str| {
        let numbers: Vec<f64> = line.split(' ').map(|number| number.parse().unwrap()).collect();
        DVec3::from_slice(&numbers)
    };
    let positions: Vec<DVec3> =
        text.lines().filter_map(|line| line.strip_prefix("v ")).map(numbers).collect();
    let faces = text.lines().filter_map(|line| line.strip_prefix("f "));
    faces
        .map(|face| {
            let corners: Vec<DVec3> =
                face.split(' ').map(|corner| positions[corner.parse::<usize>().unwrap() - 1]).collect();
            corners.windows(2).skip(1).map(|edge| corners[0].dot(edge[0].cross(edge[1]))).sum::<f64>()
        })
        .sum()
}

#[test]
fn transparent_bodies_are_closed_with_their_front_outside() {
    let bodies = ["wine_glass", "wine", "carafe", "water"].map(|name| format!("table/{name}.obj"));
    let showroom = ["flacon", "perfume"].map(|name| format!("showroom/{name}.obj"));
    for name in bodies.iter().chain(&showroom) {
        let text = fs::read_to_string(folder().join(name)).unwrap();
        let edges = directed_edges(&text);
        for ((from, to), count) in &edges {
            assert_eq!((*count, edges.get(&(*to, *from))), (1, Some(&1)), "{name}: the edge {from} to {to}");
        }
        assert!(sixfold_volume(&text) > 0.0, "{name} is inside out");
    }
}

#[test]
fn the_generator_writes_exactly_the_files_in_the_repository() {
    let generated = generator::files();
    for file in &generated {
        let path = folder().join(&file.path);
        // Not assert_eq: a difference would print megabytes.
        let is_the_same = match &file.content {
            Content::Text(text) => fs::read_to_string(&path).is_ok_and(|found| found == *text),
            Content::Picture(picture) => image::load(&path).is_ok_and(|found| found == *picture),
            Content::Light(picture) => image::load_sky(&path)
                .is_ok_and(|found| found.pixels == SkyPixels::Linear(picture.clone()) && !found.translucent),
        };
        assert!(is_the_same, "{} is not what the generator writes: run it again", path.display());
        assert_eq!(file.triangles > 0, file.path.ends_with(".obj"), "{}", file.path);
    }
    // The picture next to the scenes shows one of them. Most scene files are written by hand.
    let is_generated = |path: &PathBuf| {
        path.extension().is_some_and(|e| e == "obj" || e == "mtl" || e == "png" || e == "hdr")
            && !path.ends_with("room.png")
    };
    let files = files_below(&folder()).into_iter().filter(is_generated);
    let scenes = generated.iter().filter(|file| file.path.ends_with(".toml"));
    assert_eq!(
        files.count() + scenes.count(),
        generated.len(),
        "a file in models/ that the generator does not know"
    );
}

#[test]
fn a_written_sky_is_read_as_it_was() {
    let sky = generator::files().into_iter().find_map(|file| match file.content {
        Content::Light(picture) => Some(picture),
        _ => None,
    });
    let sky = sky.unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sky.hdr");
    generator::save_light(&path, &sky).unwrap();
    // The sun is the brightest part, and no path is cut by the limit of 1024.
    let brightest = sky.pixels.iter().copied().fold(0.0, f32::max);
    assert!(brightest > 800.0 && brightest < 1024.0, "{brightest}");
    assert!(image::load_sky(&path).unwrap().pixels == SkyPixels::Linear(sky));
}

#[test]
fn the_scenes_of_paths_say_so_and_have_their_balls() {
    let balls = |name: &str| {
        let scene = loaded(name).scene;
        assert!(FrameView::of(&scene).integrator.path().is_some(), "{name}");
        (scene.spheres.len(), scene.lens.aperture)
    };
    assert_eq!(balls("balls-10000.toml").0, 10_000);
    let (count, aperture) = balls("balls-random.toml");
    assert!((480..=540).contains(&count) && aperture > 0.0, "{count} balls, a lens of {aperture}");
    for name in
        ["box.toml", "balls-glass.toml", "balls-metal.toml", "product-path.toml", "showroom-path.toml"]
    {
        balls(name);
    }
}

#[test]
fn small_balls_do_not_overlap() {
    let scene = loaded("balls-random.toml").scene;
    for (i, one) in scene.spheres.iter().enumerate() {
        for other in &scene.spheres[..i] {
            let reach = one.radius + other.radius;
            // Lengths in the file are rounded to thousandths.
            assert!(
                one.center.distance(other.center) >= reach - 0.003,
                "{:?} and {:?}",
                one.center,
                other.center
            );
        }
    }
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
        let triangles =
            CompiledScene::new(scene.scene, scene.meshes, scene.textures).unwrap().triangle_count();
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
