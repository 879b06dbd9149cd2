//! Measurement: simulated farms ([`simulator`]), speed against accuracy on one machine ([`tradeoff`]), plots of the tables
//! that both write ([`plot`]), and bounds of the rays of a frame ([`ray_bounds`]).

pub(crate) mod plot;
pub(crate) mod ray_bounds;
pub mod simulator;
pub(crate) mod tradeoff;
