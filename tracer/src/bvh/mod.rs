//! Bounding volume hierarchies: built bottom up and improved by `obvhs`, kept in an own layout, walked by an own traversal.
//!
//! Binary trees are widened, over the items of a scene (those never travel) as over the triangles of a mesh, so that one vector
//! operation looks at sixteen boxes.

mod build;
mod cluster;
mod collapse;
mod divide;
mod fill;
mod node;
#[cfg(test)]
mod patterns;
mod reinsert;
mod wide;

pub use build::BuildQuality;
use build::Tree;
pub(crate) use build::build_wide;
use node::{Child, Node};
pub(crate) use wide::{WIDTH, WideChild, WideNode, WideTree, validate_wide};

/// Deepest tree that traversal accepts: the size of its stack. A balanced tree over 2^28 primitives is 28 deep;
/// builds that end deeper are built again by the median.
const MAX_DEPTH: usize = 64;

/// Deepest wide tree that walks accept: it bounds their stacks.
pub(crate) const MAX_WIDE_DEPTH: usize = 16;
