//! Whether the numbers hold on a scene: checks that return counts, for whoever wants to see them or to fail on them.
//!
//! | check | what is counted | against |
//! | --- | --- | --- |
//! | [`leaks`] | rays that slip between triangles that share the edge or vertex they aim at | geometry alone |
//! | [`acne`] | pixels darker or brighter than they should be, under the scene's lights and grazing ones | the oracle |
//! | [`scale`] | bytes that change when the scene is scaled by 2^k | the scene as it is |
//! | [`offset`] | pixels that are wrong when the scene stands far from the origin | the oracle |
//! | [`levels`] | bytes that another level of SIMD renders | the best level |
//!
//! Nothing here is random from run to run: the same scene and [`Effort`] give the same counts on every machine.

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
use crate::scene::{FrameView, LoadedScene, Scene};
use crate::texture::Texture;

pub use acne::acne;
pub use leaks::leaks;
pub use levels::levels;
pub use offset::offset;
pub use replay::replay;
pub use scale::scale;
pub use scenes::built_in;

/// A scene with all it names.
#[derive(Clone, Debug)]
pub struct Subject {
    /// For tables.
    pub name: String,
    /// What to check.
    pub scene: Scene,
    /// Its meshes.
    pub meshes: Vec<Arc<CompiledMesh>>,
    /// Its textures.
    pub textures: Vec<Arc<Texture>>,
}

/// How much is checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Rays aimed at edges and vertices, over all places of the scene together.
    pub rays: u64,
    /// Pixels on the longer side of the pictures, one sample each.
    pub side: u32,
    /// Primitives that the oracle may be asked about for each picture: it asks all primitives for each ray of each pixel.
    pub oracle_work: u64,
    /// Pixels of each picture that the oracle is asked for, whatever that takes; `None`: as many as `oracle_work` allows.
    pub pixels: Option<u32>,
}

impl Default for Effort {
    /// Some seconds for a scene of 100,000 triangles.
    fn default() -> Self {
        Self { rays: 200_000, side: 192, oracle_work: 20_000_000, pixels: None }
    }
}

/// The kinds of checks.
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

/// What one case of a check counted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// The check.
    pub check: Check,
    /// Under which light, at which place, with which level.
    pub case: String,
    /// What was looked at: rays, pixels or bytes.
    pub unit: &'static str,
    /// How many of them.
    pub tested: u64,
    /// Those of them that say nothing: pixels on an edge, where rounding may see either side, and rays that were aimed at an
    /// outline or a border, which may pass.
    pub at_edges: u64,
    /// Those of them that are wrong.
    pub wrong: u64,
    /// What is wrong with the first of these, a line each.
    pub failures: Vec<String>,
}

impl Outcome {
    /// Whether nothing is wrong.
    pub fn holds(&self) -> bool {
        self.wrong == 0
    }
}

/// All checks of one scene.
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
    /// What was loaded, under a name.
    pub fn new(name: impl Into<String>, loaded: LoadedScene) -> Self {
        let LoadedScene { scene, meshes, textures, .. } = loaded;
        Self { name: name.into(), scene, meshes, textures }
    }

    /// Another scene of the same meshes and textures.
    fn with(&self, scene: Scene) -> Self {
        Self { scene, ..self.clone() }
    }

    /// The scene's own view, one sample a pixel, `side` pixels long.
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

    /// The picture as bytes, RGB8.
    fn rendered(&self, side: u32) -> Result<Vec<u8>, CompileError> {
        Ok(picture(&self.prepared(side)?))
    }

    /// Largest extent of what is finite; where nothing is, the distance to what the camera looks at.
    fn extent(&self) -> Result<f64, CompileError> {
        let frame = self.prepared(1)?;
        let camera = &self.scene.camera;
        let looks_at = (camera.look_at - camera.position).length();
        Ok(frame.bounds().map_or(looks_at, |(lo, hi)| (hi - lo).max_element()))
    }
}

fn picture(frame: &PreparedFrame) -> Vec<u8> {
    let mut bytes = vec![0; frame.width() as usize * frame.height() as usize * 3];
    let _ = render_rows(frame, 0..frame.height(), &mut bytes, &|| false); // nobody cancels it
    bytes
}

fn differing_bytes(a: &[u8], b: &[u8]) -> u64 {
    a.iter().zip(b).filter(|(a, b)| a != b).count() as u64
}
