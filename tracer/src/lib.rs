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
//! The way of the data while rows are rendered, each folder importing only those before it:
//!
//! ```text
//!   compile      scene, meshes, textures and the shape of the scene's tree
//!   frame        the scene in eye space, with a camera
//!   rays         tiles of the camera and of lights, blocks of any sixteen rays
//!   intersect    rays to hits
//!   surface      hits to points, normals, materials
//!   light, bsdf  incident light, reflection
//!   sampler      random numbers of paths
//!   film         samples to pixels
//!   integrator   the loop over tiles, and the shading equation
//!   reference    the same in f64, by brute force
//! ```
//!
//! Features, all of them enabled by default: `import` loads scene files and models, `pictures` decodes and saves picture files.
//! Without both, the crate renders a [`scene::Scene`] with compiled meshes and textures.

mod bsdf;
mod bvh;
mod cancel;
mod compile;
pub mod files;
mod film;
mod frame;
pub mod image;
mod integrator;
mod intersect;
mod light;
mod material;
pub mod mesh;
pub mod numerics;
mod rays;
pub mod reference;
pub mod rotation;
mod sampler;
pub mod scene;
mod shape;
mod simd;
pub mod srgb;
mod surface;
pub mod texture;

pub use cancel::{Cancelled, IsCancelled};
pub use compile::{CompileError, CompiledScene};
pub use film::{GUIDES, Guides, MAX_RADIANCE, PixelSums, denoise, develop, develop_denoised};
pub use frame::{Basis, PreparedFrame};
pub use integrator::{Stage, Watch, render_rows, render_rows_watched};
pub use intersect::{Primitive, RayHit, RaySegment};
pub use rays::{RayCounts, TILE_SIZE, tile_rows};
pub use scene::PixelFormat;
pub use simd::best_name as simd_level;
