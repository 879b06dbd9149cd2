//! The named shapes that everything is made of.

mod boxes;
mod grid;
mod lathe;
mod moulding;
mod soft;
mod sweep;

pub(crate) use boxes::{beveled_box, plain_box};
pub(crate) use grid::{Ends, grid};
pub(crate) use lathe::{lathe, lathe_every, lathe_fine, spline};
pub(crate) use moulding::{rectangle_moulding, straight_moulding};
pub(crate) use soft::{Softness, cushion, pillow, rounded_box};
pub(crate) use sweep::{Path, disc, sweep, tube};
