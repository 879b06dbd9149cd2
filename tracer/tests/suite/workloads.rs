//! The benchmark scenes, where they lie beside the project. An independent tracer in single precision has rendered them: where its
//! picture and ours differ, and at some pixels more, the oracle decides.

use std::path::Path;
use std::sync::Arc;

use rayfarm_tracer::reference::Oracle;
use rayfarm_tracer::scene::{FrameView, load};
use rayfarm_tracer::{CompiledScene, PreparedFrame, image, render_rows};
use rayon::prelude::*;

/// Every so many pixels, one is held against the oracle whatever the other picture shows.
const EVERY: usize = 4_001;

/// Pixels of a workload that the oracle was asked about, and those of them that differ by more than a step from its answer.
fn asked_and_wrong(name: &str) -> Option<(usize, usize)> {
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
    let asked: Vec<usize> = (0..pixels.len() / 3)
        .filter(|&i| i % EVERY == 0 || differ(&pixels[pixel(i)], &other[pixel(i)], 2))
        .collect();
    let expected = |i: usize| oracle.encoded_pixel(i as u32 % view.width, i as u32 / view.width);
    let wrong = asked.par_iter().filter(|&&i| differ(&pixels[pixel(i)], &expected(i), 1)).count();
    Some((asked.len(), wrong))
}

fn check(name: &str) {
    if let Some((asked, wrong)) = asked_and_wrong(name) {
        eprintln!("{name}: {asked} pixels held against the oracle, {wrong} differ");
        assert!(asked > 190 && wrong == 0, "{name}: {wrong} of {asked} pixels are not the oracle's");
    }
}

#[test]
fn one_bust_is_the_oracles() {
    check("w1");
}

#[test]
fn ten_busts_are_the_oracles() {
    check("w2");
}

#[test]
fn a_bust_that_fills_the_frame_is_the_oracles() {
    check("w3");
}
