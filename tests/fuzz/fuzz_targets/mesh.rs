//! A compiled mesh: arbitrary bytes, or with an odd first byte changes of a sound one. What is accepted is rendered.
#![no_main]

use std::sync::{Arc, LazyLock};

use libfuzzer_sys::fuzz_target;
use rayfarm_fuzz::changed;
use rayfarm_tracer::mesh::CompiledMesh;
use rayfarm_tracer::scene::{self, FrameView, Scene};
use rayfarm_tracer::{CompiledScene, PreparedFrame, render_rows};

const SCENE: &str = "
    render = { width = 16, height = 12 }
    camera = { position = [0.5, 0.5, 4], look_at = [0.5, 0.5, 0] }
    model = [{ file = 'model.obj' }]
";

static SOUND: LazyLock<(Scene, Vec<u8>)> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, SCENE).expect("a scene");
    std::fs::write(folder.path().join("model.obj"), grid(8)).expect("a model");
    let loaded = scene::load(&path).expect("a sound scene");
    (loaded.scene, loaded.meshes[0].bytes().to_vec())
});

/// A sheet of n x n squares in OBJ, bent, with texture coordinates.
fn grid(n: usize) -> String {
    let mut text = String::new();
    for i in 0..(n + 1) * (n + 1) {
        let (x, y) = ((i % (n + 1)) as f64 / n as f64, (i / (n + 1)) as f64 / n as f64);
        text += &format!("v {x} {y} {}\nvt {x} {y}\n", (x - y) * (x - y));
    }
    for i in (0..(n + 1) * n).filter(|i| i % (n + 1) < n) {
        let [a, b, c, d] = [i + 1, i + 2, i + n + 3, i + n + 2];
        text += &format!("f {a}/{a} {b}/{b} {c}/{c} {d}/{d}\n");
    }
    text
}

fuzz_target!(|data: &[u8]| {
    let Some((first, rest)) = data.split_first() else { return };
    let (scene, sound) = &*SOUND;
    let bytes = if first % 2 == 1 { changed(sound, rest) } else { rest.to_vec() };
    let Ok(mesh) = CompiledMesh::from_bytes(&bytes) else { return };
    assert_eq!(mesh.bytes(), bytes);
    let mut scene = scene.clone();
    scene.models.iter_mut().for_each(|model| model.mesh = mesh.id());
    let Ok(compiled) = CompiledScene::new(scene, [Arc::new(mesh)], []) else { return };
    let view = FrameView::of(compiled.scene());
    let Ok(frame) = PreparedFrame::new(Arc::new(compiled), &view) else { return };
    let mut pixels = vec![0; (view.width * view.height * 3) as usize];
    let _ = render_rows(&frame, 0..view.height, &mut pixels, &|| false);
});
