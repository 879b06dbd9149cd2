//! Shoots one ray from the camera of a scene through the middle of the picture, and prints the closest hit.
//!
//! ```sh
//! cargo run --release -p rayfarm-tracer --example shoot_ray -- models/room.toml
//! ```

use std::error::Error;
use std::path::PathBuf;
use std::sync::Arc;

use rayfarm_tracer::scene::{self, FrameView};
use rayfarm_tracer::{CompiledScene, PreparedFrame};

fn main() -> Result<(), Box<dyn Error>> {
    let Some(input) = std::env::args_os().nth(1).map(PathBuf::from) else {
        return Err("usage: shoot_ray SCENE".into());
    };

    let loaded = scene::load(&input)?;
    let view = FrameView::of(&loaded.scene);
    let camera = loaded.scene.camera;
    let scene = Arc::new(CompiledScene::new(loaded.scene, loaded.meshes, loaded.textures)?);
    let frame = PreparedFrame::new(scene, &view)?;

    let (origin, direction) = (camera.position, (camera.look_at - camera.position).normalize());
    match frame.closest_hit(origin, direction, f64::INFINITY) {
        Some(hit) => println!("{:?} at distance {}: {}", hit.primitive, hit.t, origin + hit.t * direction),
        None => println!("the background"),
    }
    Ok(())
}
