//! What the user may say about the files that a scene names.

use glam::DVec3;

/// How a scene and its files are read. The default is what files from elsewhere may ask for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Pictures that a model's materials name may be outside of the model's folder: in folders above it (`..`), and where
    /// links lead.
    pub allow_parent_textures: bool,
    /// The axis of a model by itself that points up. In a scene file each `[[model]]` has its own.
    pub up: Option<Up>,
    /// Degrees up to which faces of a model by itself are smooth, where its file has neither normals nor smoothing groups.
    pub crease_angle: Option<f64>,
    /// Width and height of the picture that a camera is to fill, where the file has no camera; without it, the scene's own.
    pub size: Option<(u32, u32)>,
}

/// The crease angle where none is given, in degrees.
pub const DEFAULT_CREASE_ANGLE: f64 = 40.0;

/// The axis of a model's file that points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Up {
    /// As in a scene.
    #[default]
    Y,
    /// As CAD programs and scanners have it.
    Z,
}

impl Up {
    /// The words of options and scene files.
    pub const WORDS: [(&'static str, Self); 2] = [("y", Self::Y), ("z", Self::Z)];

    /// Rotation and scale of an instance whose file is turned upright before both.
    pub(in crate::scene) fn before(self, rotate: DVec3, scale: DVec3) -> (DVec3, DVec3) {
        match self {
            Self::Y => (rotate, scale),
            // Z becomes Y, and Y becomes -Z, by the first rotation of an instance; its scale comes before that.
            Self::Z => (rotate - DVec3::X * 90.0, DVec3::new(scale.x, scale.z, scale.y)),
        }
    }

    /// A point or direction of the file, upright.
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
    fn a_file_is_turned_upright_before_its_instance_is_scaled_and_rotated() {
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
