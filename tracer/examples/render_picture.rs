//! Renders a scene to a picture, on all cores.
//!
//! ```sh
//! cargo run --release -p rayfarm-tracer --example render_picture -- models/room.toml room.png
//! ```

use std::error::Error;
use std::path::PathBuf;
use std::sync::Arc;

use rayfarm_tracer::image::{self, RgbImage};
use rayfarm_tracer::scene::{self, FrameView};
use rayfarm_tracer::{CompiledScene, PreparedFrame, render_rows, tile_rows};
use rayon::prelude::*;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let (Some(input), Some(output)) = (arguments.next(), arguments.next()) else {
        return Err("usage: render_picture SCENE OUTPUT".into());
    };

    let loaded = scene::load(&input)?;
    let view = FrameView::of(&loaded.scene);
    let scene = Arc::new(CompiledScene::new(loaded.scene, loaded.meshes, loaded.textures)?);
    let frame = PreparedFrame::new(scene, &view)?;

    let mut picture = RgbImage::new(view.width, view.height);
    // A band of whole tiles is the smallest piece of a frame that costs no ray twice.
    let band_rows = tile_rows(&view);
    let band_bytes = band_rows as usize * view.width as usize * 3;
    let bands = (0..view.height.div_ceil(band_rows)).into_par_iter();
    picture.pixels.par_chunks_mut(band_bytes).zip(bands).try_for_each(|(pixels, band)| {
        let first = band * band_rows;
        let rows = first..(first + band_rows).min(view.height);
        render_rows(&frame, rows, pixels, &|| false).map(|_| ())
    })?;
    image::save(&output, &picture)?;
    Ok(())
}
