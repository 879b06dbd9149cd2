//! Ray-sphere intersection in `f64`, free of the cancellation of the textbook formula
//! (Haines et al., "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, 2019).

use glam::DVec3;

/// A sphere in the space of the rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EyeSphere {
    /// Centre in eye space.
    pub center: DVec3,
    /// Radius, above zero.
    pub radius: f64,
}

impl EyeSphere {
    /// Distance t > 0 of the nearest hit, in lengths of `direction`. Of a ray that starts on the sphere (`starts_on`)
    /// only the second root is a hit.
    pub(crate) fn intersect(&self, origin: DVec3, direction: DVec3, starts_on: bool) -> Option<f64> {
        let from_center = origin - self.center;
        let a = direction.length_squared();
        let half_b = -from_center.dot(direction);
        if starts_on {
            // |from_center| = radius: one root is zero.
            let t = 2.0 * half_b / a;
            return (t > 0.0 && t.is_finite()).then_some(t);
        }
        // The discriminant follows from the distance between centre and ray: b^2 - 4ac cancels.
        let closest = from_center + direction * (half_b / a);
        let discriminant = self.radius * self.radius - closest.length_squared();
        if !(discriminant >= 0.0) {
            return None;
        }
        let c = from_center.length_squared() - self.radius * self.radius;
        let root = (discriminant * a).sqrt();
        // Both terms have the same sign. The second root follows from the product of the roots, c / a.
        let sum = half_b + if half_b >= 0.0 { root } else { -root };
        let (t0, t1) = if sum == 0.0 { (0.0, 0.0) } else { (c / sum, sum / a) };
        let (near, far) = if t0 <= t1 { (t0, t1) } else { (t1, t0) };
        [near, far].into_iter().find(|&t| t > 0.0 && t.is_finite())
    }

    /// Outward unit normal at a point of the sphere.
    pub(crate) fn normal(&self, point: DVec3) -> DVec3 {
        (point - self.center).normalize_or_zero()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_huge_ground_sphere_is_hit_at_the_eye_height() {
        let ground = EyeSphere { center: DVec3::new(0.0, -1e6 - 1.5, 0.0), radius: 1e6 };
        let t = ground.intersect(DVec3::ZERO, DVec3::NEG_Y, false).unwrap();
        assert!((t - 1.5).abs() < 1e-9, "t = {t}");
    }

    #[test]
    fn a_tiny_sphere_is_hit_in_its_middle() {
        let speck = EyeSphere { center: DVec3::new(0.0, 0.0, -3.0), radius: 1e-6 };
        let t = speck.intersect(DVec3::ZERO, DVec3::NEG_Z, false).unwrap();
        assert!((t - (3.0 - 1e-6)).abs() < 1e-15, "t = {t}");
    }

    #[test]
    fn rays_from_inside_hit_the_far_side() {
        let shell = EyeSphere { center: DVec3::ZERO, radius: 2.0 };
        assert_eq!(shell.intersect(DVec3::ZERO, DVec3::X, false), Some(2.0));
    }

    proptest! {
        #[test]
        fn hits_lie_on_the_sphere(
            center in prop::array::uniform3(-10.0..10.0_f64), radius in 0.01..5.0_f64,
            direction in prop::array::uniform3(-1.0..1.0_f64),
        ) {
            let (center, direction) = (DVec3::from(center), DVec3::from(direction));
            prop_assume!(direction.length() > 1e-3);
            let sphere = EyeSphere { center, radius };
            if let Some(t) = sphere.intersect(DVec3::ZERO, direction, false) {
                let distance = (direction * t - center).length();
                prop_assert!((distance - radius).abs() < 1e-10 * (1.0 + center.length()), "{distance} {radius}");
            } else {
                // Missed: the line passes outside, or the sphere is behind.
                let along = center.dot(direction) / direction.length_squared();
                let closest = (direction * along.max(0.0) - center).length();
                prop_assert!(closest >= radius * (1.0 - 1e-12));
            }
        }

        #[test]
        fn rays_that_start_on_a_sphere_and_go_outwards_miss_it(
            normal in prop::array::uniform3(-1.0..1.0_f64), direction in prop::array::uniform3(-1.0..1.0_f64),
        ) {
            let (normal, direction) = (DVec3::from(normal), DVec3::from(direction));
            prop_assume!(normal.length() > 1e-3 && normal.dot(direction) > 0.0);
            let sphere = EyeSphere { center: DVec3::ZERO, radius: 1.0 };
            prop_assert_eq!(sphere.intersect(normal.normalize(), direction, true), None);
        }
    }
}
