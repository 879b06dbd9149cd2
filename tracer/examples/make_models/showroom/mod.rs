//! A flacon on a turntable and the lamps above it. Units are centimetres, and everything stands on Y = 0 round the
//! origin. The files have no normals: the loader computes them. Their materials are those of the scene file.

mod flacon;
mod lamp;
mod stage;

use super::obj::Digits::Coarse;
use super::obj::Shading::Flat;
use super::shape::{Material, Model, Shape};
use super::{Folder, Part};

/// The material of a file that is used without a scene.
static PLAIN: Material = Material::glossy("plain", [0.6, 0.6, 0.6], 0.3, 60.0);

/// All meshes in `models/showroom/`.
pub(crate) fn folder() -> Folder {
    let part = |name, shape: Shape| {
        let mut model = Model::default();
        model.add(&PLAIN, shape);
        Part::new(name, Flat, Coarse, model)
    };
    let parts = vec![
        part("flacon", flacon::glass()),
        part("perfume", flacon::perfume()),
        part("collar", flacon::collar()),
        part("lamp", lamp::shade()),
        part("turntable", stage::turntable()),
        part("vase", stage::vase()),
    ];
    Folder { name: "showroom", parts }
}
