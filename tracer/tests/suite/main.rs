//! Tests of the tracer's public API. One program, so that the tracer is linked once.

#![allow(clippy::panic, clippy::unwrap_used, reason = "a test fails by panicking")]

mod adaptive;
mod auxiliary;
mod build_quality;
mod cameras;
mod coincident;
mod common;
mod cuts;
mod extremes;
mod golden;
mod knobs;
mod mutated_models;
mod numerics;
mod oracle;
mod partial_shadows;
mod physics;
mod project_scenes;
mod shadows;
mod surfaces;
mod textures;
mod workloads;
