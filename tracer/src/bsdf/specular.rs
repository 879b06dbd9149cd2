//! Perfectly smooth surfaces: mirror reflection, refraction by Snell's law, and the exact Fresnel share of a dielectric.
//!
//! All directions are unit vectors, D along the ray and N on the side that the ray comes from; c = -D.N is the cosine of incidence
//! and eta = n_from / n_to the relative index of refraction.

use glam::DVec3;

/// R = D - 2 (D.N) N.
pub(crate) fn reflected(direction: DVec3, normal: DVec3) -> DVec3 {
    direction - normal * (2.0 * direction.dot(normal))
}

/// T = eta D + (eta c - sqrt(1 - eta^2 (1 - c^2))) N; `None` for total internal reflection.
pub(crate) fn refracted(direction: DVec3, normal: DVec3, eta: f64) -> Option<DVec3> {
    let c = -direction.dot(normal);
    let square = transmitted_square(c, eta);
    (square >= 0.0).then(|| direction * eta + normal * (eta * c - square.sqrt()))
}

/// Share of unpolarised light that a dielectric reflects, from 0 to 1; 1 for total internal reflection, and for rays along the
/// surface or from behind N.
pub(crate) fn fresnel(c: f64, eta: f64) -> f64 {
    let square = transmitted_square(c, eta);
    if !(square >= 0.0 && c > 0.0) {
        return 1.0;
    }
    let transmitted = square.sqrt();
    let parallel = (c - eta * transmitted) / (c + eta * transmitted);
    let across = (eta * c - transmitted) / (eta * c + transmitted);
    0.5 * (parallel * parallel + across * across)
}

/// Share that a sheet of a dielectric reflects, which has two surfaces of a share F each: F + (1 - F)^2 F (1 + F^2 + F^4 + ...) =
/// 2 F / (1 + F). `ior` is its index of refraction.
pub(crate) fn fresnel_of_sheet(c: f64, ior: f64) -> f64 {
    let share = fresnel(c, 1.0 / ior);
    2.0 * share / (1.0 + share)
}

/// Square of the cosine on the far side.
fn transmitted_square(c: f64, eta: f64) -> f64 {
    1.0 - eta * eta * (1.0 - c * c)
}

/// The direction on the same side of a surface as `normal`: one on the other side is mirrored at the surface. Shading normals
/// send reflections under a surface, and transmissions above it.
pub(crate) fn on_side_of(direction: DVec3, normal: DVec3) -> DVec3 {
    if direction.dot(normal) < 0.0 { reflected(direction, normal) } else { direction }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A ray down onto the plane y = 0 at an angle to its normal.
    fn incident(degrees: f64) -> DVec3 {
        let angle = degrees.to_radians();
        DVec3::new(libm::sin(angle), -libm::cos(angle), 0.0)
    }

    #[test]
    fn refraction_follows_snell() {
        for (degrees, from, to) in [(30.0, 1.0, 1.5), (60.0, 1.0, 1.33), (35.0, 1.5, 1.0), (0.0, 1.0, 2.4)] {
            let sine = libm::sin(f64::to_radians(degrees)) * from / to;
            let found = refracted(incident(degrees), DVec3::Y, from / to).unwrap();
            assert!((found - DVec3::new(sine, -(1.0 - sine * sine).sqrt(), 0.0)).length() < 1e-15, "{found}");
        }
    }

    #[test]
    fn beyond_the_critical_angle_all_light_is_reflected() {
        let critical = libm::asin(1.0 / 1.5).to_degrees();
        let leaving = |degrees| refracted(incident(degrees), DVec3::Y, 1.5);
        assert!(leaving(critical - 0.01).is_some() && leaving(critical + 0.01).is_none());
        let share = |degrees: f64| fresnel(libm::cos(degrees.to_radians()), 1.5);
        assert!(share(critical - 0.01) < 1.0 && share(critical + 0.01) == 1.0);
    }

    #[test]
    fn fresnel_shares_are_those_of_the_textbook() {
        // ((n - 1) / (n + 1))^2 at straight incidence, from either side.
        assert!((fresnel(1.0, 1.0 / 1.5) - 0.04).abs() < 1e-15 && (fresnel(1.0, 1.5) - 0.04).abs() < 1e-15);
        assert_eq!(fresnel(0.5, 1.0), 0.0);
        assert!((fresnel(1e-9, 1.0 / 1.5) - 1.0).abs() < 1e-7, "grazing light is reflected");
        assert_eq!(fresnel(-0.1, 1.0 / 1.5), 1.0);
        // Two surfaces of 4 % each.
        assert!((fresnel_of_sheet(1.0, 1.5) - 0.08 / 1.04).abs() < 1e-15);
        // At Brewster's angle only light across the plane of incidence is reflected: half of ((n^2 - 1) / (n^2 + 1))^2.
        let brewster = libm::cos(libm::atan(1.5));
        let across = (1.5 * 1.5 - 1.0) / (1.5 * 1.5 + 1.0);
        assert!((fresnel(brewster, 1.0 / 1.5) - 0.5 * across * across).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn directions_stay_unit_vectors_and_shares_agree_from_both_sides(
            normal in prop::array::uniform3(-1.0..1.0_f64), direction in prop::array::uniform3(-1.0..1.0_f64),
            eta in 0.2..5.0_f64,
        ) {
            let (normal, direction) = (DVec3::from(normal), DVec3::from(direction));
            prop_assume!(normal.length() > 1e-2 && direction.length() > 1e-2);
            let (normal, direction) = (normal.normalize(), direction.normalize());
            prop_assume!(direction.dot(normal) < -1e-3);
            prop_assert!((reflected(direction, normal).length() - 1.0).abs() < 1e-12);
            if let Some(through) = refracted(direction, normal, eta) {
                prop_assert!((through.length() - 1.0).abs() < 1e-9 && through.dot(normal) <= 0.0);
                let share = fresnel(-direction.dot(normal), eta);
                prop_assert!((0.0..=1.0).contains(&share));
                // The way back: the same share, and the same path.
                prop_assert!((share - fresnel(-through.dot(normal), 1.0 / eta)).abs() < 1e-6);
                if through.dot(normal) < -1e-3 {
                    let back = refracted(-through, -normal, 1.0 / eta).unwrap();
                    prop_assert!((back + direction).length() < 1e-6);
                }
            }
        }
    }
}
