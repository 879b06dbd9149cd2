use std::path::Path;
use std::sync::Arc;

use super::*;
use crate::integrator::render_rows;
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
    let mut watch = ();
    let mut band = Band::new(frame, rows.clone(), &|| false, &mut watch);
    let mut bytes = vec![0; rows.len() * WIDTH as usize * 3];
    dispatch!(simd::best(), simd => band.render(simd, &mut bytes)).unwrap();
    let places = rows.clone().flat_map(|y| (0..WIDTH).map(move |x| [x, y]));
    let all = places.map(|place| {
        let (index, bit) = need_of(frame, &rows, place);
        band.needs[index].all >> bit & 1 == 1
    });
    let all = all.collect();
    (bytes, all)
}

/// The same rays give the same samples, except for directions that are rounded from another tile's centre.
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

/// The contrast of a pixel depends on the band, not on the requested rows.
#[test]
fn needs_do_not_depend_on_the_requested_rows() {
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
fn contrast_spreads_to_the_four_neighbours_only() {
    let mut contrasts = Contrasts::new(40);
    contrasts.put(20, 5, 30.0);
    let needs = |column, row| dispatch!(simd::best(), simd => contrasts.needs(simd, column, row, 40.0));
    let bit = |column: u32| 1 << (column - 16);
    assert_eq!(needs(16, 5), Needs { one: bit(19) | bit(20) | bit(21), all: 0 });
    for row in [4, 6] {
        assert_eq!(needs(16, row), Needs { one: bit(20), all: 0 });
    }
    for row in [3, 7] {
        assert_eq!(needs(16, row), Needs::default());
    }
    let strong = dispatch!(simd::best(), simd => contrasts.needs(simd, 16, 5, 30.0));
    assert_eq!(strong, Needs { one: bit(19) | bit(21), all: bit(20) });
}
