//! Ray-plane intersection in `f64`.

use glam::DVec3;

/// An infinite plane in the space of the rays: n . x = `offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EyePlane {
    /// Unit normal.
    pub normal: DVec3,
    /// Signed distance from the origin along the normal.
    pub offset: f64,
    /// Error bound of the position across the plane, in units of the space.
    pub error: f64,
}

impl EyePlane {
    /// Distance t > 0 of the hit, in lengths of `direction`. Rays parallel to the plane have none.
    pub(crate) fn intersect(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let t = (self.offset - self.normal.dot(origin)) / self.normal.dot(direction);
        (t > 0.0 && t.is_finite()).then_some(t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLOOR: EyePlane = EyePlane { normal: DVec3::Y, offset: -2.0, error: 0.0 };

    #[test]
    fn planes_are_hit_from_both_sides_and_not_by_parallel_rays() {
        assert_eq!(FLOOR.intersect(DVec3::ZERO, DVec3::new(1.0, -1.0, 0.0)), Some(2.0));
        assert_eq!(FLOOR.intersect(DVec3::new(0.0, -5.0, 0.0), DVec3::Y), Some(3.0));
        assert_eq!(FLOOR.intersect(DVec3::ZERO, DVec3::Y), None);
        assert_eq!(FLOOR.intersect(DVec3::ZERO, DVec3::X), None);
        assert_eq!(FLOOR.intersect(DVec3::new(0.0, -2.0, 0.0), DVec3::X), None);
    }
}
