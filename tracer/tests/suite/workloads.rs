//! The benchmark scenes, if they are next to the project. An independent tracer in single precision has rendered
//! them: where its picture differs, and at some other pixels, the oracle decides.
//! picture and ours differ, and at some pixels more, the oracle decides.

use std::path::Path;
use std::sync::Arc;

use rayfarm_tracer::reference::Oracle;
use rayfarm_tracer::scene::{FrameView, load};
use rayfarm_tracer::{CompiledScene, PreparedFrame, image, render_rows};
use rayon::prelude::*;

/// Every this many pixels, one is compared with the oracle whatever the other picture shows.
const EVERY: usize = 4_001;

/// Number of pixels of a workload that were compared with the oracle, and of those that differ by more than a step.
fn compared_and_wrong(name: &str) -> Option<(usize, usize)> {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/workloads");
    let scene = shared.join(format!("{name}.toml"));
    if !scene.exists() {
        eprintln!("skipped: {} is not there", scene.display());
        return None;
    }
    let loaded = load(&scene).unwrap();
    let view = FrameView::of(&loaded.scene);
    let oracle = Oracle::new(&loaded.scene, &loaded.meshes, &loaded.textures, &view);
    let compiled = Arc::new(CompiledScene::new(loaded.scene, loaded.meshes, loaded.textures).unwrap());
    let mut pixels = vec![0; view.width as usize * view.height as usize * 3];
    let frame = PreparedFrame::new(compiled, &view).unwrap();
    render_rows(&frame, 0..view.height, &mut pixels, &|| false).unwrap();
    let other = image::load(&shared.join(format!("reference/{name}.png"))).unwrap().pixels;

    let pixel = |i: usize| i * 3..i * 3 + 3;
    let differ = |a: &[u8], b: &[u8], by: u8| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > by);
    let compared: Vec<usize> = (0..pixels.len() / 3)
        .filter(|&i| i % EVERY == 0 || differ(&pixels[pixel(i)], &other[pixel(i)], 2))
        .collect();
    let expected = |i: usize| oracle.encoded_pixel(i as u32 % view.width, i as u32 / view.width);
    let wrong = compared.par_iter().filter(|&&i| differ(&pixels[pixel(i)], &expected(i), 1)).count();
    Some((compared.len(), wrong))
}

fn check(name: &str) {
    if let Some((compared, wrong)) = compared_and_wrong(name) {
        eprintln!("{name}: {compared} pixels compared with the oracle, {wrong} differ");
        assert!(
            compared > 190 && wrong == 0,
            "{name}: {wrong} of {compared} pixels differ from the oracle's"
        );
    }
}

#[test]
fn one_bust_matches_the_oracle() {
    check("w1");
}

#[test]
fn ten_busts_match_the_oracle() {
    check("w2");
}

#[test]
fn a_bust_that_fills_the_frame_matches_the_oracle() {
    check("w3");
}
