//! Comparison of the SIMD levels of this machine, byte by byte.

use super::{Check, Effort, Outcome, Subject, differing_bytes, picture};
use crate::compile::CompileError;
use crate::simd;

/// Counts bytes of the picture that differ from those of the best level: one outcome for each other level.
///
/// # Errors
/// A scene that cannot be traced.
pub fn levels(subject: &Subject, effort: &Effort) -> Result<Vec<Outcome>, CompileError> {
    let mut frame = subject.prepared(effort.side)?;
    let best = picture(&frame);
    let mut outcomes: Vec<Outcome> = Vec::new();
    for level in simd::all() {
        let case = simd::name(level).to_owned();
        if case == simd::best_name() || outcomes.iter().any(|outcome| outcome.case == case) {
            continue;
        }
        frame.level = level;
        let wrong = differing_bytes(&best, &picture(&frame));
        let tested = best.len() as u64;
        outcomes.push(Outcome {
            check: Check::Levels,
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
