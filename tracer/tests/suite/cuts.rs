//! Every division of a frame into rows, by any threads, gives the same frame.

use std::path::Path;
use std::sync::Arc;

use rayfarm_tracer::scene::{CameraKind, FovAxis, FrameView, Quality, load};
use rayfarm_tracer::{CompiledScene, PreparedFrame, render_rows};

const SCENES: [&str; 7] = [
    "room.toml",
    "lights.toml",
    "textured.toml",
    "instances.toml",
    "product.toml",
    "table.toml",
    "showroom.toml",
];

/// Scenes of the path integrator: they are rendered with few paths.
const PATH_SCENES: [&str; 7] = [
    "box.toml",
    "balls-glass.toml",
    "balls-metal.toml",
    "balls-random.toml",
    "balls-10000.toml",
    "product-path.toml",
    "showroom-path.toml",
];

/// Widths: one column, less than a tile, a tile and some columns, tiles and some columns.
const WIDTHS: [u32; 6] = [1, 3, 15, 17, 33, 150];

const THREADS: usize = 4;

fn compiled(name: &str) -> Arc<CompiledScene> {
    let loaded = load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../models").join(name)).unwrap();
    Arc::new(CompiledScene::new(loaded.scene, loaded.meshes, loaded.textures).unwrap())
}

/// The next number of a pseudo-random sequence (Marsaglia, "Xorshift RNGs", 2003).
fn next(state: &mut u32) -> u32 {
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    *state
}

fn rendered(frame: &PreparedFrame, rows: std::ops::Range<u32>) -> Vec<u8> {
    let mut bytes = vec![0xa5; rows.len() * frame.width() as usize * 3];
    render_rows(frame, rows, &mut bytes, &|| false).unwrap();
    bytes
}

/// Boundaries of pieces: some of one row, some of many.
fn cuts(height: u32, state: &mut u32) -> Vec<u32> {
    let mut cuts = vec![0];
    while let Some(&last) = cuts.last()
        && last < height
    {
        let most = [1, 3, 9, 40][next(state) as usize % 4];
        cuts.push((last + 1 + next(state) % most).min(height));
    }
    cuts
}

#[test]
fn a_frame_cut_into_rows_is_the_same_frame_at_any_width_and_number_of_samples() {
    let mut state = 0x2545_f491;
    for name in SCENES {
        let scene = compiled(name);
        for (i, width) in WIDTHS.into_iter().enumerate() {
            for grid in [1 + i as u32 % 4, 4 - i as u32 % 4] {
                let height = 1 + next(&mut state) % 70;
                let adaptive = next(&mut state).is_multiple_of(2);
                let quality = Quality { adaptive, dither: i % 2 == 1, ..Quality::default() };
                let samples = grid * grid;
                let view = FrameView { width, height, samples, quality, ..FrameView::of(scene.scene()) };
                let frame = PreparedFrame::new(Arc::clone(&scene), &view).unwrap();
                let whole = rendered(&frame, 0..height);
                let cuts = cuts(height, &mut state);
                let pieces = cuts.windows(2).flat_map(|cut| rendered(&frame, cut[0]..cut[1]));
                let same = pieces.eq(whole);
                assert!(same, "{name}, {width} x {height}, grid {grid}, {quality:?}, cut at {cuts:?}");
            }
        }
    }
}

#[test]
fn a_frame_of_paths_cut_into_rows_is_the_same_frame() {
    let mut state = 0x7ee1_0add;
    for name in PATH_SCENES {
        let scene = compiled(name);
        let (width, height, samples) = (33 + next(&mut state) % 5, 20 + next(&mut state) % 5, 2);
        let view = FrameView { width, height, samples, ..FrameView::of(scene.scene()) };
        let frame = PreparedFrame::new(Arc::clone(&scene), &view).unwrap();
        let whole = rendered(&frame, 0..height);
        let cuts = cuts(height, &mut state);
        let pieces = cuts.windows(2).flat_map(|cut| rendered(&frame, cut[0]..cut[1]));
        assert!(pieces.eq(whole.iter().copied()), "{name}, {width} x {height}, cut at {cuts:?}");
        assert!(whole.iter().any(|byte| *byte > 0), "{name} is black");
    }
}

#[test]
fn a_frame_cut_into_rows_is_the_same_frame_with_every_kind_of_camera() {
    let mut state = 0x0bad_cafe;
    let horizontal = CameraKind::Pinhole { fov_axis: FovAxis::Horizontal };
    for name in SCENES {
        let scene = compiled(name);
        let mut camera = scene.scene().camera;
        let view_height = 0.7 * camera.position.distance(camera.look_at);
        for kind in [horizontal, CameraKind::Orthographic { view_height }, CameraKind::Fisheye] {
            camera.kind = kind;
            let (width, height) = (1 + next(&mut state) % 70, 1 + next(&mut state) % 50);
            let (grid, adaptive) = (1 + next(&mut state) % 3, next(&mut state).is_multiple_of(2));
            let quality = Quality { adaptive, ..Quality::default() };
            let view = FrameView {
                camera,
                width,
                height,
                samples: grid * grid,
                spin: 0.0,
                quality,
                ..FrameView::default()
            };
            let frame = PreparedFrame::new(Arc::clone(&scene), &view).unwrap();
            let whole = rendered(&frame, 0..height);
            let cuts = cuts(height, &mut state);
            let pieces = cuts.windows(2).flat_map(|cut| rendered(&frame, cut[0]..cut[1]));
            assert!(pieces.eq(whole), "{name}, {kind:?}, {width} x {height}, grid {grid}, cut at {cuts:?}");
        }
    }
}

#[test]
fn pieces_rendered_by_several_threads_are_the_same_frame() {
    for (name, grid) in SCENES.into_iter().zip([1, 3, 2, 4, 1, 1, 2]) {
        let scene = compiled(name);
        let (width, height) = (150, 61);
        let quality = Quality { adaptive: grid > 2, ..Quality::default() };
        let samples = grid * grid;
        let view = FrameView { width, height, samples, quality, ..FrameView::of(scene.scene()) };
        let frame = PreparedFrame::new(scene, &view).unwrap();
        let whole = rendered(&frame, 0..height);
        // Each thread renders every fourth piece of five rows, the last ones first.
        let pieces: Vec<std::ops::Range<u32>> =
            (0..height).step_by(5).map(|top| top..(top + 5).min(height)).collect();
        std::thread::scope(|scope| {
            for first in 0..THREADS {
                let (frame, whole, pieces) = (&frame, &whole, &pieces);
                scope.spawn(move || {
                    for rows in pieces.iter().skip(first).step_by(THREADS).rev() {
                        let bytes = rows.start as usize * 450..rows.end as usize * 450;
                        let same = rendered(frame, rows.clone()) == whole[bytes];
                        assert!(same, "{name}, rows {rows:?}");
                    }
                });
            }
        });
    }
}
