//! Options for loading scenes and models.

use glam::DVec3;

/// Options for loading a scene and its files. The default is safe for untrusted files.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Whether pictures of a model's materials may be outside of the model's folder: in folders above it (`..`), and
    /// behind links.
    pub allow_parent_textures: bool,
    /// Up axis of a bare model. In a scene file each `[[model]]` has its own.
    pub up: Option<Up>,
    /// Crease angle in degrees of a bare model without normals and smoothing groups: faces that meet at a smaller
    /// angle are smooth.
    pub crease_angle: Option<f64>,
    /// Width and height of the picture for a default camera; `None`: those of the scene.
    pub size: Option<(u32, u32)>,
}

/// Default crease angle in degrees.
pub const DEFAULT_CREASE_ANGLE: f64 = 40.0;

/// The up axis of a model file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Up {
    /// Y, as in scenes.
    #[default]
    Y,
    /// Z, as in CAD programs and scanners.
    Z,
}

impl Up {
    /// Each value with its word on the command line and in scene files.
    pub const WORDS: [(&'static str, Self); 2] = [("y", Self::Y), ("z", Self::Z)];

    /// Rotation and scale of an instance whose mesh is first rotated upright.
    pub(in crate::scene) fn before(self, rotate: DVec3, scale: DVec3) -> (DVec3, DVec3) {
        match self {
            Self::Y => (rotate, scale),
            // Z becomes Y, and Y becomes -Z, by the first rotation of an instance; its scale comes before that.
            Self::Z => (rotate - DVec3::X * 90.0, DVec3::new(scale.x, scale.z, scale.y)),
        }
    }

    /// A point or direction of the file, rotated upright.
    pub(in crate::scene) fn upright(self, point: DVec3) -> DVec3 {
        match self {
            Self::Y => point,
            Self::Z => DVec3::new(point.x, point.z, -point.y),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;
    use crate::rotation;

    #[test]
    fn a_mesh_is_rotated_upright_before_its_instance_is_scaled_and_rotated() {
        let (rotate, scale) = (DVec3::new(30.0, -50.0, 200.0), DVec3::new(2.0, 3.0, -5.0));
        for up in [Up::Y, Up::Z] {
            let (turned, scaled) = up.before(rotate, scale);
            for point in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(1.0, -2.0, 0.5)] {
                let expected = rotation::of_model(rotate) * (scale * up.upright(point));
                let matrix = rotation::of_model(turned) * DMat3::from_diagonal(scaled);
                assert!((matrix * point - expected).length() < 1e-14, "{up:?} {point}");
            }
        }
        assert_eq!((Up::Z.upright(DVec3::Z), Up::Z.upright(DVec3::Y)), (DVec3::Y, DVec3::NEG_Z));
    }
}
