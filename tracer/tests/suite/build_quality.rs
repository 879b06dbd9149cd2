//! Pictures do not depend on the build quality of a mesh's tree, nor on the number of threads that build it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayfarm_tracer::mesh::{BuildQuality, CompileOptions, CompiledMesh};
use rayfarm_tracer::scene::{self, FrameView, compile_model};
use rayfarm_tracer::{CompiledScene, PreparedFrame, render_rows};

fn models() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../models")
}

fn queen(quality: BuildQuality) -> Arc<CompiledMesh> {
    let options = CompileOptions { quality, ..CompileOptions::default() };
    compile_model(&models().join("chess/queen.obj"), &models(), options).unwrap().0
}

/// The scene with all its models replaced by one.
fn picture_with(mesh: Arc<CompiledMesh>) -> Vec<u8> {
    let mut loaded = scene::load(&models().join("instances.toml")).unwrap();
    for model in &mut loaded.scene.models {
        model.mesh = mesh.id();
        model.materials = vec![0; mesh.material_count()];
    }
    let view = FrameView { width: 160, height: 120, samples: 4, ..FrameView::of(&loaded.scene) };
    let compiled = CompiledScene::new(loaded.scene, [mesh], loaded.textures).unwrap();
    let frame = PreparedFrame::new(Arc::new(compiled), &view).unwrap();
    let mut bytes = vec![0; 160 * 120 * 3];
    render_rows(&frame, 0..120, &mut bytes, &|| false).unwrap();
    bytes
}

#[test]
fn the_picture_does_not_depend_on_the_tree() {
    let meshes = [BuildQuality::Fast, BuildQuality::Default, BuildQuality::High].map(queen);
    assert_ne!(meshes[0].id(), meshes[1].id(), "the trees differ, or nothing is tested");
    assert_ne!(meshes[1].id(), meshes[2].id(), "the trees differ, or nothing is tested");
    let [fast, default, high] = meshes.map(picture_with);
    assert!(fast == default, "fast and default differ");
    assert!(high == default, "high and default differ");
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let id_with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| queen(BuildQuality::Default).id())
    };
    let first = id_with(1);
    for threads in [2, 3, 8] {
        assert_eq!(id_with(threads), first, "{threads} threads");
    }
}
