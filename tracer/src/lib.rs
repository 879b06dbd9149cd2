//! The ray tracer of rayfarm: a scene in, pixels out.

pub mod image;
pub mod mesh;
pub mod scene;
