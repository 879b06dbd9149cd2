//! The dial: quality for speed while the picture moves, and full quality when it rests.
//!
//! The [`governor`] decides on numbers only: it is told what frames took, and answers with a rung of a ladder of
//! settings. [`stillness`] tells whether the picture moves. Neither knows a clock.

#![cfg_attr(not(test), expect(dead_code, reason = "the window does not turn it yet"))]

mod costs;
pub(crate) mod governor;
pub(crate) mod stillness;

#[cfg(test)]
mod simulation;
