//! Single rays, and counts of rays.

use std::ops::AddAssign;

use glam::DVec3;

use crate::frame::{Instance, Pose, PreparedFrame};

/// A ray o + t d in eye space; d need not be a unit vector.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub origin: DVec3,
    pub direction: DVec3,
}

/// Numbers of traced rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// Rays from the camera.
    pub primary: u64,
    /// Rays to lights.
    pub shadow: u64,
    /// Reflected and transmitted rays.
    pub secondary: u64,
}

impl RayCounts {
    /// Largest number of reflected and transmitted rays of one ray from the camera.
    pub const MAX_SECONDARY: u16 = 1024;
}

impl AddAssign for RayCounts {
    fn add_assign(&mut self, other: Self) {
        self.primary += other.primary;
        self.shadow += other.shadow;
        self.secondary += other.secondary;
    }
}

impl PreparedFrame {
    /// A ray of world space in eye space; `None` for an origin or a direction that is not finite, or a direction whose
    /// largest component is not within 1e-100 to 1e100.
    #[inline(always)]
    pub(crate) fn to_eye(&self, origin: DVec3, direction: DVec3) -> Option<Ray> {
        let reach = direction.abs().max_element();
        let usable = origin.is_finite() && direction.is_finite() && (1e-100..=1e100).contains(&reach);
        // Units are powers of two: t stays the same, to the bit.
        usable.then(|| Ray {
            origin: (origin - self.view().camera.position) * self.per_unit,
            direction: direction * self.per_unit,
        })
    }
}

impl Instance {
    /// A ray of eye space in the space of the mesh, with the same t.
    #[inline(always)]
    pub(crate) fn to_mesh(&self, ray: &Ray) -> Ray {
        Ray {
            origin: self.inverse * (ray.origin - self.translation),
            direction: self.inverse * ray.direction,
        }
    }
}

impl Pose {
    /// A ray as the object at rest meets it, with the same t.
    pub(crate) fn to_rest(&self, ray: &Ray) -> Ray {
        Ray { origin: self.point_to_rest(ray.origin), direction: self.direction_to_rest(ray.direction) }
    }
}
