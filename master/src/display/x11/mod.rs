//! The X Window System, as far as minifb does not cover it: pixel depth, visibility and exposure.
//!
//! Other systems have an implementation that reports nothing.

cfg_select! {
    any(
        target_os = "linux",
        target_os = "freebsd",
        target_os = "dragonfly",
        target_os = "netbsd",
        target_os = "openbsd"
    ) => {
        mod connection;
        mod events;
        pub(super) use self::{connection::DepthCheck, events::WindowEvents};
    }
    _ => {
        mod absent;
        pub(super) use absent::{DepthCheck, WindowEvents};
    }
}
