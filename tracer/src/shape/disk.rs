//! Ray-disk intersection in `f64`.

use glam::DVec3;

use super::EyePlane;

/// A flat disk in the space of the rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EyeDisk {
    /// Centre, on the plane.
    pub center: DVec3,
    /// Radius, above zero.
    pub radius: f64,
    /// The plane that it is part of.
    pub plane: EyePlane,
}

impl EyeDisk {
    /// Distance t > 0 of the hit, in lengths of `direction`. Rays parallel to the disk have none.
    pub(crate) fn intersect(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let t = self.plane.intersect(origin, direction)?;
        let from_center = origin - self.center + direction * t;
        (from_center.length_squared() <= self.radius * self.radius).then_some(t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disk_is_hit_within_its_radius_from_both_sides() {
        let plane = EyePlane { normal: DVec3::Y, offset: -2.0, error: 0.0 };
        let disk = EyeDisk { center: DVec3::new(1.0, -2.0, 0.0), radius: 0.5, plane };
        assert_eq!(disk.intersect(DVec3::X * 1.4, DVec3::NEG_Y), Some(2.0));
        assert_eq!(disk.intersect(DVec3::X * 1.6, DVec3::NEG_Y), None);
        assert_eq!(disk.intersect(DVec3::new(1.0, -5.0, 0.4), DVec3::Y), Some(3.0));
        assert_eq!(disk.intersect(DVec3::new(1.0, -5.0, 0.4), DVec3::X), None);
    }
}
