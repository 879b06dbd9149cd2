//! Checks of the numerics on a scene. They return counts, to be printed or asserted.
//!
//! | check | what is counted | against |
//! | --- | --- | --- |
//! | [`leaks`] | rays that pass between two triangles with a common edge or vertex at which they are aimed | geometry alone |
//! | [`acne`] | pixels that are too dark or too bright, under the scene's lights and grazing ones | the oracle |
//! | [`scale`] | bytes that change when the scene is scaled by 2^k | the unscaled scene |
//! | [`offset`] | wrong pixels when the scene is far from the origin | the oracle |
//! | [`levels`] | bytes that differ on another level of SIMD | the best level |
//!
//! The checks are deterministic: the same scene and [`Effort`] give the same counts on every machine.

mod acne;
mod leaks;
mod levels;
mod offset;
mod oracle;
mod placed;
mod random;
mod replay;
mod scale;
mod scenes;
mod seams;
#[cfg(test)]
mod tests;

use std::fmt;
use std::sync::Arc;

use crate::compile::{CompileError, CompiledScene};
use crate::frame::PreparedFrame;
use crate::integrator::render_rows;
use crate::mesh::CompiledMesh;
#[cfg(feature = "import")]
use crate::scene::LoadedScene;
use crate::scene::{FrameView, Scene};
use crate::texture::Texture;

pub use acne::acne;
pub use leaks::leaks;
pub use levels::levels;
pub use offset::offset;
pub use replay::replay;
pub use scale::scale;
pub use scenes::built_in;

/// A scene with its meshes and textures, to be checked.
#[derive(Clone, Debug)]
pub struct Subject {
    /// Name for tables.
    pub name: String,
    /// Scene that is checked.
    pub scene: Scene,
    /// Meshes of the scene.
    pub meshes: Vec<Arc<CompiledMesh>>,
    /// Textures of the scene.
    pub textures: Vec<Arc<Texture>>,
}

/// Extent of the checks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Rays aimed at edges and vertices, in all places of the scene together.
    pub rays: u64,
    /// Pixels on the longer side of the pictures, with one sample per pixel.
    pub side: u32,
    /// Ray-primitive tests that the oracle may perform per picture: it tests all primitives for each ray of each
    /// pixel.
    pub oracle_work: u64,
    /// Pixels of each picture that are compared with the oracle; `None`: as many as `oracle_work` allows.
    pub pixels: Option<u32>,
}

impl Default for Effort {
    /// Takes some seconds for a scene of 100,000 triangles.
    fn default() -> Self {
        Self { rays: 200_000, side: 192, oracle_work: 20_000_000, pixels: None }
    }
}

/// A kind of check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Check {
    /// See [`leaks`].
    Leaks,
    /// See [`acne`].
    Acne,
    /// See [`scale`].
    Scale,
    /// See [`offset`].
    Offset,
    /// See [`levels`].
    Levels,
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Leaks => "leaks",
            Self::Acne => "acne",
            Self::Scale => "scale",
            Self::Offset => "offset",
            Self::Levels => "levels",
        })
    }
}

/// Counts of one case of a check.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// Check that has the outcome.
    pub check: Check,
    /// The case: light, place or level.
    pub case: String,
    /// Unit of the counts: rays, pixels or bytes.
    pub unit: &'static str,
    /// Number of tested units.
    pub tested: u64,
    /// Undecided units: pixels at an edge, where rounding may show either side, and rays aimed at an outline or a
    /// border, which may pass.
    pub at_edges: u64,
    /// Wrong units.
    pub wrong: u64,
    /// Descriptions of the first wrong units, one line each.
    pub failures: Vec<String>,
}

impl Outcome {
    /// Whether no unit is wrong.
    pub fn holds(&self) -> bool {
        self.wrong == 0
    }
}

/// Runs all checks of one scene.
///
/// # Errors
/// A scene that cannot be traced.
pub fn run(subject: &Subject, effort: &Effort) -> Result<Vec<Outcome>, CompileError> {
    let mut outcomes = leaks(subject, effort)?;
    outcomes.extend(acne(subject, effort)?);
    outcomes.extend(scale(subject, effort)?);
    outcomes.extend(offset(subject, effort)?);
    outcomes.extend(levels(subject, effort)?);
    Ok(outcomes)
}

impl Subject {
    /// A subject from a loaded scene.
    #[cfg(feature = "import")]
    pub fn new(name: impl Into<String>, loaded: LoadedScene) -> Self {
        let LoadedScene { scene, meshes, textures, .. } = loaded;
        Self { name: name.into(), scene, meshes, textures }
    }

    /// The subject with another scene of the same meshes and textures.
    fn with(&self, scene: Scene) -> Self {
        Self { scene, ..self.clone() }
    }

    /// The scene's own view with one sample per pixel, `side` pixels on its longer side.
    fn view(&self, side: u32) -> FrameView {
        let own = FrameView::of(&self.scene);
        let longer = u64::from(own.width.max(own.height)).max(1);
        let fit = |pixels: u32| (u64::from(pixels) * u64::from(side)).div_ceil(longer) as u32;
        FrameView { width: fit(own.width), height: fit(own.height), samples: 1, ..own }
    }

    fn prepared(&self, side: u32) -> Result<PreparedFrame, CompileError> {
        let (meshes, textures) = (self.meshes.iter().cloned(), self.textures.iter().cloned());
        let compiled = CompiledScene::new(self.scene.clone(), meshes, textures)?;
        PreparedFrame::new(Arc::new(compiled), &self.view(side))
    }

    /// The picture as RGB8 bytes.
    fn rendered(&self, side: u32) -> Result<Vec<u8>, CompileError> {
        Ok(picture(&self.prepared(side)?))
    }

    /// Largest extent of the finite geometry; without any, the distance of the camera's look-at point.
    fn extent(&self) -> Result<f64, CompileError> {
        let frame = self.prepared(1)?;
        let camera = &self.scene.camera;
        let looks_at = (camera.look_at - camera.position).length();
        Ok(frame.bounds().map_or(looks_at, |(lo, hi)| (hi - lo).max_element()))
    }
}

fn picture(frame: &PreparedFrame) -> Vec<u8> {
    let mut bytes = vec![0; frame.width() as usize * frame.height() as usize * 3];
    let _ = render_rows(frame, 0..frame.height(), &mut bytes, &|| false); // never cancelled
    bytes
}

fn differing_bytes(a: &[u8], b: &[u8]) -> u64 {
    a.iter().zip(b).filter(|(a, b)| a != b).count() as u64
}
