//! A changed compiled model is refused, or renders as another valid model.

use std::sync::{Arc, LazyLock};

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::Index;
use rayfarm_tracer::mesh::CompiledMesh;
use rayfarm_tracer::scene::{FrameView, Scene};
use rayfarm_tracer::{CompiledScene, PreparedFrame, render_rows};

const SIDE: u32 = 24;

static SCENE: LazyLock<(Scene, Arc<CompiledMesh>)> = LazyLock::new(|| crate::common::instanced(SIDE, SIDE));

/// Renders the instanced scene of the tests with this mesh in place of its own; `false` where they do not fit.
fn renders(bytes: &[u8]) -> bool {
    let Ok(mesh) = CompiledMesh::from_bytes(bytes) else { return false };
    let mut scene = SCENE.0.clone();
    scene.models.iter_mut().for_each(|model| model.mesh = mesh.id());
    let Ok(compiled) = CompiledScene::new(scene, [Arc::new(mesh)], []) else { return false };
    let view = FrameView::of(compiled.scene());
    let Ok(frame) = PreparedFrame::new(Arc::new(compiled), &view) else { return false };
    let mut pixels = vec![0; (SIDE * SIDE * 3) as usize];
    render_rows(&frame, 0..SIDE, &mut pixels, &|| false).is_ok()
}

#[test]
fn an_unchanged_model_renders() {
    assert!(renders(SCENE.1.bytes()));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn changed_bytes_end_nothing(
        hits in vec((any::<Index>(), any::<u8>()), 1..8),
        cut in prop::option::weighted(0.1, any::<Index>()),
    ) {
        let mut bytes = SCENE.1.bytes().to_vec();
        for (at, value) in hits {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        renders(&bytes);
    }

    #[test]
    fn changed_numbers_end_nothing(
        at in any::<Index>(),
        number in prop_oneof![any::<f32>(), Just(f32::NAN), Just(f32::INFINITY), Just(-0.0), Just(1.0), Just(f32::MIN_POSITIVE)],
    ) {
        let mut bytes = SCENE.1.bytes().to_vec();
        let at = at.index(bytes.len() / 4) * 4;
        bytes[at..at + 4].copy_from_slice(&number.to_le_bytes());
        renders(&bytes);
    }
}
