//! Where shadow rays start: at the point, or above it on the smooth surface that interpolated normals describe (Hanika, "Hacking the
//! Shadow Terminator", Ray Tracing Gems II, 2021).

use glam::DVec3;

use super::Oracle;
use super::shape::Shape;
use super::surface::SurfacePoint;

/// Cosine ng.L from which on shadow rays start at the point, and that below which the lift is full.
const UNLIFTED: f64 = 0.5;
const LIFTED: f64 = 0.25;

/// The start of shadow rays from a surface point to a light.
pub(super) struct ShadowStart {
    pub position: DVec3,
    /// The primitive of the point: it does not occlude, unless it is a sphere.
    pub on: usize,
    /// Geometric normal on the side of the light.
    pub normal: DVec3,
}

impl Oracle {
    /// The start of shadow rays in the unit direction to a light.
    pub(super) fn shadow_start(&self, surface: &SurfacePoint, l: DVec3) -> ShadowStart {
        let along = surface.ng.dot(l);
        let lift = if self.view.quality.smooth_terminator { self.lift(surface) } else { 0.0 };
        let share = ((UNLIFTED - along) / (UNLIFTED - LIFTED)).clamp(0.0, 1.0);
        let position = surface.position + surface.ng * (lift * share);
        let normal = if along < 0.0 { -surface.ng } else { surface.ng };
        ShadowStart { position, on: surface.primitive, normal }
    }

    /// Height over a triangle, along its normal, of the mean of the planes through its corners across their normals, weighted by
    /// the barycentric coordinates; planes below the point count as 0.
    fn lift(&self, surface: &SurfacePoint) -> f64 {
        let Shape::Triangle { corners, normals: Some(normals), .. } =
            &self.primitives[surface.primitive].shape
        else {
            return 0.0;
        };
        let ([a, b, c], p) = (*corners, surface.position);
        let area = (b - a).cross(c - a);
        let weights = [(b, c), (c, a), (a, b)]
            .map(|(from, to)| (from - p).cross(to - p).dot(area) / area.length_squared());
        let blended: DVec3 = normals.iter().zip(weights).map(|(normal, weight)| *normal * weight).sum();
        let side = if blended.dot(surface.ng) < 0.0 { -1.0 } else { 1.0 };
        let lifts = (0..3).map(|i| {
            let normal = normals[i].normalize_or_zero() * side;
            weights[i] * (corners[i] - p).dot(normal).max(0.0) * normal.dot(surface.ng)
        });
        let lift: f64 = lifts.sum();
        if lift > 0.0 && lift.is_finite() { lift } else { 0.0 }
    }
}
