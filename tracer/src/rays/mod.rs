//! Where rays come from: tiles of the camera, tiles of a light, blocks of any sixteen rays.
//!
//! ```text
//!   ray          single rays
//!   hit          the primitives that sixteen rays hit, or start on
//!   source       what all sources have in common
//!   projection   a point or a direction to project along, and the picture seen from there
//!   tile         256 rays in such a picture
//!   eye          tiles of a pinhole camera
//!   parallel     tiles of an orthographic camera: their rays are parallel
//!   fisheye      batches of a fisheye camera
//!   mirror       tiles of a plane mirror: the reflected rays of a tile of a pinhole camera
//!   shadow       tiles of a point light, or of a directional one: its rays are parallel
//!   block        any sixteen rays
//!   batch        sixteen blocks, which are shaded as a tile is
//! ```

mod batch;
mod block;
mod eye;
mod fisheye;
mod hit;
mod mirror;
mod parallel;
mod projection;
mod ray;
mod shadow;
mod source;
mod tile;

pub(crate) use batch::{BATCH, RayBatch};
pub(crate) use block::RayBlock;
pub(crate) use eye::EyeTile;
pub(crate) use hit::{HitBlock, NO_ITEM, PrimitiveId};
pub(crate) use mirror::{MirrorTile, MirroredRay};
pub(crate) use parallel::ParallelTile;
pub(crate) use projection::{Frustum, Projection, ROUNDING};
pub(crate) use ray::Ray;
pub use ray::RayCounts;
pub(crate) use shadow::{ShadowTarget, ShadowTile};
pub(crate) use source::{LocalRays, PictureTile, RaySource, SurfaceSource};
pub(crate) use tile::{ALL_BLOCKS, BLOCKS, SIDE, TileColors, TileRays, TileSamples, place};
pub use tile::{TILE_SIZE, tile_rows};
