//! From pixels to rays.

use glam::DVec3;

use crate::scene::{Camera, FrameView};

/// A pinhole camera, ready to make rays. All rays start in the origin of eye space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PinholeRays {
    /// Direction through the top left corner of the picture.
    corner: DVec3,
    /// From one pixel to the next in its row.
    right: DVec3,
    /// From one row to the next.
    down: DVec3,
    /// Samples per side of a pixel.
    grid: u32,
}

impl PinholeRays {
    /// The view plane stands at distance 1; its height is 2 tan(fov / 2) / zoom, its width follows from the aspect.
    pub(crate) fn new(view: &FrameView) -> Self {
        let Basis { forward, right, up } = Basis::of(&view.camera);
        let (width, height) = (f64::from(view.width), f64::from(view.height));
        let half_height = libm::tan(view.camera.fov.to_radians() / 2.0) / view.camera.zoom;
        let half_width = half_height * width / height;
        Self {
            corner: forward - right * half_width + up * half_height,
            right: right * (2.0 * half_width / width),
            down: -up * (2.0 * half_height / height),
            grid: view.samples.isqrt(),
        }
    }

    /// Rays per pixel.
    pub(crate) fn samples(&self) -> u32 {
        self.grid * self.grid
    }

    /// Direction, not normalised, of sample `index` of pixel (x, y): at ((i + 0.5) / n, (j + 0.5) / n) of the pixel.
    #[inline(always)]
    pub(crate) fn direction(&self, x: u32, y: u32, index: u32) -> DVec3 {
        let n = f64::from(self.grid);
        let across = f64::from(x) + (f64::from(index % self.grid) + 0.5) / n;
        let along = f64::from(y) + (f64::from(index / self.grid) + 0.5) / n;
        self.corner + self.right * across + self.down * along
    }
}

/// Right-handed: right x up = -forward.
#[derive(Clone, Copy, Debug)]
pub struct Basis {
    /// Unit vector into the picture.
    pub forward: DVec3,
    /// Unit vector to the right of the picture.
    pub right: DVec3,
    /// Unit vector to the top of the picture.
    pub up: DVec3,
}

impl Basis {
    /// The axes of a camera, whose `up` need not be perpendicular to its view direction.
    pub fn of(camera: &Camera) -> Self {
        let forward = (camera.look_at - camera.position).normalize_or(DVec3::NEG_Z);
        let sideways = forward.cross(camera.up.normalize_or(DVec3::Y));
        let right = sideways.try_normalize().unwrap_or_else(|| forward.any_orthonormal_vector());
        Self { forward, right, up: right.cross(forward) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(width: u32, height: u32, samples: u32) -> FrameView {
        let camera = Camera {
            position: DVec3::new(1.0, 2.0, 3.0),
            look_at: DVec3::new(1.0, 2.0, -5.0),
            up: DVec3::Y,
            fov: 90.0,
            zoom: 1.0,
        };
        FrameView { camera, width, height, samples, spin: 0.0 }
    }

    #[test]
    fn the_picture_spans_the_field_of_view() {
        let rays = PinholeRays::new(&view(4, 2, 1));
        // Pixel centres at 1/4 of the half height: the plane reaches from y = +1 to -1.
        let top_left = rays.direction(0, 0, 0);
        assert!((top_left - DVec3::new(-1.5, 0.5, -1.0)).length() < 1e-12, "{top_left}");
        let bottom_right = rays.direction(3, 1, 0);
        assert!((bottom_right - DVec3::new(1.5, -0.5, -1.0)).length() < 1e-12, "{bottom_right}");
    }

    #[test]
    fn samples_lie_on_a_grid_whose_mean_is_the_centre() {
        let (one, nine) = (PinholeRays::new(&view(64, 64, 1)), PinholeRays::new(&view(64, 64, 9)));
        let mean = (0..9).map(|i| nine.direction(10, 20, i)).sum::<DVec3>() / 9.0;
        assert!((mean - one.direction(10, 20, 0)).length() < 1e-12);
        let first = nine.direction(10, 20, 0) - nine.corner;
        assert!((first - nine.right * (10.0 + 0.5 / 3.0) - nine.down * (20.0 + 0.5 / 3.0)).length() < 1e-12);
    }

    #[test]
    fn zoom_divides_the_view_plane() {
        let mut zoomed = view(4, 2, 1);
        zoomed.camera.zoom = 2.0;
        let direction = PinholeRays::new(&zoomed).direction(0, 0, 0);
        assert!((direction - DVec3::new(-0.75, 0.25, -1.0)).length() < 1e-12, "{direction}");
    }

    #[test]
    fn up_along_the_view_still_gives_axes() {
        let mut camera = view(1, 1, 1).camera;
        camera.up = DVec3::NEG_Z;
        let Basis { forward, right, up } = Basis::of(&camera);
        assert!(forward.dot(right).abs() < 1e-12 && up.dot(right).abs() < 1e-12 && right.is_normalized());
    }
}
