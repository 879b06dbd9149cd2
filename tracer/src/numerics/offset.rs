//! The scene far from the world's origin, together with its camera: it must give the same picture, up to the digits
//! of its positions.

use glam::DVec3;

use super::oracle::{affordable, chosen, compare};
use super::placed::placed;
use super::{Check, Effort, Outcome, Subject};
use crate::compile::CompileError;

/// Distances from the origin, in extents of the scene.
const DISTANCES: [f64; 4] = [1e1, 1e3, 1e5, 1e6];

/// Counts pixels that differ from the oracle's, of the scene moved by up to 10^6 of its extents. Pixels that changed
/// by the move are compared first.
///
/// # Errors
/// A scene that cannot be traced.
pub fn offset(subject: &Subject, effort: &Effort) -> Result<Vec<Outcome>, CompileError> {
    let near = subject.rendered(effort.side)?;
    let extent = subject.extent()?;
    let at = |distance: f64| {
        let offset = DVec3::new(1.0, -1.0, 0.5) * (distance * extent);
        let far = subject.with(placed(&subject.scene, 1.0, offset));
        let picture = far.rendered(effort.side)?;
        let changed = changed(&near, &picture);
        let pixels = chosen(&changed, near.len() / 3, affordable(subject, effort));
        let comparison = compare(&far, &far.view(effort.side), &picture, &pixels);
        Ok(Outcome {
            check: Check::Offset,
            case: format!("{distance:e} extents, {} changed", changed.len()),
            unit: "pixels",
            tested: comparison.tested,
            at_edges: comparison.at_edges,
            wrong: comparison.wrong,
            failures: comparison.failures.iter().map(ToString::to_string).collect(),
        })
    };
    DISTANCES.into_iter().map(at).collect()
}

/// Pixels with a channel that differs by more than a step.
fn changed(a: &[u8], b: &[u8]) -> Vec<usize> {
    let pairs = a.chunks_exact(3).zip(b.chunks_exact(3));
    let differs = |(a, b): (&[u8], &[u8])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 1);
    pairs.enumerate().filter(|(_, pair)| differs(*pair)).map(|(pixel, _)| pixel).collect()
}
