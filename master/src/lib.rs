//! The master of rayfarm: owns the scene and the screen, hands out segments, assembles frames.
//!
//! The seam between what draws and what renders is [`farm::Farm`]: everything above it (command line, window,
//! reports) asks for frames and shows them; everything below it (scheduler, sessions, framebuffers, local worker
//! processes) sees to it that each one completes.

pub mod farm;
pub mod scheduler;
