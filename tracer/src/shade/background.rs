//! What a ray sees that hits nothing.

use glam::{DVec3, Vec3};

use crate::scene::Background;

/// One colour, or a gradient over the elevation of the ray: linear in (d.y + 1) / 2 of its unit direction.
pub(super) fn background(background: &Background, direction: DVec3) -> Vec3 {
    match *background {
        Background::Color(color) => color,
        Background::Gradient { bottom, top } => {
            let share = (direction.y / direction.length() + 1.0) / 2.0;
            bottom + (top - bottom) * share as f32
        }
    }
}
