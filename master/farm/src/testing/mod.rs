//! A scripted worker and a tiny scene, for the tests of this crate and of those that use a farm.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used, reason = "only tests use this module")]

pub mod fake_worker;
pub mod test_scene;
