//! The orthographic camera: rays of one direction that start on a plane, and the map from eye space to its picture.

use glam::DVec3;

use super::super::affine::Affine;
use super::Basis;
use crate::scene::FrameView;

/// Range of heights of the picture, in eye units; heights outside of it are those of its ends. At the low end a pixel is far
/// smaller than the rounding of any position, and no product of two places overflows in `f32`.
const HEIGHTS: (f64, f64) = (1.0 / (1_u64 << 40) as f64, (1_u64 << 40) as f64);

/// Rays of an orthographic camera. They start on the plane through the origin of eye space across the view direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ParallelRays {
    /// Unit vector into the picture: the direction of all rays.
    forward: DVec3,
    /// Unit vectors to the right and to the bottom of the picture.
    right: DVec3,
    down: DVec3,
    /// Side of a pixel, in eye units.
    step: f64,
    /// The picture's centre, in pixels.
    center: [f64; 2],
    /// Samples along a side of a pixel.
    grid: u32,
}

impl ParallelRays {
    /// The rays of a view; `view_height` is in eye units, before the zoom.
    pub(super) fn new(view: &FrameView, view_height: f64) -> Self {
        let Basis { forward, right, up } = Basis::of(&view.camera);
        let height = (view_height / view.camera.zoom).clamp(HEIGHTS.0, HEIGHTS.1);
        Self {
            forward,
            right,
            down: -up,
            step: height / f64::from(view.height),
            center: [view.width, view.height].map(|side| f64::from(side) / 2.0),
            grid: view.grid(),
        }
    }

    /// Samples along a side of a pixel.
    pub(crate) fn grid(&self) -> u32 {
        self.grid
    }

    /// Direction of all rays, a unit vector: t is the depth behind the plane of the origins.
    pub(crate) fn direction(&self) -> DVec3 {
        self.forward
    }

    /// Origin of the ray through a place of the picture, in pixels from its top left corner. The distance from the centre is
    /// exact, so the rounding of an origin is relative to its own size.
    pub(crate) fn origin(&self, across: f64, along: f64) -> DVec3 {
        let (x, y) = ((across - self.center[0]) * self.step, (along - self.center[1]) * self.step);
        self.right * x + self.down * y
    }

    /// Map from eye space to (a, b, g): g is the depth behind the plane of the origins, (a, b) the place in samples from the top
    /// left corner.
    pub(crate) fn picture_map(&self) -> Affine {
        let grid = f64::from(self.grid);
        let per_unit = grid / self.step;
        let row = |axis: DVec3, constant: f64| axis.extend(constant).to_array();
        Affine([
            row(self.right * per_unit, self.center[0] * grid),
            row(self.down * per_unit, self.center[1] * grid),
            row(self.forward, 0.0),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, CameraKind, Quality};

    fn rays(width: u32, height: u32, samples: u32, zoom: f64) -> ParallelRays {
        let camera = Camera {
            position: DVec3::new(1.0, 2.0, 3.0),
            look_at: DVec3::new(1.0, 2.0, -5.0),
            up: DVec3::Y,
            fov: 90.0,
            zoom,
            kind: CameraKind::Orthographic { view_height: 2.0 },
        };
        let quality = Quality::default();
        ParallelRays::new(
            &FrameView { camera, width, height, samples, spin: 0.0, quality, ..FrameView::default() },
            2.0,
        )
    }

    #[test]
    fn the_picture_has_the_height_of_the_view_and_the_width_of_the_aspect() {
        let rays = rays(4, 2, 1, 1.0);
        let corners = [(0.0, 0.0), (4.0, 2.0), (2.0, 1.0)].map(|(x, y)| rays.origin(x, y));
        assert_eq!(corners, [DVec3::new(-2.0, 1.0, 0.0), DVec3::new(2.0, -1.0, 0.0), DVec3::ZERO]);
        assert_eq!(rays.direction(), DVec3::NEG_Z);
    }

    #[test]
    fn zoom_divides_the_view_plane() {
        assert_eq!(rays(4, 2, 1, 4.0).origin(0.0, 0.0), DVec3::new(-0.5, 0.25, 0.0));
    }

    #[test]
    fn points_are_mapped_to_the_samples_whose_rays_they_are_on() {
        let rays = rays(64, 48, 9, 0.7);
        let (column, row) = (100.5, 37.5);
        let point = rays.origin(column / 3.0, row / 3.0) + rays.direction() * 0.3;
        let [a, b, g] = rays.picture_map().apply(point).to_array();
        assert!(
            (a - column).abs() < 1e-9 && (b - row).abs() < 1e-9 && (g - 0.3).abs() < 1e-12,
            "{a} {b} {g}"
        );
    }

    #[test]
    fn any_zoom_gives_finite_rays() {
        for zoom in [1e-30, 1e30] {
            let rays = rays(16384, 1, 1, zoom);
            assert!(rays.origin(16384.0, 0.0).is_finite() && rays.origin(16384.0, 0.0) != DVec3::ZERO);
            assert!(rays.picture_map().0.iter().flatten().all(|number| (*number as f32).is_finite()));
        }
    }
}
