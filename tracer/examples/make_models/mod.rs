//! The generator: named shapes, things built of them, and the text that is written.

mod angle;
mod balls;
mod camera;
mod chess;
mod color;
mod globe;
mod noise;
mod obj;
mod random;
mod room;
mod shape;
mod shapes;
mod showroom;
mod sky;
mod table;

use std::path::Path;

use obj::{Digits, Shading, mtl_text, obj_text};
use rayfarm_tracer::image::{Channels, ImageError, Layer, LinearImage, RgbImage, save_layers};
use shape::Model;

/// A generated file.
pub(crate) struct GeneratedFile {
    /// Path inside `models/`.
    pub(crate) path: String,
    /// What stands in it.
    pub(crate) content: Content,
    /// Triangles in it; none in a material library or a picture.
    pub(crate) triangles: usize,
}

/// A text, a picture that becomes a PNG, or one of linear light that becomes a Radiance HDR.
pub(crate) enum Content {
    /// OBJ, MTL or a scene file.
    Text(String),
    /// A texture.
    Picture(RgbImage),
    /// A sky.
    Light(LinearImage),
}

/// The OBJ files of one scene with their common material library.
pub(crate) struct Folder {
    /// Name of the folder and of the library.
    pub(crate) name: &'static str,
    /// What becomes an OBJ file each.
    pub(crate) parts: Vec<Part>,
}

/// One OBJ file.
pub(crate) struct Part {
    name: &'static str,
    shading: Shading,
    digits: Digits,
    model: Model,
}

impl Part {
    /// Names a model's file and how it is written.
    pub(crate) fn new(name: &'static str, shading: Shading, digits: Digits, model: Model) -> Self {
        Self { name, shading, digits, model }
    }
}

/// Every generated file of `models/`.
pub(crate) fn files() -> Vec<GeneratedFile> {
    let folders = [
        room::folder(),
        camera::folder(),
        chess::folder(),
        globe::folder(),
        table::folder(),
        showroom::folder(),
    ];
    let others =
        [globe::textured_files(), table::pictures(), showroom::pictures(), sky::pictures(), balls::scenes()];
    folders.iter().flat_map(files_of).chain(others.into_iter().flatten()).collect()
}

fn files_of(folder: &Folder) -> Vec<GeneratedFile> {
    let library = format!("{}.mtl", folder.name);
    let materials =
        folder.parts.iter().flat_map(|part| part.model.groups.iter().map(|(material, _)| *material));
    let mut files = vec![GeneratedFile {
        path: format!("{}/{library}", folder.name),
        content: Content::Text(mtl_text(materials)),
        triangles: 0,
    }];
    files.extend(folder.parts.iter().map(|part| {
        let (text, triangles) = obj_text(&part.model, &library, part.shading, part.digits);
        let path = format!("{}/{}.obj", folder.name, part.name);
        GeneratedFile { path, content: Content::Text(text), triangles }
    }));
    files
}

/// Writes linear light as Radiance HDR.
pub(crate) fn save_light(path: &Path, picture: &LinearImage) -> Result<(), ImageError> {
    let layer = Layer { name: "", channels: Channels::Color, picture: picture.clone() };
    save_layers(path, &[layer])
}
