//! Rays of the camera: a random place in the pixel, and a random point of the lens.

use super::super::camera::{CameraRay, Ray};
use super::PathOracle;
use super::hemisphere::on_disk;
use super::numbers::Numbers;
use crate::scene::CameraKind;

impl PathOracle<'_> {
    /// The ray of a sample.
    pub(super) fn camera_ray(&self, [x, y]: [u32; 2], numbers: &Numbers) -> CameraRay {
        let place = numbers.in_pixel();
        let through = self.oracle.camera_ray(f64::from(x) + place.x, f64::from(y) + place.y);
        CameraRay { ray: self.through_lens(through.ray, numbers), ..through }
    }

    /// A thin lens bends the rays of all its points to the point of the sharp plane that the ray through its centre meets.
    fn through_lens(&self, ray: Ray, numbers: &Numbers) -> Ray {
        let (camera, lens) = (&self.oracle.view.camera, &self.oracle.view.lens);
        if !matches!(camera.kind, CameraKind::Pinhole { .. }) || lens.aperture == 0.0 {
            return ray;
        }
        let to_target = camera.look_at - camera.position;
        let forward = to_target.normalize();
        let right = forward.cross(camera.up).normalize();
        let up = right.cross(forward);
        let depth = lens.focus_distance.unwrap_or(to_target.length());
        let sharp = ray.direction * (depth / ray.direction.dot(forward));
        let place = on_disk(numbers.on_lens()) * lens.aperture;
        let origin = right * place.x + up * place.y;
        Ray { origin, direction: (sharp - origin).normalize(), ..ray }
    }
}
