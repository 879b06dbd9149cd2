//! A texture: arbitrary bytes, or with an odd first byte changes of a sound one of linear light. What is accepted is rendered as a
//! panorama.
#![no_main]

use std::sync::{Arc, LazyLock};

use libfuzzer_sys::fuzz_target;
use rayfarm_fuzz::changed;
use rayfarm_tracer::image::LinearImage;
use rayfarm_tracer::scene::{self, Background, Filter, FrameView, Scene, Sky, SkyPicture, TextureMap};
use rayfarm_tracer::texture::Texture;
use rayfarm_tracer::{CompiledScene, PreparedFrame, render_rows};

const SCENE: &str = "
    render = { width = 16, height = 12 }
    camera = { position = [0.5, 0.5, 4], look_at = [0.5, 0.5, 0] }
    sphere = [{ center = [0, 0, 0], radius = 0.1 }]
";

static SOUND: LazyLock<(Scene, Vec<u8>)> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, SCENE).expect("a scene");
    let mut scene = scene::load(&path).expect("a sound scene").scene;
    let sky = Sky { picture: SkyPicture::Panorama(0), rotate: 30.0, strength: 2.0 };
    scene.background = Background::Sky(sky);
    let pixels = (0..3 * 8 * 4).map(|i| i as f32).collect();
    let (texture, _) = Texture::linear(&LinearImage { width: 8, height: 4, pixels }).expect("a sound texture");
    (scene, texture.bytes().to_vec())
});

fuzz_target!(|data: &[u8]| {
    let Some((first, rest)) = data.split_first() else { return };
    let (scene, sound) = &*SOUND;
    let bytes = if first % 2 == 1 { changed(sound, rest) } else { rest.to_vec() };
    let Ok(texture) = Texture::from_bytes(&bytes) else { return };
    assert_eq!(texture.bytes(), bytes);
    let scene = Scene { textures: vec![TextureMap::new(texture.id(), Filter::Bilinear)], ..scene.clone() };
    let Ok(compiled) = CompiledScene::new(scene, [], [Arc::new(texture)]) else { return };
    let view = FrameView::of(compiled.scene());
    let Ok(frame) = PreparedFrame::new(Arc::new(compiled), &view) else { return };
    let mut pixels = vec![0; (view.width * view.height * 3) as usize];
    let _ = render_rows(&frame, 0..view.height, &mut pixels, &|| false);
});
