//! Rows are the same bytes on every level of SIMD.

use std::path::Path;
use std::sync::Arc;

use super::*;
use crate::scene::{CameraKind, FovAxis, FrameView, Quality};
use crate::{CompiledScene, simd};

/// Size of the pictures: small, because continuous integration runs the scalar level without optimisation.
const WIDTH: u32 = 90;
const HEIGHT: u32 = 70;

/// Every kind of light, primitive, normal, exponent and texture, on every level that this machine has.
#[test]
fn all_levels_of_simd_render_the_same_bytes() {
    for scene in ["lights.toml", "room.toml", "textured.toml"] {
        let (compiled, own) = compiled(scene);
        for (samples, adaptive) in [(4, false), (9, true)] {
            let quality = Quality { adaptive, ..own.quality };
            let view = FrameView { width: WIDTH, height: HEIGHT, samples, quality, ..own };
            check_levels(&compiled, &view, scene);
        }
    }
}

#[test]
fn all_levels_of_simd_render_the_same_bytes_with_every_kind_of_camera() {
    let scene = "textured.toml";
    let (compiled, own) = compiled(scene);
    let view_height = 0.7 * own.camera.position.distance(own.camera.look_at);
    let horizontal = CameraKind::Pinhole { fov_axis: FovAxis::Horizontal };
    for kind in [horizontal, CameraKind::Orthographic { view_height }, CameraKind::Fisheye] {
        for (samples, adaptive) in [(1, false), (4, true)] {
            let quality = Quality { adaptive, ..own.quality };
            let mut view = FrameView { width: WIDTH, height: HEIGHT, samples, quality, ..own };
            view.camera.kind = kind;
            check_levels(&compiled, &view, scene);
        }
    }
}

fn compiled(scene: &str) -> (Arc<CompiledScene>, FrameView) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models").join(scene);
    let loaded = crate::scene::load(&path).unwrap();
    let own = FrameView::of(&loaded.scene);
    (Arc::new(CompiledScene::new(loaded.scene, loaded.meshes, loaded.textures).unwrap()), own)
}

fn check_levels(compiled: &Arc<CompiledScene>, view: &FrameView, scene: &str) {
    let mut frame = PreparedFrame::new(Arc::clone(compiled), view).unwrap();
    let mut bytes_at = |level| {
        frame.level = level;
        let mut bytes = vec![0; (WIDTH * HEIGHT * 3) as usize];
        render_rows(&frame, 0..HEIGHT, &mut bytes, &|| false).unwrap();
        bytes
    };
    let first = bytes_at(simd::best());
    for level in simd::all() {
        let (same, name) = (bytes_at(level) == first, simd::name(level));
        let FrameView { samples, quality, camera, .. } = view;
        let (kind, adaptive) = (camera.kind, quality.adaptive);
        assert!(same, "{scene}, {kind:?}, {samples} samples, adaptive {adaptive}, with {name}");
    }
}
