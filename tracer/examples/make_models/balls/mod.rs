//! Scenes of balls for the path integrator: some hundred at random, and ten thousand in a spiral.

mod field;
mod random;
mod text;

use super::{Content, GeneratedFile};

/// The scene files, in `models/` itself.
pub(crate) fn scenes() -> Vec<GeneratedFile> {
    let scene = |path: &str, text| GeneratedFile {
        path: path.to_owned(),
        content: Content::Text(text),
        triangles: 0,
    };
    vec![scene("balls-random.toml", random::scene()), scene("balls-10000.toml", field::scene())]
}
