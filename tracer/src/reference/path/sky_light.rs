//! The sky as a light: directions by the light that comes from there, in a panorama or in a cube map.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::super::Oracle;
use super::super::sky::cube_face;
use crate::scene::{Background, SkyPicture};
use crate::texture::{Distribution, Texture};

/// The pictures of a sky with light.
pub(super) enum SkyLight {
    Panorama(Arc<Texture>),
    /// +X, -X, +Y, -Y, +Z, -Z.
    Cube([Arc<Texture>; 6]),
}

impl SkyLight {
    /// The sky of a scene, if it has pictures with light.
    pub(super) fn of(oracle: &Oracle) -> Option<Self> {
        let Background::Sky(sky) = &oracle.scene.background else { return None };
        let texture = |index: u32| {
            let id = oracle.scene.textures[index as usize].texture;
            oracle.textures.iter().find(|texture| texture.id() == id).cloned()
        };
        let light = match sky.picture {
            SkyPicture::Panorama(index) => Self::Panorama(texture(index)?),
            SkyPicture::Cubemap([a, b, c, d, e, f]) => {
                Self::Cube([texture(a)?, texture(b)?, texture(c)?, texture(d)?, texture(e)?, texture(f)?])
            }
        };
        (light.mean() > 0.0).then_some(light)
    }

    /// Mean radiance over all directions, the channels averaged, before the strength.
    pub(super) fn mean(&self) -> f64 {
        match self {
            // The weights of the picture have the sines of its rows, whose mean is 2 / pi, and the channels added.
            Self::Panorama(texture) => texture.light().map_or(0.0, Distribution::total) * (PI / 2.0) / 3.0,
            Self::Cube(faces) => faces.iter().map(light_of_face).sum::<f64>() / (4.0 * PI) / 3.0,
        }
    }

    /// The direction of a point of the unit square, and its density over solid angle.
    pub(super) fn sample(&self, at: DVec2) -> Option<(DVec3, f64)> {
        match self {
            Self::Panorama(texture) => {
                let place = texture.light()?.place([at.x as f32, at.y as f32]);
                // Rows begin at the bottom.
                let [u, v] = place.at.map(f64::from);
                let (sine, cosine) = libm::sincos(PI * (1.0 - v));
                let (s, c) = libm::sincos(2.0 * PI * (u - 0.5));
                let density = f64::from(place.density) / (2.0 * PI * PI * sine);
                Some((DVec3::new(sine * s, cosine, -sine * c), density))
            }
            Self::Cube(faces) => {
                let total: f64 = faces.iter().map(light_of_face).sum();
                let mut start = 0.0;
                for (index, face) in faces.iter().enumerate() {
                    let probability = light_of_face(face) / total;
                    if at.x < start + probability {
                        let x = (at.x - start) / probability;
                        let place = face.face_light()?.place([x as f32, at.y as f32]);
                        let [u, v] = place.at.map(f64::from);
                        let direction = from_face(index, DVec2::new(u, 1.0 - v));
                        let density = probability * f64::from(place.density) * per_solid_angle(direction);
                        return Some((direction.normalize(), density));
                    }
                    start += probability;
                }
                None
            }
        }
    }

    /// The density over solid angle of a unit direction.
    pub(super) fn density(&self, d: DVec3) -> f64 {
        match self {
            Self::Panorama(texture) => {
                let Some(light) = texture.light() else { return 0.0 };
                let u = (0.5 + libm::atan2(d.x, -d.z) / (2.0 * PI)).rem_euclid(1.0);
                let v = 1.0 - libm::acos(d.y.clamp(-1.0, 1.0)) / PI;
                f64::from(light.density([u as f32, v as f32])) / (2.0 * PI * PI * d.x.hypot(d.z))
            }
            Self::Cube(faces) => {
                let total: f64 = faces.iter().map(light_of_face).sum();
                let (face, place) = cube_face(d);
                let Some(light) = faces[face].face_light() else { return 0.0 };
                let probability = light_of_face(&faces[face]) / total;
                let density = f64::from(light.density([place.x as f32, (1.0 - place.y) as f32]));
                probability * density * per_solid_angle(d / d.abs().max_element())
            }
        }
    }
}

/// Integral over the solid angle of a face of red, green and blue added.
fn light_of_face(face: &Arc<Texture>) -> f64 {
    face.face_light().map_or(0.0, Distribution::total)
}

/// Density over solid angle where that over the unit square of a face is 1: the cube is at the distance 1, has sides of 2, and is seen at a
/// slant.
fn per_solid_angle(on_cube: DVec3) -> f64 {
    on_cube.length().powi(3) / 4.0
}

/// The direction of a place on a face, s from the left and t from the top of its picture: the inverse of OpenGL's table.
fn from_face(face: usize, place: DVec2) -> DVec3 {
    let DVec2 { x: s, y: t } = place * 2.0 - 1.0;
    match face {
        0 => DVec3::new(1.0, -t, -s),
        1 => DVec3::new(-1.0, -t, s),
        2 => DVec3::new(s, 1.0, t),
        3 => DVec3::new(s, -1.0, -t),
        4 => DVec3::new(s, -t, 1.0),
        _ => DVec3::new(-s, -t, -1.0),
    }
}
