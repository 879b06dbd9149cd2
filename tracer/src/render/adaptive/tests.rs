use std::path::Path;
use std::sync::Arc;

use super::*;
use crate::render::render_rows;
use crate::scene::{FrameView, Quality};
use crate::simd::dispatch;
use crate::{CompiledScene, simd};

const WIDTH: u32 = 150;
const HEIGHT: u32 = 47;

fn compiled(scene: &str) -> Arc<CompiledScene> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models").join(scene);
    let loaded = crate::scene::load(&path).unwrap();
    Arc::new(CompiledScene::new(loaded.scene, loaded.meshes, loaded.textures).unwrap())
}

fn frame(scene: &Arc<CompiledScene>, samples: u32, adaptive: bool) -> PreparedFrame {
    let quality = Quality { adaptive, ..Quality::default() };
    let view = FrameView { width: WIDTH, height: HEIGHT, samples, quality, ..FrameView::of(scene.scene()) };
    PreparedFrame::new(Arc::clone(scene), &view).unwrap()
}

/// The bytes of a band, and which of its pixels got all their samples.
fn band(frame: &PreparedFrame, rows: Range<u32>) -> (Vec<u8>, Vec<bool>) {
    let mut band = Band::new(frame, rows.clone(), &|| false);
    let mut bytes = vec![0; rows.len() * WIDTH as usize * 3];
    dispatch!(simd::best(), simd => band.render(simd, &mut bytes, &mut ())).unwrap();
    let places = rows.clone().flat_map(|y| (0..WIDTH).map(move |x| [x, y]));
    let all = places.map(|place| {
        let (index, bit) = want(frame, &rows, place);
        band.wants[index].all >> bit & 1 == 1
    });
    let all = all.collect();
    (bytes, all)
}

/// The same rays give the same samples, but that their directions are rounded from another tile's centre.
#[test]
fn pixels_with_edges_are_those_of_regular_sampling() {
    for (scene, samples) in [("lights.toml", 4), ("textured.toml", 9), ("room.toml", 16), ("lights.toml", 25)]
    {
        let scene = compiled(scene);
        let (regular, adaptive) = (frame(&scene, samples, false), frame(&scene, samples, true));
        let mut expected = vec![0; (WIDTH * HEIGHT * 3) as usize];
        render_rows(&regular, 0..HEIGHT, &mut expected, &|| false).unwrap();
        let (mut pixels, mut off) = (0, 0);
        for top in (0..HEIGHT).step_by(BAND as usize) {
            let rows = top..(top + BAND).min(HEIGHT);
            let (bytes, all) = band(&adaptive, rows.clone());
            let expected = &expected[(top * WIDTH * 3) as usize..];
            for (at, _) in all.iter().enumerate().filter(|(_, all)| **all) {
                let (found, expected) = (&bytes[3 * at..3 * at + 3], &expected[3 * at..3 * at + 3]);
                let worst = found.iter().zip(expected).map(|(a, b)| a.abs_diff(*b)).max();
                assert!(worst <= Some(1), "pixel {at} of rows {rows:?}: {found:?}, not {expected:?}");
                pixels += 1;
                off += usize::from(found != expected);
            }
        }
        assert!(pixels > 300, "{samples} samples: only {pixels} pixels have edges");
        assert!(off * 1000 <= pixels, "{samples} samples: {off} of {pixels} pixels differ");
    }
}

/// Whether a pixel has an edge is told by the band, not by the rows that are asked for.
#[test]
fn rows_want_the_same_wherever_they_are_cut() {
    let scene = compiled("textured.toml");
    let frame = frame(&scene, 16, true);
    let (bytes, all) = band(&frame, 16..32);
    for (from, to) in [(16, 17), (17, 20), (20, 31), (31, 32)] {
        let (rows, wanted) = band(&frame, from..to);
        let (first, last) = ((from - 16) as usize * WIDTH as usize, (to - 16) as usize * WIDTH as usize);
        assert!(wanted == all[first..last], "rows {from}..{to}");
        assert!(rows == bytes[3 * first..3 * last], "rows {from}..{to}");
    }
}

#[test]
fn contrast_spreads_to_the_four_beside_it_and_no_farther() {
    let mut contrasts = Contrasts::new(40);
    contrasts.put(20, 5, 30.0);
    let wants = |column, row| dispatch!(simd::best(), simd => contrasts.wants(simd, column, row, 40.0));
    let bit = |column: u32| 1 << (column - 16);
    assert_eq!(wants(16, 5), Wants { one: bit(19) | bit(20) | bit(21), all: 0 });
    for row in [4, 6] {
        assert_eq!(wants(16, row), Wants { one: bit(20), all: 0 });
    }
    for row in [3, 7] {
        assert_eq!(wants(16, row), Wants::default());
    }
    let strong = dispatch!(simd::best(), simd => contrasts.wants(simd, 16, 5, 30.0));
    assert_eq!(strong, Wants { one: bit(19) | bit(21), all: bit(20) });
}
