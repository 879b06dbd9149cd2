//! What stands on the table by the window: glasses, a carafe, a silver teapot, a copper bowl with lemons. Units are
//! centimetres, and everything stands on Y = 0 round the origin. Glass and what it holds overlap by half a wall, so
//! that no air is between them.
//!
//! The files have no normals: the loader computes them. Their materials are those of the scene file.

mod copper;
mod glass;
mod silver;
mod sky;
mod wood;

use super::obj::Digits::Coarse;
use super::obj::Shading::Flat;
use super::shape::{Material, Model, Shape};
use super::{Content, Folder, GeneratedFile, Part};

/// The material of a file that is used without a scene.
static PLAIN: Material = Material::glossy("plain", [0.6, 0.6, 0.6], 0.3, 60.0);

/// All meshes in `models/table/`.
pub(crate) fn folder() -> Folder {
    let part = |name, shape: Shape| {
        let mut model = Model::default();
        model.add(&PLAIN, shape);
        Part::new(name, Flat, Coarse, model)
    };
    let parts = vec![
        part("wine_glass", glass::wine_glass()),
        part("wine", glass::wine()),
        part("carafe", glass::carafe()),
        part("water", glass::water()),
        part("teapot", silver::teapot()),
        part("teapot_handle", silver::teapot_handle()),
        part("spoon", silver::spoon()),
        part("bowl", copper::bowl()),
        part("lemon", copper::lemon()),
    ];
    Folder { name: "table", parts }
}

/// The sky outside, and the wood of the table.
pub(crate) fn pictures() -> Vec<GeneratedFile> {
    let picture = |name: &str, picture| GeneratedFile {
        path: format!("table/{name}"),
        content: Content::Picture(picture),
        triangles: 0,
    };
    vec![picture("sky.png", sky::picture()), picture("wood.png", wood::picture())]
}
