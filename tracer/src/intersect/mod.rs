//! Intersections of rays with the scene.
//!
//! ```text
//!   exact      one ray with one primitive, in f64: decides every hit that a filter leaves open
//!   cutout     holes of triangles that alpha cuts out
//!   coincide   which of several coincident surfaces is hit
//!   single     one ray: closest hit and any hit
//!   block      any sixteen rays: closest hits and any hits
//!   volumes    one ray: its ways inside of volumes
//!   tile       256 rays of a tile: closest hits of the camera's rays, occlusion of a light
//!   world      the same for rays of world space: the public interface
//! ```
//!
//! All of them give the same hits, to the bit, on every level of SIMD: filters in `f32` carry error bounds, and what is not
//! certain within these is tested exactly.

mod block;
mod coincide;
mod cutout;
mod exact;
mod single;
pub(crate) mod tile;
mod volumes;
mod world;

pub(crate) use exact::Hit;
pub(crate) use single::{Crossings, TimedRay};
pub(crate) use volumes::VolumeSections;
pub use world::{Primitive, RayHit, RaySegment};
