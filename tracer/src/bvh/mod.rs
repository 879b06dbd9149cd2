//! Bounding volume hierarchies: building, node layouts, validation.
//!
//! Binary trees are widened, over the items of a scene as well as over the triangles of a mesh, so that one vector
//! operation tests sixteen boxes.

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

/// Largest depth of a binary tree. A balanced tree over 2^28 primitives has depth 28; deeper builds are replaced by
/// builds by the median.
const MAX_DEPTH: usize = 64;

/// Largest depth of a wide tree: it bounds the stacks of traversals.
pub(crate) const MAX_WIDE_DEPTH: usize = 16;
