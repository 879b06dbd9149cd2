//! Rows are the same bytes on every level of SIMD.

use std::path::Path;
use std::sync::Arc;

use super::*;
use crate::scene::{FrameView, Quality};
use crate::{CompiledScene, simd};

/// Size of the pictures: small, because continuous integration runs the scalar level without optimisation.
const WIDTH: u32 = 90;
const HEIGHT: u32 = 70;

/// Every kind of light, primitive, normal, exponent and texture, on every level that this machine has.
#[test]
fn all_levels_of_simd_render_the_same_bytes() {
    for scene in ["lights.toml", "room.toml", "textured.toml"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models").join(scene);
        let loaded = crate::scene::load(&path).unwrap();
        let own = FrameView::of(&loaded.scene);
        let compiled = Arc::new(CompiledScene::new(loaded.scene, loaded.meshes, loaded.textures).unwrap());
        for (samples, adaptive) in [(4, false), (9, true)] {
            let quality = Quality { adaptive, ..own.quality };
            let view = FrameView { width: WIDTH, height: HEIGHT, samples, quality, ..own };
            let mut frame = PreparedFrame::new(Arc::clone(&compiled), &view).unwrap();
            let mut bytes_at = |level| {
                frame.level = level;
                let mut bytes = vec![0; (WIDTH * HEIGHT * 3) as usize];
                render_rows(&frame, 0..HEIGHT, &mut bytes, &|| false).unwrap();
                bytes
            };
            let first = bytes_at(simd::best());
            for level in simd::all() {
                let same = bytes_at(level) == first;
                assert!(same, "{scene}, {samples} samples, adaptive {adaptive}, with {}", simd::name(level));
            }
        }
    }
}
