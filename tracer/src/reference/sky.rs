//! The background: colours, gradients, and pictures all around.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::Oracle;
use super::texture::{Border, linear_texel};
use crate::scene::{Background, Sky, SkyPicture};

impl Oracle {
    /// The background as rays of the camera see it.
    pub(super) fn background_of_camera(&self, direction: DVec3) -> DVec3 {
        if self.scene.background_visible { self.background(direction) } else { DVec3::ZERO }
    }

    /// Linear RGB of the background in a unit direction.
    pub(super) fn background(&self, direction: DVec3) -> DVec3 {
        match self.scene.background {
            Background::Color(color) => color.as_dvec3(),
            Background::Gradient { bottom, top } => {
                bottom.as_dvec3().lerp(top.as_dvec3(), (direction.y + 1.0) / 2.0)
            }
            Background::Sky(sky) => self.sky(&sky, direction),
        }
    }

    fn sky(&self, sky: &Sky, direction: DVec3) -> DVec3 {
        // The inverse rotation about y.
        let (s, c) = libm::sincos(-sky.rotate.to_radians());
        let d = DVec3::new(c * direction.x + s * direction.z, direction.y, c * direction.z - s * direction.x);
        let radiance = match sky.picture {
            SkyPicture::Panorama(texture) => {
                let u = 0.5 + libm::atan2(d.x, -d.z) / (2.0 * PI);
                let from_top = libm::acos(d.y.clamp(-1.0, 1.0)) / PI;
                self.sky_texel(texture, DVec2::new(u, from_top), Border::Cyclic)
            }
            SkyPicture::Cubemap(faces) => {
                let (face, place) = cube_face(d);
                self.sky_texel(faces[face], place, Border::Clamped)
            }
        };
        radiance * f64::from(sky.strength)
    }

    /// Bilinear lookup at a place from the top left corner, both coordinates from 0 to 1.
    fn sky_texel(&self, texture: u32, place: DVec2, sides: Border) -> DVec3 {
        let id = self.scene.textures[texture as usize].texture;
        let Some(texture) = self.textures.iter().find(|texture| texture.id() == id) else {
            return DVec3::ONE;
        };
        let (width, height) = (f64::from(texture.width()), f64::from(texture.height()));
        let (x, y) = (place.x * width - 0.5, place.y * height - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let mut sum = DVec3::ZERO;
        for (i, j) in [(left, top), (left + 1.0, top), (left, top + 1.0), (left + 1.0, top + 1.0)] {
            let weight = (1.0 - (x - i).abs()) * (1.0 - (y - j).abs());
            let column = sides.index(i, width);
            let row = height - 1.0 - Border::Clamped.index(j, height);
            sum += linear_texel(texture, column as u32, row as u32) * weight;
        }
        sum
    }
}

/// The face of a cube map that a direction sees, and the place on it from its top left corner: the table of section 8.13 of the
/// OpenGL 4.6 specification.
pub(super) fn cube_face(d: DVec3) -> (usize, DVec2) {
    let size = d.abs();
    let (face, s, t, major) = if size.x >= size.y && size.x >= size.z {
        if d.x > 0.0 { (0, -d.z, -d.y, size.x) } else { (1, d.z, -d.y, size.x) }
    } else if size.y >= size.z {
        if d.y > 0.0 { (2, d.x, d.z, size.y) } else { (3, d.x, -d.z, size.y) }
    } else if d.z > 0.0 {
        (4, d.x, -d.y, size.z)
    } else {
        (5, -d.x, -d.y, size.z)
    };
    (face, DVec2::new(s / major + 1.0, t / major + 1.0) / 2.0)
}
