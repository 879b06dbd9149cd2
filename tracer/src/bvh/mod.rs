//! Bounding volume hierarchies: built by `obvhs`, kept in an own layout, walked by an own traversal.
//!
//! The same tree serves both levels: triangles of a mesh, and instances of a scene.

mod build;
mod node;
mod traverse;
mod validate;

pub use build::{Tree, build};
pub use node::{Child, Node};
pub use traverse::{RaySlabs, traverse};
pub use validate::{TreeError, validate};

/// Deepest tree that traversal accepts: the size of its stack. A balanced tree over 2^28 primitives is 28 deep;
/// builds that end deeper are built again by the median.
pub const MAX_DEPTH: usize = 64;
