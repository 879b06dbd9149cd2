//! Checks of objects that move.

use glam::DMat3;

use super::{Check, FINITE, ValidateError, is_point, require};
use crate::scene::data::{Motion, Scene};

/// Largest relative difference between the factors of a group that counts as equal.
const TOLERANCE: f64 = 1e-4;

const DARK: &str = "of materials without emission, because it moves: a light that moves cannot be sampled";

impl Scene {
    /// Checks that each motion is of another object, in range and finite, that nothing that moves emits light, and that rotation keeps
    /// the shape of models in groups.
    pub(super) fn check_motions(&self) -> Check {
        // Longer lists name an object twice.
        let (what, count) = ("moving objects", self.motions.len());
        let limit = self.models.len() + self.spheres.len();
        if count > limit {
            return Err(ValidateError::TooMany { what, count, limit });
        }
        let mut moving = vec![false; limit];
        for (index, motion) in self.motions.iter().enumerate() {
            let name = format!("motions[{index}]");
            let place = self.check_motion(motion, &name)?;
            let first = moving.get_mut(place).is_some_and(|seen| !std::mem::replace(seen, true));
            require(first, || name, "of an object without another motion")?;
        }
        Ok(())
    }

    /// Checks a motion. Returns the place of its object among all models and spheres.
    fn check_motion(&self, motion: &Motion, name: &str) -> Result<usize, ValidateError> {
        match *motion {
            Motion::Sphere { sphere, center } => {
                let index = sphere as usize;
                let unlisted =
                    ValidateError::Unfit { what: name.into(), expected: "of one of the scene's spheres" };
                let sphere = self.spheres.get(index).ok_or(unlisted)?;
                require(is_point(center), || format!("{name}.center"), FINITE)?;
                require(self.is_dark(sphere.material), || format!("spheres[{index}]"), DARK)?;
                Ok(self.models.len() + index)
            }
            Motion::Model { model, translate, rotate } => {
                let index = model as usize;
                let unlisted =
                    ValidateError::Unfit { what: name.into(), expected: "of one of the scene's models" };
                let model = self.models.get(index).ok_or(unlisted)?;
                require(is_point(translate), || format!("{name}.translate"), FINITE)?;
                require(is_point(rotate), || format!("{name}.rotate"), FINITE)?;
                let dark = model.materials.iter().all(|&material| self.is_dark(material));
                require(dark, || format!("models[{index}]"), DARK)?;
                let rigid = rotate == model.rotate || keeps_shapes(&model.group);
                let expected = "one that scales all axes by one factor, because the model rotates";
                require(rigid, || format!("models[{index}].group"), expected)?;
                Ok(index)
            }
        }
    }

    fn is_dark(&self, material: u32) -> bool {
        self.materials.get(material as usize).is_none_or(|material| !material.is_emissive())
    }
}

/// Whether a map scales all lengths by one factor.
fn keeps_shapes(map: &DMat3) -> bool {
    let scale = libm::cbrt(map.determinant().abs());
    let unscaled = *map * (1.0 / scale);
    let product = unscaled.transpose() * unscaled;
    product.abs_diff_eq(DMat3::IDENTITY, TOLERANCE)
}
