//! Microfacets with the GGX distribution (Walter et al. 2007) and height-correlated masking by Smith (Heitz 2014). Half vectors are sampled
//! among the visible ones by spherical caps (Dupuy and Benyoub 2023).
//!
//! In the frame of the normal n, with z along it, alpha a, and L(w) = (sqrt(1 + a^2 tan^2 w) - 1) / 2:
//!
//! ```text
//! D(h)   = 1 / (pi a^2 ((x^2 + y^2) / a^2 + z^2)^2)
//! f1     = D / (4 n.v n.l (1 + L(v) + L(l)))
//! p(l)   = D_v(h) / (4 v.h),  D_v(h) = D v.h / (n.v (1 + L(v)))
//! ```

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::hemisphere::around;

/// Least alpha: smoother surfaces are perfectly smooth.
pub(super) const LEAST_ALPHA: f64 = 1e-3;

/// A rough surface, seen from one direction.
pub(super) struct Facets {
    alpha: f64,
    normal: DVec3,
    /// Unit vector to the viewer, in the frame of the normal.
    pub viewer: DVec3,
}

/// The reflection of one direction.
pub(super) struct FacetReflection {
    /// f1 cos.
    pub value: f64,
    /// Density of the direction over solid angle, by mirroring the viewer at a visible half vector.
    pub density: f64,
    /// v.h.
    pub cosine: f64,
}

impl Facets {
    /// Microfacets around a unit normal on the side of the viewer.
    pub(super) fn new(normal: DVec3, to_viewer: DVec3, alpha: f64) -> Self {
        let mut facets = Self { alpha, normal, viewer: DVec3::Z };
        facets.viewer = facets.local(to_viewer);
        facets
    }

    /// A vector in the frame of the normal.
    pub(super) fn local(&self, vector: DVec3) -> DVec3 {
        DVec3::from_array(DVec3::AXES.map(|axis| around(self.normal, axis).dot(vector)))
    }

    /// A unit vector out of the frame of the normal.
    pub(super) fn global(&self, local: DVec3) -> DVec3 {
        around(self.normal, local).normalize()
    }

    /// A visible half vector. The surface stretched by 1 / alpha along z is a hemisphere of facets, whose visible half vectors are the
    /// sums of the viewer and a point of the cap of the sphere above -z of the viewer.
    pub(super) fn half_vector(&self, at: DVec2) -> DVec3 {
        let stretch = DVec3::new(self.alpha, self.alpha, 1.0);
        let viewer = (self.viewer * stretch).normalize();
        let (sin, cos) = libm::sincos(2.0 * PI * at.x);
        let height = 1.0 - at.y * (1.0 + viewer.z);
        let radius = (1.0 - height * height).max(0.0).sqrt();
        let sum = DVec3::new(radius * cos, radius * sin, height) + viewer;
        (sum * stretch).normalize()
    }

    /// The reflection of a unit vector in the frame of the normal. Below the surface the value is 0; the density is not.
    pub(super) fn reflection(&self, light: DVec3) -> FacetReflection {
        let sum = self.viewer + light;
        let half = sum.normalize_or(DVec3::Z);
        let stretched = half / DVec3::new(self.alpha, self.alpha, 1.0);
        let distribution = 1.0 / (PI * (self.alpha * stretched.length_squared()).powi(2));
        let masking = |w: DVec3| ((1.0 + self.alpha.powi(2) * (1.0 / w.z.powi(2) - 1.0)).sqrt() - 1.0) / 2.0;
        let value = if light.z > 0.0 {
            distribution / (4.0 * self.viewer.z * (1.0 + masking(self.viewer) + masking(light)))
        } else {
            0.0
        };
        let density = distribution / (4.0 * self.viewer.z * (1.0 + masking(self.viewer)));
        let density = if half.z > 0.0 { density } else { 0.0 };
        FacetReflection { value, density, cosine: self.viewer.dot(half) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sum of a function over directions on the sphere.
    fn integral(of: impl Fn(DVec3) -> f64) -> f64 {
        const COUNT: usize = 600;
        let cell = 2.0 / COUNT as f64 * (2.0 * PI / COUNT as f64);
        let places = (0..COUNT * COUNT).map(|i| {
            let height = (2 * (i / COUNT) + 1) as f64 / COUNT as f64 - 1.0;
            let (sin, cos) = libm::sincos(2.0 * PI * (i % COUNT) as f64 / COUNT as f64);
            let radius = (1.0 - height * height).sqrt();
            DVec3::new(radius * cos, radius * sin, height)
        });
        places.map(of).sum::<f64>() * cell
    }

    #[test]
    fn densities_add_up_to_one_and_values_to_less() {
        for alpha in [0.2, 0.5, 1.0] {
            for cosine in [0.1_f64, 0.6, 1.0] {
                let viewer = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
                let facets = Facets::new(DVec3::Z, viewer, alpha);
                let density = integral(|light| facets.reflection(light).density);
                assert!((density - 1.0).abs() < 0.01, "{alpha} {cosine}: {density}");
                let albedo = integral(|light| facets.reflection(light).value);
                assert!(albedo < 1.0 + 1e-3 && albedo > 0.3, "{alpha} {cosine}: {albedo}");
            }
        }
    }

    #[test]
    fn mirrored_directions_at_half_vectors_have_their_density() {
        let normal = DVec3::new(0.3, -0.5, 0.8).normalize();
        let viewer = around(normal, DVec3::new(0.6, 0.0, 0.8));
        let facets = Facets::new(normal, viewer, 0.4);
        assert!((facets.global(facets.viewer) - viewer).length() < 1e-12);
        // The mean of f1 cos / p over samples is the integral of f1 cos.
        let count = 200;
        let places = (0..count * count)
            .map(|i| DVec2::new(f64::from(i % count) + 0.5, f64::from(i / count) + 0.5) / f64::from(count));
        let upwards = |at: DVec2| {
            let half = facets.half_vector(at);
            let light = half * (2.0 * facets.viewer.dot(half)) - facets.viewer;
            let FacetReflection { value, density, .. } = facets.reflection(light);
            if light.z > 0.0 { value / density } else { 0.0 }
        };
        let sampled = places.map(upwards).sum::<f64>() / f64::from(count * count);
        let expected = integral(|light| facets.reflection(light).value);
        assert!((sampled / expected - 1.0).abs() < 5e-3, "{sampled}, not {expected}");
    }
}
