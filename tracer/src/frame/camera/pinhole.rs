//! The pinhole camera: directions of rays, and the map from eye space to its picture.

use glam::{DMat3, DVec3};

use super::super::affine::Affine;
use super::Basis;
use crate::scene::{FovAxis, FrameView};

/// Directions of the rays of a pinhole camera. All rays start at the origin of eye space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PinholeRays {
    /// Direction through the top left corner of the picture, at depth 1.
    corner: DVec3,
    /// Step from a pixel to the next one of its row.
    right: DVec3,
    /// Step from a row to the next one.
    down: DVec3,
    /// Samples along a side of a pixel.
    grid: u32,
}

impl PinholeRays {
    /// The rays of a view. The view plane has distance 1, a side of 2 tan(fov / 2) / zoom along `fov_axis`, and the other side
    /// that the aspect gives.
    pub(crate) fn new(view: &FrameView, fov_axis: FovAxis) -> Self {
        let Basis { forward, right, up } = Basis::of(&view.camera);
        let (width, height) = (f64::from(view.width), f64::from(view.height));
        let half_side = libm::tan(view.camera.fov.to_radians() / 2.0) / view.camera.zoom;
        let (half_width, half_height) = match fov_axis {
            FovAxis::Vertical => (half_side * width / height, half_side),
            FovAxis::Horizontal => (half_side, half_side * height / width),
        };
        Self {
            corner: forward - right * half_width + up * half_height,
            right: right * (2.0 * half_width / width),
            down: -up * (2.0 * half_height / height),
            grid: view.grid(),
        }
    }

    /// Samples along a side of a pixel.
    pub(crate) fn grid(&self) -> u32 {
        self.grid
    }

    /// Direction of a sample, by its column and row in the whole picture; its depth along the view axis is 1. Sample i of n
    /// along a side of its pixel is at (i + 0.5) / n, so that samples are a regular grid over the picture.
    #[cfg(test)]
    pub(crate) fn of_sample(&self, column: u32, row: u32) -> DVec3 {
        let n = f64::from(self.grid);
        self.through((f64::from(column) + 0.5) / n, (f64::from(row) + 0.5) / n)
    }

    /// Direction through a place of the picture, in pixels from its top left corner.
    pub(crate) fn through(&self, across: f64, along: f64) -> DVec3 {
        self.corner + self.right * across + self.down * along
    }

    /// Map from eye space to (a, b, g): g is the depth, (a / g, b / g) the place in samples from the top left corner.
    pub(crate) fn picture_map(&self) -> Affine {
        let [right, down] = self.steps(self.grid);
        Affine::new(DMat3::from_cols(right, down, self.corner).inverse(), DVec3::ZERO)
    }

    /// Steps from a sample to the next one of its row and to the next row of samples, with `grid` samples along a side of a
    /// pixel.
    pub(crate) fn steps(&self, grid: u32) -> [DVec3; 2] {
        [self.right, self.down].map(|step| step / f64::from(grid))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, CameraKind, Quality};

    fn view(width: u32, height: u32, samples: u32) -> FrameView {
        let camera = Camera {
            position: DVec3::new(1.0, 2.0, 3.0),
            look_at: DVec3::new(1.0, 2.0, -5.0),
            up: DVec3::Y,
            fov: 90.0,
            zoom: 1.0,
            kind: CameraKind::PINHOLE,
        };
        FrameView {
            camera,
            width,
            height,
            samples,
            spin: 0.0,
            quality: Quality::default(),
            ..FrameView::default()
        }
    }

    fn vertical(view: &FrameView) -> PinholeRays {
        PinholeRays::new(view, FovAxis::Vertical)
    }

    #[test]
    fn the_picture_spans_the_field_of_view() {
        let rays = vertical(&view(4, 2, 1));
        // Pixel centres at 1/4 of the half height: the plane reaches from y = +1 to -1.
        let top_left = rays.of_sample(0, 0);
        assert!((top_left - DVec3::new(-1.5, 0.5, -1.0)).length() < 1e-12, "{top_left}");
        let bottom_right = rays.of_sample(3, 1);
        assert!((bottom_right - DVec3::new(1.5, -0.5, -1.0)).length() < 1e-12, "{bottom_right}");
    }

    #[test]
    fn samples_lie_on_a_grid_whose_mean_is_the_centre() {
        let (one, nine) = (vertical(&view(64, 64, 1)), vertical(&view(64, 64, 9)));
        let inside = |i: u32| nine.of_sample(30 + i % 3, 60 + i / 3);
        let mean = (0..9).map(inside).sum::<DVec3>() / 9.0;
        assert!((mean - one.of_sample(10, 20)).length() < 1e-12);
        let first = inside(0) - nine.corner;
        assert!((first - nine.right * (10.0 + 0.5 / 3.0) - nine.down * (20.0 + 0.5 / 3.0)).length() < 1e-12);
    }

    #[test]
    fn zoom_divides_the_view_plane() {
        let mut zoomed = view(4, 2, 1);
        zoomed.camera.zoom = 2.0;
        let direction = vertical(&zoomed).of_sample(0, 0);
        assert!((direction - DVec3::new(-0.75, 0.25, -1.0)).length() < 1e-12, "{direction}");
    }

    #[test]
    fn a_horizontal_field_of_view_spans_the_width() {
        // Pixels of 1/2: the plane reaches from x = -1 to +1, and from y = +1/2 to -1/2.
        let rays = PinholeRays::new(&view(4, 2, 1), FovAxis::Horizontal);
        let top_left = rays.of_sample(0, 0);
        assert!((top_left - DVec3::new(-0.75, 0.25, -1.0)).length() < 1e-12, "{top_left}");
        let tall = PinholeRays::new(&view(2, 4, 1), FovAxis::Horizontal);
        let bottom_right = tall.of_sample(1, 3);
        assert!((bottom_right - DVec3::new(0.5, -1.5, -1.0)).length() < 1e-12, "{bottom_right}");
    }
}
