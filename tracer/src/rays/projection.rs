//! Projections: a point to project from, near or infinitely far, and the picture seen from it.
//!
//! A projection maps a point of some space (a mesh, or eye space) to (a, b, g): depth g along its axis. Projected from a
//! point, its place in the picture is (a / g, b / g) and its closeness z = 1 / g; projected along parallel rays, they are
//! (a, b) and z = -g. Both ways, the closeness of a plane is linear over the picture, and nearer points have a greater one.
//!
//! The map to (a, b, g) is affine, so the projection of a mesh is the projection of eye space after the placement of the
//! mesh: composed in `f64`, once per mesh and tile, then rounded.

use glam::DVec3;

use crate::frame::Affine;
use crate::simd::three;

/// Relative error of a number after a handful of `f32` operations.
pub(crate) const ROUNDING: f32 = 1.0 / (1 << 22) as f32;

/// Relative error of a number after a handful of `f64` operations.
const EXACT_ROUNDING: f64 = 1.0 / (1_u64 << 50) as f64;

/// Largest distance of the scene from the eye, in eye units, at any spin.
const SCENE: f64 = 2.0;

/// A map to a picture, rounded to `f32`, with its error bounds: see the module.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projection {
    /// Rows of a, b and g: three factors and a constant.
    pub rows: [[f32; 4]; 3],
    /// Error bounds of a and b, and of g, for points with coordinates of at most `reach`.
    pub error: [f32; 2],
    /// Whether rays are parallel, and do not start at a point.
    pub parallel: bool,
    /// Error bound of [`Projection::exact`] for points of the scene.
    pub exact_error: f64,
    /// Largest distance of coincident points, in units of the projected space.
    pub drift: f64,
    exact: Affine,
}

impl Projection {
    /// The projection of points with coordinates of at most `reach`.
    #[inline(always)]
    pub(crate) fn new(exact: Affine, reach: f64, parallel: bool) -> Self {
        let mut size = [0.0; 3];
        let mut exact_size = 0.0_f64;
        for i in 0..3 {
            let row = exact.0[i];
            let factors = row[0].abs() + row[1].abs() + row[2].abs();
            size[i] = factors * reach + row[3].abs();
            exact_size = exact_size.max(factors * reach.max(SCENE) + row[3].abs());
        }
        Self { exact_error: exact_size * EXACT_ROUNDING, ..Self::with_sizes(exact, size, parallel) }
    }

    /// Error bounds in a and b, and in g, of surfaces in eye space of which each is off by at most `coarsest`. The error bound of
    /// a closeness is at least three times that of (a, b, g), so half the distance of coincident surfaces is enough here.
    pub(crate) fn drift(picture: &Affine, coarsest: f64) -> [f32; 2] {
        let off = three!(i => {
            let [x, y, z, _] = picture.0[i];
            DVec3::new(x, y, z).length() * coarsest
        });
        [off[0].max(off[1]) as f32, off[2] as f32]
    }

    /// Widens the error bounds to the distance of coincident surfaces (`in_picture`: in the picture and in depth; `in_space`: in
    /// the projected space), so that their order is never certain.
    #[inline(always)]
    pub(crate) fn drifting(self, in_picture: [f32; 2], in_space: f64) -> Self {
        let error = [self.error[0].max(in_picture[0]), self.error[1].max(in_picture[1])];
        Self { error, drift: in_space, ..self }
    }

    /// The volume in (a, b, g) of a unit cube of the projected space.
    pub(crate) fn volume(&self) -> f64 {
        let [a, b, g] = self.factors();
        a.dot(b.cross(g)).abs()
    }

    /// Rounds a map. `size` bounds the numbers that go into each row.
    #[inline(always)]
    fn with_sizes(exact: Affine, size: [f64; 3], parallel: bool) -> Self {
        let mut rows = [[0.0; 4]; 3];
        for i in 0..3 {
            for column in 0..4 {
                rows[i][column] = exact.0[i][column] as f32;
            }
        }
        let error = [size[0].max(size[1]) as f32 * ROUNDING, size[2] as f32 * ROUNDING];
        let exact_error = size[0].max(size[1]).max(size[2]) * EXACT_ROUNDING;
        Self { rows, error, parallel, exact_error, drift: 0.0, exact }
    }

    /// The projection of another space into the same picture; `placement` maps that space to this one.
    #[inline(always)]
    pub(crate) fn of(&self, placement: &Affine, reach: f64) -> Projection {
        let projection = Projection::new(self.exact.after(placement), reach, self.parallel);
        // The rounding of the placement remains, even where its constant cancels that of this map.
        Projection { exact_error: projection.exact_error + self.exact_error, ..projection }
    }

    /// The projection of points relative to `place`, at most `reach` from it on each axis: all digits of an `f32` then
    /// serve their differences.
    #[inline(always)]
    pub(crate) fn relative_to(&self, place: DVec3, reach: DVec3) -> Projection {
        let mut exact = self.exact;
        let here = self.exact.apply(place);
        let mut size = [0.0; 3];
        for i in 0..3 {
            let row = &mut exact.0[i];
            row[3] = here[i];
            size[i] = row[0].abs() * reach.x + row[1].abs() * reach.y + row[2].abs() * reach.z + row[3].abs();
        }
        Projection::with_sizes(exact, size, self.parallel)
    }

    /// The factors of x, y and z in a, b and g.
    pub(crate) fn factors(&self) -> [DVec3; 3] {
        three!(i => {
            let [x, y, z, _] = self.exact.0[i];
            DVec3::new(x, y, z)
        })
    }

    /// (a, b, g) of a point in `f64`, within [`Projection::exact_error`].
    pub(crate) fn exact(&self, point: DVec3) -> DVec3 {
        self.exact.apply(point)
    }
}

/// The planes around a rectangle of the picture: a box is outside if its nearest corner is outside one plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frustum {
    /// Four sides, positive outside, then the depth: three factors and a constant each.
    pub planes: [[f32; 4]; 5],
    /// Error bound of each plane.
    pub error: [f32; 5],
    /// Whether rays are parallel: then no box is behind the projection.
    pub parallel: bool,
}

impl Frustum {
    /// The frustum of a rectangle: least and greatest x, least and greatest y.
    pub(crate) fn new(projection: &Projection, [x_lo, x_hi, y_lo, y_hi]: [f32; 4]) -> Self {
        let [a, b, g] = projection.rows;
        let scale = if projection.parallel { [0.0, 0.0, 0.0, 1.0] } else { g };
        let side = |row: [f32; 4], sign: f32, at: f32| {
            [
                sign * (row[0] - at * scale[0]),
                sign * (row[1] - at * scale[1]),
                sign * (row[2] - at * scale[2]),
                sign * (row[3] - at * scale[3]),
            ]
        };
        let error = |at: f32| 4.0 * (projection.error[0] + at.abs() * (projection.error[1] + ROUNDING));
        Self {
            planes: [side(a, 1.0, x_hi), side(a, -1.0, x_lo), side(b, 1.0, y_hi), side(b, -1.0, y_lo), g],
            error: [error(x_hi), error(x_lo), error(y_hi), error(y_lo), 4.0 * projection.error[1]],
            parallel: projection.parallel,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::CameraRays;
    use crate::scene::{Camera, CameraKind, FrameView, Quality};

    fn rays(kind: CameraKind) -> CameraRays {
        let camera = Camera {
            position: DVec3::new(1.0, 2.0, 3.0),
            look_at: DVec3::new(1.0, 2.0, -5.0),
            up: DVec3::Y,
            fov: 90.0,
            zoom: 1.0,
            kind,
        };
        let quality = Quality::default();
        CameraRays::new(
            &FrameView {
                camera,
                width: 64,
                height: 48,
                samples: 4,
                spin: 0.0,
                quality,
                ..FrameView::default()
            },
            1.0,
        )
    }

    #[test]
    fn samples_of_the_camera_are_projected_to_their_places() {
        let CameraRays::Pinhole(rays) = rays(CameraKind::PINHOLE) else { panic!("another camera") };
        let projection = Projection::new(rays.picture_map().centered(40.0, 60.0), 1.0, false);
        let [a, b, g] = projection.exact(rays.of_sample(43, 57) * 7.0).to_array();
        assert!(
            (g - 7.0).abs() < 1e-9 && (a / g - 3.5).abs() < 1e-9 && (b / g + 2.5).abs() < 1e-9,
            "{a} {b} {g}"
        );
    }

    #[test]
    fn samples_of_parallel_rays_are_projected_to_their_places() {
        let kind = CameraKind::Orthographic { view_height: 3.0 };
        let CameraRays::Parallel(rays) = rays(kind) else { panic!("another camera") };
        let projection = Projection::new(rays.picture_map().shifted(40.0, 60.0), 1.0, true);
        let point = rays.origin(43.5 / 2.0, 57.5 / 2.0) + rays.direction() * 7.0;
        let [a, b, g] = projection.exact(point).to_array();
        assert!((g - 7.0).abs() < 1e-9 && (a - 3.5).abs() < 1e-9 && (b + 2.5).abs() < 1e-9, "{a} {b} {g}");
    }
}
