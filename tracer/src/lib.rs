//! The ray tracer of rayfarm: a scene in, pixels out. No sockets, no async, no window; useful by itself.
//!
//! The pipeline, in the order of the data:
//!
#![cfg_attr(feature = "import", doc = "```")]
#![cfg_attr(not(feature = "import"), doc = "```ignore")]
//! use std::sync::Arc;
//! use rayfarm_tracer::{CompiledScene, PreparedFrame, image, render_rows, scene};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("scene.toml");
//! # std::fs::write(&path, "
//! #     render = { width = 32, height = 24 }
//! #     camera = { position = [0, 0, 4], look_at = [0, 0, 0] }
//! #     material = { red = { diffuse = [0.8, 0.1, 0.1] } }
//! #     sphere = [{ center = [0, 0, 0], radius = 1, material = 'red' }]
//! # ")?;
//! let loaded = scene::load(&path)?;                                      // file -> plain data, meshes, textures
//! let view = scene::FrameView::of(&loaded.scene);                        // camera, size, samples
//! let scene = Arc::new(CompiledScene::new(loaded.scene, loaded.meshes, loaded.textures)?);
//! let frame = PreparedFrame::new(scene, &view)?;                         // everything in eye space
//! let mut picture = image::RgbImage::new(view.width, view.height);
//! render_rows(&frame, 0..view.height, &mut picture.pixels, &|| false)?;  // any rows, in any order
//! image::save(&folder.path().join("picture.png"), &picture)?;
//! # Ok(())
//! # }
//! ```
//!
//! Features, all of them enabled by default: `import` loads scene files and models, `pictures` decodes and saves picture files.
//! Without both, the crate renders a [`scene::Scene`] with compiled meshes and textures.

mod bvh;
mod camera;
mod cancel;
mod compile;
mod cutout;
pub mod files;
mod frame;
pub mod image;
mod light;
mod material;
pub mod mesh;
pub mod numerics;
mod plane;
pub mod reference;
mod render;
pub mod rotation;
pub mod scene;
mod shade;
mod simd;
mod sphere;
pub mod srgb;
mod stage;
pub mod texture;
mod tile;
mod trace;
mod triangle;

pub use camera::Basis;
pub use cancel::{Cancelled, IsCancelled};
pub use compile::{CompileError, CompiledScene};
pub use frame::{PreparedFrame, tile_rows};
pub use render::{RayCounts, TILE_SIZE, render_rows, render_rows_watched};
pub use simd::best_name as simd_level;
pub use stage::{Stage, Watch};
pub use trace::{Primitive, RayHit};
