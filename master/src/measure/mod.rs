//! Measurement: simulated farms ([`simulator`]), speed against accuracy on one machine ([`tradeoff`]), and plots of the tables
//! that both write ([`plot`]).

pub(crate) mod plot;
pub mod simulator;
pub(crate) mod tradeoff;
