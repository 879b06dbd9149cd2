//! The picture of `models/lights.toml`, compared with a stored picture and with the oracle.
//!
//! After a change of the scene or of the rules of light, look at the new picture and store it:
//! `RAYFARM_STORE_GOLDEN=1 cargo test -p rayfarm-tracer --test suite golden`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayfarm_tracer::image::{self, RgbImage};
use rayfarm_tracer::reference::Oracle;
use rayfarm_tracer::scene::{FrameView, LoadedScene, load};
use rayfarm_tracer::{CompiledScene, PreparedFrame, render_rows};

/// One pixel in 500 may be on an edge that another platform rounds to the other side.
const EDGE_PIXELS_PER_MILLE: usize = 2;

fn in_package(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn lights(width: u32, height: u32, samples: u32) -> (LoadedScene, FrameView) {
    let loaded = load(&in_package("../models/lights.toml")).unwrap();
    let view = FrameView { width, height, samples, ..FrameView::of(&loaded.scene) };
    (loaded, view)
}

fn render(loaded: LoadedScene, view: &FrameView) -> RgbImage {
    let scene = Arc::new(CompiledScene::new(loaded.scene, loaded.meshes, loaded.textures).unwrap());
    let frame = PreparedFrame::new(scene, view).unwrap();
    let mut picture = RgbImage::new(view.width, view.height);
    render_rows(&frame, 0..view.height, &mut picture.pixels, &|| false).unwrap();
    picture
}

/// Number of pixels with a channel that differs by more than one step.
fn off(a: &RgbImage, b: &RgbImage) -> usize {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let pairs = a.pixels.chunks_exact(3).zip(b.pixels.chunks_exact(3));
    pairs.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 1)).count()
}

fn assert_close(picture: &RgbImage, expected: &RgbImage) {
    let allowed = (picture.width * picture.height) as usize * EDGE_PIXELS_PER_MILLE / 1000;
    let off = off(picture, expected);
    assert!(off <= allowed, "{off} pixels differ, {allowed} may");
}

#[test]
fn the_lights_match_the_stored_picture() {
    let (loaded, view) = lights(320, 240, 4);
    let picture = render(loaded, &view);
    let stored = in_package("tests/suite/golden/lights.png");
    if std::env::var_os("RAYFARM_STORE_GOLDEN").is_some() {
        image::save(&stored, &picture).unwrap();
    }
    assert_close(&picture, &image::load(&stored).unwrap());
}

#[test]
fn the_lights_match_the_oracle() {
    let (loaded, view) = lights(60, 45, 1);
    let expected = Oracle::new(&loaded.scene, &loaded.meshes, &loaded.textures, &view).render();
    assert_close(&render(loaded, &view), &expected);
}
