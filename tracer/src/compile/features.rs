//! Features that a scene uses.

use crate::scene::{Material, NormalMode, Quality, Scene, Shading};

/// Features that a scene uses. Those that it does not use are not computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Features {
    /// A primitive has a material with a specular colour: shading needs directions to the viewer.
    pub specular: bool,
    /// A primitive has a material with a texture.
    pub textured: bool,
    /// A primitive has a material with vertex colours.
    pub vertex_colors: bool,
    /// A primitive has a material that emits light.
    pub emissive: bool,
    /// A primitive has an unlit material.
    pub unlit: bool,
    /// A primitive has a material with an alpha cut-out.
    pub cut_out: bool,
    /// A model has interpolated normals: shading normals differ from geometric ones.
    pub smooth: bool,
}

impl Features {
    /// The features of a scene at full quality.
    pub(crate) fn of(scene: &Scene) -> Self {
        let any = |uses: fn(&Material) -> bool| {
            used_materials(scene).any(|index| scene.materials.get(index as usize).is_some_and(uses))
        };
        Self {
            specular: any(Material::is_specular),
            textured: any(|material| material.texture.is_some() || material.emission_texture.is_some()),
            vertex_colors: any(|material| material.vertex_colors),
            emissive: any(Material::is_emissive),
            unlit: any(|material| material.unlit),
            cut_out: any(|material| material.cutout.is_some()),
            smooth: scene.models.iter().any(|model| model.normals == NormalMode::Smooth),
        }
    }

    /// Features that remain after applying a quality setting.
    #[must_use]
    pub fn at(self, quality: &Quality) -> Self {
        Self { specular: self.specular && quality.shading == Shading::Full, ..self }
    }
}

/// Indices of the materials of all primitives.
fn used_materials(scene: &Scene) -> impl Iterator<Item = u32> {
    let on_models = scene.models.iter().flat_map(|model| model.materials.iter().copied());
    on_models
        .chain(scene.spheres.iter().map(|sphere| sphere.material))
        .chain(scene.planes.iter().map(|plane| plane.material))
        .chain(scene.triangles.iter().map(|triangle| triangle.material))
}
