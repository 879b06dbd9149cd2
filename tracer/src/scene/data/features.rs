//! Features that a scene uses: everything else is neither computed nor worth a knob.

use super::{NormalMode, Quality, Scene, Shading};
use crate::material::Material;
use crate::texture::Filter;

/// Features that a scene uses. Only materials that are assigned to some geometry count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneFeatures {
    /// A material has a specular colour: directions to the viewer are needed.
    pub specular: bool,
    /// A specular material has an exponent for which [`super::ExponentPrecision`] makes a difference.
    pub powers: bool,
    /// A material has a texture.
    pub textured: bool,
    /// A material has a texture, and some texture of the scene has a filter other than nearest.
    pub filtered: bool,
    /// A material takes the colours of vertices.
    pub vertex_colors: bool,
    /// A material emits light.
    pub emissive: bool,
    /// A material is unlit.
    pub unlit: bool,
    /// A material is cut out by alpha.
    pub cut_out: bool,
    /// A model has interpolated normals.
    pub smooth: bool,
    /// A light casts shadows.
    pub shadows: bool,
    /// A material reflects or transmits: rays bounce, or a transparent body around the camera absorbs.
    pub bounces: bool,
    /// A material transmits: its sides differ, and shadows are not all or nothing.
    pub transparent: bool,
    /// A transparent material absorbs light: so does the way of a camera's ray that starts inside it.
    pub absorbing: bool,
    /// A material of some geometry casts no shadow.
    pub shadowless: bool,
    /// A light that casts shadows has an extent.
    pub soft_shadows: bool,
    /// A material has a checker pattern.
    pub checkered: bool,
    /// A material has a normal map.
    pub normal_mapped: bool,
    /// A material is metallic-roughness.
    pub metallic_roughness: bool,
    /// A metallic-roughness material has a texture of both shares, which only the path integrator shows.
    pub rough_textured: bool,
    /// A volume scatters light.
    pub volumes: bool,
    /// An object moves while the shutter is open.
    pub motion: bool,
}

impl SceneFeatures {
    /// Features of a scene, in time linear in its objects.
    pub fn of(scene: &Scene) -> Self {
        let any = |has: fn(&Material) -> bool| {
            assigned(scene).any(|index| scene.materials.get(index as usize).is_some_and(has))
        };
        let textured = any(|material| material.texture.is_some() || material.emission_texture.is_some());
        Self {
            specular: any(Material::is_specular),
            powers: any(|material| material.is_specular() && !material.has_squared_highlight()),
            textured,
            filtered: textured && scene.textures.iter().any(|map| map.filter != Filter::Nearest),
            vertex_colors: any(|material| material.vertex_colors),
            emissive: any(Material::is_emissive),
            unlit: any(|material| material.unlit),
            cut_out: any(|material| material.cutout.is_some()),
            smooth: scene.models.iter().any(|model| model.normals == NormalMode::Smooth),
            shadows: scene.lights.iter().any(|light| light.shadows),
            bounces: any(Material::bounces),
            transparent: any(Material::is_transparent),
            absorbing: any(Material::absorbs),
            shadowless: any(|material| !material.casts_shadow),
            soft_shadows: scene.lights.iter().any(|light| light.shadows && light.radius > 0.0),
            checkered: any(|material| material.checker.is_some()),
            normal_mapped: any(|material| material.normal_map.is_some()),
            metallic_roughness: any(|material| material.metallic_roughness.is_some()),
            rough_textured: any(Material::has_rough_texture),
            volumes: scene.volumes.iter().any(|volume| volume.density > 0.0),
            motion: scene.motions.iter().any(|motion| motion.moves(scene)),
        }
    }

    /// Whether shading normals differ from geometric ones: they are interpolated, or tilted by a normal map.
    #[inline(always)]
    pub fn shaded_normals(&self) -> bool {
        self.smooth || self.normal_mapped
    }

    /// Features that remain after applying a quality setting.
    #[must_use]
    pub fn at(self, quality: &Quality) -> Self {
        let full = quality.shading == Shading::Full;
        let shown = self.shown_by(quality.shading);
        Self {
            specular: shown.specular && full,
            powers: shown.powers && full,
            filtered: shown.filtered && quality.filter != Some(Filter::Nearest),
            shadows: shown.shadows && quality.shadows,
            soft_shadows: shown.soft_shadows && quality.shadows,
            bounces: shown.bounces && (quality.max_depth > 0 || shown.absorbing),
            ..shown
        }
    }

    /// Features that pictures of a kind show. Those of light show all.
    #[must_use]
    pub fn shown_by(self, shading: Shading) -> Self {
        let holes = Self { cut_out: self.cut_out, ..Self::default() };
        match shading {
            Shading::Full | Shading::Diffuse => self,
            Shading::Normals => Self { smooth: self.smooth, normal_mapped: self.normal_mapped, ..holes },
            Shading::Depth | Shading::Item => holes,
            Shading::Albedo => Self {
                textured: self.textured,
                filtered: self.filtered,
                vertex_colors: self.vertex_colors,
                checkered: self.checkered,
                ..holes
            },
        }
    }
}

/// Indices of the materials that are assigned to geometry, with repetitions.
fn assigned(scene: &Scene) -> impl Iterator<Item = u32> {
    let on_models = scene.models.iter().flat_map(|model| model.materials.iter().copied());
    on_models
        .chain(scene.spheres.iter().map(|sphere| sphere.material))
        .chain(scene.disks.iter().map(|disk| disk.material))
        .chain(scene.planes.iter().map(|plane| plane.material))
        .chain(scene.triangles.iter().map(|triangle| triangle.material))
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::super::{
        Attenuation, Background, Camera, ExponentPrecision, Light, LightKind, RenderSettings, Sphere,
    };
    use super::*;
    use crate::material::MetallicRoughness;

    fn scene(material: Material, assigned: bool) -> Scene {
        let sphere = Sphere {
            center: DVec3::ZERO,
            radius: 1.0,
            material: 0,
            inside_out: false,
            uv_rotate: DVec3::ZERO,
        };
        let position = DVec3::Y;
        Scene {
            ambient: Vec3::ZERO,
            render: RenderSettings::default(),
            camera: Camera {
                position: DVec3::Z,
                look_at: DVec3::ZERO,
                up: DVec3::Y,
                fov: 40.0,
                zoom: 1.0,
                kind: crate::scene::CameraKind::PINHOLE,
            },
            background: Background::Color(Vec3::ZERO),
            lights: vec![Light {
                kind: LightKind::Point { position },
                color: Vec3::ONE,
                attenuation: Attenuation::None,
                shadows: true,
                radius: 0.0,
                shadow_samples: None,
            }],
            materials: vec![material],
            textures: Vec::new(),
            models: Vec::new(),
            spheres: if assigned { vec![sphere] } else { Vec::new() },
            planes: Vec::new(),
            triangles: Vec::new(),
            disks: Vec::new(),
            background_visible: true,
            ..Scene::default()
        }
    }

    #[test]
    fn only_assigned_materials_count() {
        let glossy = Material { exponent: 10.5, ..Material::NEUTRAL };
        let features = SceneFeatures::of(&scene(glossy, true));
        assert!(features.specular && features.powers && features.shadows);
        assert!(!features.textured && !features.filtered && !features.smooth && !features.emissive);
        let unused = SceneFeatures::of(&scene(glossy, false));
        assert!(!unused.specular && !unused.powers);
        let squared = SceneFeatures::of(&scene(Material::NEUTRAL, true));
        assert!(squared.specular && !squared.powers, "whole exponents are squared");
    }

    #[test]
    fn metallic_roughness_counts_where_it_is_assigned() {
        let model = MetallicRoughness {
            metallic: 1.0,
            roughness: 0.5,
            transmission: 0.0,
            specular_factor: 1.0,
            texture: None,
        };
        let metal = Material { metallic_roughness: Some(model), ..Material::NEUTRAL };
        assert!(SceneFeatures::of(&scene(metal, true)).metallic_roughness);
        assert!(!SceneFeatures::of(&scene(metal, false)).metallic_roughness);
        assert!(!SceneFeatures::of(&scene(Material::NEUTRAL, true)).metallic_roughness);
    }

    #[test]
    fn quality_removes_features() {
        let features = SceneFeatures::of(&scene(Material { exponent: 0.5, ..Material::NEUTRAL }, true));
        let quality = Quality { shading: Shading::Diffuse, shadows: false, ..Quality::default() };
        let left = features.at(&quality);
        assert!(!left.specular && !left.powers && !left.shadows);
        let fast = Quality { exponent: ExponentPrecision::Fast, ..Quality::default() };
        assert_eq!(features.at(&fast), features);
    }

    #[test]
    fn pictures_without_light_use_no_feature_of_light() {
        let everything = SceneFeatures {
            specular: true,
            powers: true,
            textured: true,
            filtered: true,
            vertex_colors: true,
            emissive: true,
            unlit: true,
            cut_out: true,
            smooth: true,
            shadows: true,
            bounces: true,
            transparent: true,
            absorbing: true,
            shadowless: true,
            soft_shadows: true,
            checkered: true,
            normal_mapped: true,
            metallic_roughness: true,
            rough_textured: true,
            volumes: true,
            motion: true,
        };
        let at = |shading| everything.at(&Quality { shading, ..Quality::default() });
        assert_eq!(at(Shading::Full), everything);
        let holes = SceneFeatures { cut_out: true, ..SceneFeatures::default() };
        assert_eq!((at(Shading::Depth), at(Shading::Item)), (holes, holes));
        assert_eq!(at(Shading::Normals), SceneFeatures { smooth: true, normal_mapped: true, ..holes });
        let colored = SceneFeatures { textured: true, filtered: true, vertex_colors: true, ..holes };
        assert_eq!(at(Shading::Albedo), SceneFeatures { checkered: true, ..colored });
        let nearest =
            Quality { shading: Shading::Albedo, filter: Some(Filter::Nearest), ..Quality::default() };
        assert!(!everything.at(&nearest).filtered);
    }
}
