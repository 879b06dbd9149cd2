//! The scene scaled by powers of two: no byte of the picture may change.

use glam::{DVec3, Vec3};

use super::placed::placed;
use super::{Check, Effort, Outcome, Subject, differing_bytes};
use crate::compile::CompileError;

/// Largest k of the factors 2^k.
const MOST: i32 = 20;

/// Counts bytes of the picture that change when the scene is scaled by 2^k, k from -20 to 20. Nothing absorbs light on its way:
/// the share that is left after a unit cannot be scaled exactly.
///
/// # Errors
/// A scene that cannot be traced.
pub fn scale(subject: &Subject, effort: &Effort) -> Result<Vec<Outcome>, CompileError> {
    let mut clear = subject.scene.clone();
    clear.materials.iter_mut().for_each(|material| material.absorption = Vec3::ONE);
    let own = subject.with(clear.clone()).rendered(effort.side)?;
    let mut outcomes = Vec::new();
    for (case, exponents) in [("2^-20 to 2^-1", -MOST..0), ("2^1 to 2^20", 1..MOST + 1)] {
        let (mut tested, mut wrong) = (0, 0);
        for exponent in exponents {
            let factor = libm::exp2(f64::from(exponent));
            let scaled = subject.with(placed(&clear, factor, DVec3::ZERO)).rendered(effort.side)?;
            tested += own.len() as u64;
            wrong += differing_bytes(&own, &scaled);
        }
        let case = case.to_owned();
        outcomes.push(Outcome {
            check: Check::Scale,
            case,
            unit: "bytes",
            tested,
            at_edges: 0,
            wrong,
            failures: Vec::new(),
        });
    }
    Ok(outcomes)
}
