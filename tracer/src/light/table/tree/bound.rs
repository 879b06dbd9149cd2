//! Bounds of lights: where they are, and the directions to which they shine.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;

/// A light, or several, in eye space.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Bound {
    /// Corners of a box around them.
    lo: DVec3,
    hi: DVec3,
    /// A sphere around them.
    pub(super) center: DVec3,
    pub(super) radius: f64,
    /// Unit vector in the middle of the normals of their surfaces.
    pub(super) axis: DVec3,
    /// Largest angle between the axis and a normal.
    pub(super) spread: f64,
    /// Largest angle between a normal and the light that leaves the surface.
    pub(super) emission: f64,
    /// Irradiance that they cause on a surface perpendicular to their light.
    pub(super) strength: Strength,
    /// Strength of the lights with an extent.
    pub(super) extended: Strength,
}

/// Irradiance by distance: `inverse_square` / d^2 + `constant`.
#[derive(Clone, Copy, Debug, Default)]
pub(in super::super) struct Strength {
    pub inverse_square: f64,
    pub constant: f64,
}

impl Strength {
    fn plus(self, other: Self) -> Self {
        Self {
            inverse_square: self.inverse_square + other.inverse_square,
            constant: self.constant + other.constant,
        }
    }
}

impl Bound {
    /// A ball that shines to all sides. Without a radius it is a point.
    pub(in super::super) fn of_ball(center: DVec3, radius: f64, strength: Strength) -> Self {
        let extended = if radius > 0.0 { strength } else { Strength::default() };
        let (lo, hi) = (center - radius, center + radius);
        Self { lo, hi, center, radius, axis: DVec3::Z, spread: PI, emission: 0.0, strength, extended }
    }

    /// A ball, or a point, whose light is within an angle around an axis.
    pub(in super::super) fn of_beam(ball: Self, axis: DVec3, spread: f64) -> Self {
        if axis == DVec3::ZERO { ball } else { Self { axis, spread: spread.clamp(0.0, PI), ..ball } }
    }

    /// A triangle that shines from its front.
    pub(in super::super) fn of_triangle(corners: [DVec3; 3], front: DVec3, strength: Strength) -> Self {
        let [a, b, c] = corners;
        let center = (a + b + c) / 3.0;
        let radius = corners.map(|corner| corner.distance(center)).into_iter().fold(0.0, f64::max);
        let (lo, hi) = (a.min(b).min(c), a.max(b).max(c));
        let (spread, emission) = (0.0, FRAC_PI_2);
        Self { lo, hi, center, radius, axis: front, spread, emission, strength, extended: strength }
    }

    /// Several lights.
    pub(super) fn of_all<'a>(lights: impl Iterator<Item = &'a Self> + Clone) -> Self {
        let lo = lights.clone().map(|light| light.lo).reduce(DVec3::min).unwrap_or(DVec3::ZERO);
        let hi = lights.clone().map(|light| light.hi).reduce(DVec3::max).unwrap_or(DVec3::ZERO);
        let center = lo + (hi - lo) / 2.0;
        let reach = lights.clone().map(|light| light.center.distance(center) + light.radius);
        let radius = reach.fold(0.0, f64::max).min((hi - lo).length() / 2.0);
        let (axis, spread) = cone(lights.clone());
        let emission = lights.clone().map(|light| light.emission).fold(0.0, f64::max);
        let strength = lights.clone().fold(Strength::default(), |sum, light| sum.plus(light.strength));
        let extended = lights.fold(Strength::default(), |sum, light| sum.plus(light.extended));
        Self { lo, hi, center, radius, axis, spread, emission, strength, extended }
    }
}

/// A cone around the normals of lights: its axis is in the direction of the sum of theirs.
fn cone<'a>(lights: impl Iterator<Item = &'a Bound> + Clone) -> (DVec3, f64) {
    let everywhere = (DVec3::Z, PI);
    if lights.clone().any(|light| light.spread >= PI) {
        return everywhere;
    }
    let sum: DVec3 = lights.clone().map(|light| light.axis).sum();
    let count = lights.clone().count() as f64;
    if sum.length() < 1e-6 * count {
        return everywhere;
    }
    let axis = sum.normalize();
    let angle = |light: &Bound| libm::acos(axis.dot(light.axis).clamp(-1.0, 1.0)) + light.spread;
    (axis, lights.map(angle).fold(0.0, f64::max).min(PI))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(corner: DVec3, front: DVec3) -> Bound {
        let (across, along) = front.any_orthonormal_pair();
        let strength = Strength { inverse_square: 1.0, constant: 0.0 };
        Bound::of_triangle([corner, corner + across, corner + along], front, strength)
    }

    #[test]
    fn bounds_contain_the_spheres_and_normals_of_all_lights() {
        let fronts = [DVec3::X, DVec3::new(0.6, 0.8, 0.0), DVec3::new(0.6, 0.0, -0.8)];
        let lights: Vec<Bound> =
            (0..30).map(|i| triangle(DVec3::new(f64::from(i), 2.0, 1.0), fronts[i as usize % 3])).collect();
        let all = Bound::of_all(lights.iter());
        for light in &lights {
            assert!(light.axis.dot(all.axis) >= libm::cos(all.spread) - 1e-12);
            assert!(light.lo.cmpge(all.lo).all() && light.hi.cmple(all.hi).all());
        }
        assert!(all.spread < 1.0 && all.emission == FRAC_PI_2);
        assert_eq!((all.strength.inverse_square, all.extended.inverse_square), (30.0, 30.0));
        for light in &lights {
            let nearest = light.center.distance(all.center) - light.radius;
            assert!(nearest <= all.radius, "a light outside");
            for corner in [light.lo, light.hi] {
                assert!(corner.distance(all.center) <= all.radius + 1e-9);
            }
        }
    }

    #[test]
    fn opposite_normals_shine_everywhere() {
        let lights = [triangle(DVec3::ZERO, DVec3::Y), triangle(DVec3::ONE, DVec3::NEG_Y)];
        assert_eq!(Bound::of_all(lights.iter()).spread, PI);
    }

    #[test]
    fn points_have_no_extent_and_balls_have_one() {
        let strength = Strength { inverse_square: 2.0, constant: 3.0 };
        let point = Bound::of_ball(DVec3::ZERO, 0.0, strength);
        let spot = Bound::of_beam(point, DVec3::X, 0.3);
        let ball = Bound::of_ball(DVec3::X, 0.5, strength);
        assert_eq!((point.extended.inverse_square, ball.extended.constant), (0.0, 3.0));
        assert_eq!((spot.spread, spot.emission), (0.3, 0.0));
        let all = Bound::of_all([spot, ball].iter());
        assert_eq!((all.spread, all.strength.constant, all.extended.constant), (PI, 6.0, 3.0));
        assert!(all.radius <= 0.75 + 1e-12);
    }
}
