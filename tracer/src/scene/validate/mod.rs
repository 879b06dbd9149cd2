//! Checks of untrusted scenes: every index in range, every number finite and within its bounds, every list bounded. A
//! scene that passes can be compiled and traced without further checks.

mod motion;

use std::collections::BTreeSet;

use glam::{DVec3, Vec3};

use super::data::{
    Attenuation, Background, Camera, CameraKind, FrameView, Integrator, Lens, Light, LightKind, Model,
    PixelFormat, Quality, RenderSettings, Scene, SkyPicture, ToneMapping, Triangle, Volume, VolumeBoundary,
};
use crate::image::MAX_SIDE;
use crate::material::{Checker, MAX_EXPONENT, Material, NormalMap};
use crate::mesh::MeshId;
use crate::texture::{self, TextureId, TextureMap};

/// Largest number of lights.
pub const MAX_LIGHTS: usize = 4096;
/// Largest number of materials, including those of the models' files.
pub const MAX_MATERIALS: usize = 1 << 18;
/// Largest number of textures.
pub const MAX_TEXTURES: usize = 4096;
/// Largest number of mesh instances.
pub const MAX_MODELS: usize = 1 << 16;
/// Largest number of spheres.
pub const MAX_SPHERES: usize = 1 << 20;
/// Largest number of disks.
pub const MAX_DISKS: usize = 1 << 20;
/// Largest number of infinite planes; every ray tests all of them.
pub const MAX_PLANES: usize = 1024;
/// Largest number of single triangles; larger sets belong into a model.
pub const MAX_TRIANGLES: usize = 1 << 20;
/// Largest number of volumes; every path tests all of them.
pub const MAX_VOLUMES: usize = 64;
/// Largest number of material slots of one model.
pub const MAX_SLOTS: usize = 1 << 16;
/// Largest number of rays per pixel with the direct integrator.
pub const MAX_SAMPLES: u32 = 256;
/// Largest number of paths per pixel.
pub const MAX_PATH_SAMPLES: u32 = 65_536;
/// Largest limit of indirect light.
pub const MAX_CLAMP: f32 = 1e6;
/// Largest exposure in stops, up and down.
pub const MAX_EXPOSURE: f32 = 64.0;
/// Largest number of reflections and transmissions of a ray.
pub const MAX_DEPTH: u8 = 64;
/// Largest number of points of a light that shadow rays go to.
pub const MAX_SHADOW_SAMPLES: u16 = 1024;
/// Largest index of refraction; the smallest is its reciprocal.
pub const MAX_IOR: f32 = 100.0;
/// Largest factor of the tilt of a normal map.
pub const MAX_NORMAL_STRENGTH: f32 = 100.0;
/// Largest magnitude of a coordinate, radius, scale factor or degree: squares and their products stay finite in
/// `f64`.
pub const MAX_COORDINATE: f64 = 1e30;
/// Largest channel of a light or an emission: finite in `f32` after multiplication with an attenuation.
pub const MAX_LIGHT: f32 = 1e30;

/// Reason why a scene cannot be rendered.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ValidateError {
    /// A list is longer than allowed.
    #[error("the scene has {count} {what}; {limit} are allowed")]
    TooMany {
        /// The listed items.
        what: &'static str,
        /// Their number.
        count: usize,
        /// The limit.
        limit: usize,
    },
    /// A number or vector is out of bounds.
    #[error("{what} must be {expected}")]
    Unfit {
        /// Path of the number in the scene.
        what: String,
        /// The bounds.
        expected: &'static str,
    },
    /// A material index is out of range.
    #[error("{what} names material {index}, but the scene has {count}")]
    NoSuchMaterial {
        /// Path of the object with the index.
        what: String,
        /// The index.
        index: u32,
        /// Number of materials of the scene.
        count: usize,
    },
}

type Check = Result<(), ValidateError>;

impl Scene {
    /// Hashes of the meshes of all models and volumes.
    pub fn mesh_ids(&self) -> BTreeSet<MeshId> {
        let of_volumes = self.volumes.iter().filter_map(|volume| volume.boundary.model());
        self.models.iter().chain(of_volumes).map(|model| model.mesh).collect()
    }

    /// Hashes of all textures.
    pub fn texture_ids(&self) -> BTreeSet<TextureId> {
        self.textures.iter().map(|map| map.texture).collect()
    }

    /// Checks a scene from an untrusted source, such as the wire.
    ///
    /// # Errors
    /// The first list that is too long, number that is out of bounds, or index that is out of range.
    pub fn validate(&self) -> Result<(), ValidateError> {
        self.check_counts()?;
        require(is_color(self.ambient, MAX_LIGHT), || "ambient".into(), "finite and not negative")?;
        check_render(&self.render)?;
        check_camera(&self.camera)?;
        check_lens(&self.lens)?;
        self.check_background()?;
        each("lights", &self.lights, check_light)?;
        each("textures", &self.textures, check_texture)?;
        each("materials", &self.materials, |material, name| self.check_material(material, name))?;
        each("models", &self.models, |model, name| self.check_model(model, name))?;
        each("spheres", &self.spheres, |sphere, name| {
            require(is_point(sphere.center), || format!("{name}.center"), FINITE)?;
            require(is_positive(sphere.radius), || format!("{name}.radius"), "above zero and finite")?;
            require(is_point(sphere.uv_rotate), || format!("{name}.uv_rotate"), FINITE)?;
            self.check_material_index(sphere.material, name)
        })?;
        each("disks", &self.disks, |disk, name| {
            require(is_point(disk.center), || format!("{name}.center"), FINITE)?;
            require(is_unit(disk.normal), || format!("{name}.normal"), UNIT)?;
            require(is_positive(disk.radius), || format!("{name}.radius"), "above zero and finite")?;
            self.check_plain_material(disk.material, name)
        })?;
        each("planes", &self.planes, |plane, name| {
            require(is_point(plane.point), || format!("{name}.point"), FINITE)?;
            require(is_unit(plane.normal), || format!("{name}.normal"), UNIT)?;
            require(is_positive(plane.size), || format!("{name}.size"), "above zero and finite")?;
            self.check_material_index(plane.material, name)
        })?;
        each("triangles", &self.triangles, |triangle, name| self.check_triangle(triangle, name))?;
        each("volumes", &self.volumes, |volume, name| self.check_volume(volume, name))?;
        self.check_motions()
    }

    fn check_counts(&self) -> Check {
        for (what, count, limit) in [
            ("lights", self.lights.len(), MAX_LIGHTS),
            ("materials", self.materials.len(), MAX_MATERIALS),
            ("textures", self.textures.len(), MAX_TEXTURES),
            ("models", self.models.len(), MAX_MODELS),
            ("spheres", self.spheres.len(), MAX_SPHERES),
            ("disks", self.disks.len(), MAX_DISKS),
            ("planes", self.planes.len(), MAX_PLANES),
            ("single triangles", self.triangles.len(), MAX_TRIANGLES),
            ("volumes", self.volumes.len(), MAX_VOLUMES),
        ] {
            if count > limit {
                return Err(ValidateError::TooMany { what, count, limit });
            }
        }
        Ok(())
    }

    fn check_model(&self, model: &Model, name: &str) -> Check {
        let (what, count, limit) = ("material slots in one model", model.materials.len(), MAX_SLOTS);
        if count > limit {
            return Err(ValidateError::TooMany { what, count, limit });
        }
        model.materials.iter().try_for_each(|index| self.check_material_index(*index, name))?;
        require(is_point(model.translate), || format!("{name}.translate"), FINITE)?;
        require(is_point(model.rotate), || format!("{name}.rotate"), FINITE)?;
        let scale = is_point(model.scale) && model.scale.to_array().iter().all(|s| *s != 0.0);
        require(scale, || format!("{name}.scale"), "finite and not zero along any axis")?;
        let columns = [model.group.x_axis, model.group.y_axis, model.group.z_axis];
        let invertible = columns.iter().all(|column| is_point(*column)) && {
            let determinant = model.group.determinant();
            determinant != 0.0 && determinant.is_finite() && model.group.inverse().is_finite()
        };
        require(invertible, || format!("{name}.group"), "finite and invertible")
    }

    fn check_volume(&self, volume: &Volume, name: &str) -> Check {
        let density = (0.0..=MAX_COORDINATE).contains(&volume.density);
        require(density, || format!("{name}.density"), "not negative, at most 1e30")?;
        require(is_color(volume.color, 1.0), || format!("{name}.color"), "from 0 to 1")?;
        match &volume.boundary {
            VolumeBoundary::Sphere { center, radius } => {
                require(is_point(*center), || format!("{name}.center"), FINITE)?;
                require(is_positive(*radius), || format!("{name}.radius"), "above zero and finite")
            }
            VolumeBoundary::Box { lower, upper } => {
                require(is_point(*lower) && is_point(*upper), || format!("{name}.box"), FINITE)?;
                require(lower.cmplt(*upper).all(), || format!("{name}.box"), "of three extents above zero")
            }
            VolumeBoundary::Model(model) => {
                let bare = || format!("{name}.model.materials");
                require(model.materials.is_empty(), bare, "empty")?;
                self.check_model(model, &format!("{name}.model"))
            }
        }
    }

    fn check_background(&self) -> Check {
        match &self.background {
            Background::Color(color) => require(is_color(*color, MAX_LIGHT), || "background".into(), LIGHT),
            Background::Gradient { bottom, top } => {
                let fits = is_color(*bottom, MAX_LIGHT) && is_color(*top, MAX_LIGHT);
                require(fits, || "background".into(), LIGHT)
            }
            Background::Sky(sky) => {
                require(is_coordinate(sky.rotate), || "background.rotate".into(), FINITE)?;
                let strength = (0.0..=MAX_LIGHT).contains(&sky.strength);
                require(strength, || "background.strength".into(), LIGHT)?;
                let listed = |texture: &u32| (*texture as usize) < self.textures.len();
                let fits = match &sky.picture {
                    SkyPicture::Panorama(texture) => listed(texture),
                    SkyPicture::Cubemap(faces) => faces.iter().all(listed),
                };
                require(fits, || "background.picture".into(), "made of the scene's textures")
            }
        }
    }

    fn check_triangle(&self, triangle: &Triangle, name: &str) -> Check {
        let finite = triangle.vertices.iter().all(|v| is_point(*v));
        require(finite, || format!("{name}.vertices"), FINITE)?;
        let Some(uvs) = triangle.uvs else { return self.check_plain_material(triangle.material, name) };
        require(uvs.into_iter().all(texture::is_usable), || format!("{name}.uvs"), "finite and small")?;
        self.check_material_index(triangle.material, name)
    }

    fn check_material(&self, material: &Material, name: &str) -> Check {
        check_material(material, name)?;
        let listed = material.textures().all(|index| (index as usize) < self.textures.len());
        require(listed, || format!("{name}.texture"), "one of the scene's textures")
    }

    /// Checks the material of an object without texture coordinates.
    fn check_plain_material(&self, index: u32, name: &str) -> Check {
        self.check_material_index(index, name)?;
        let plain = self.materials.get(index as usize).is_none_or(|material| !material.needs_uvs());
        let expected = "without a texture or a pattern laid in them: there are no texture coordinates";
        require(plain, || format!("{name}.material"), expected)
    }

    fn check_material_index(&self, index: u32, name: &str) -> Check {
        let count = self.materials.len();
        if (index as usize) < count {
            Ok(())
        } else {
            Err(ValidateError::NoSuchMaterial { what: name.into(), index, count })
        }
    }
}

impl FrameView {
    /// Checks a view from an untrusted source.
    ///
    /// # Errors
    /// An invalid camera or lens; a size, a sample count or a number out of bounds; a format or a range of samples that the
    /// integrator does not have.
    pub fn validate(&self) -> Result<(), ValidateError> {
        check_camera(&self.camera)?;
        check_lens(&self.lens)?;
        check_size(self.width, self.height)?;
        check_integrator(&self.integrator, self.samples)?;
        self.check_pass()?;
        check_quality(&self.quality)?;
        check_tone(&self.tone)?;
        require(is_coordinate(self.spin), || "spin".into(), FINITE)
    }

    /// Checks the range of samples and the format of a pass. Where pixels stop by their error, a picture is whole.
    fn check_pass(&self) -> Check {
        let sums = self.format == PixelFormat::Sums;
        let first = || "first_sample".into();
        match &self.integrator {
            Integrator::Direct => {
                require(self.first_sample == 0, first, "0 with the direct integrator")?;
                require(!sums, || "format".into(), "bytes or linear with the direct integrator")
            }
            Integrator::Path(settings) => {
                let end = self.first_sample.checked_add(self.samples);
                let within = end.is_some_and(|end| end <= MAX_PATH_SAMPLES);
                require(within, first, "at most 65536 less the number of samples")?;
                let whole = self.first_sample == 0 && !sums;
                let noise = || "max_noise".into();
                require(whole || settings.max_noise == 0.0, noise, "0 for a pass of a picture")
            }
        }
    }
}

const FINITE: &str = "finite and at most 1e30 in magnitude";
const UNIT: &str = "of unit length";
const LIGHT: &str = "finite, not negative, at most 1e30";

fn require(holds: bool, what: impl FnOnce() -> String, expected: &'static str) -> Check {
    if holds { Ok(()) } else { Err(ValidateError::Unfit { what: what(), expected }) }
}

fn each<T>(list: &str, items: &[T], check: impl Fn(&T, &str) -> Check) -> Check {
    items.iter().enumerate().try_for_each(|(i, item)| check(item, &format!("{list}[{i}]")))
}

fn check_render(render: &RenderSettings) -> Check {
    check_size(render.width, render.height)?;
    check_integrator(&render.integrator, render.samples)?;
    check_quality(&render.quality)?;
    check_tone(&render.tone)
}

fn check_integrator(integrator: &Integrator, samples: u32) -> Check {
    let counted = is_sample_count(integrator, samples);
    let Integrator::Path(settings) = integrator else {
        let expected = "a square number from 1 to 256: 1, 4, 9, 16, ... (with the path integrator any number up to 65536)";
        return require(counted, || "samples".into(), expected);
    };
    require(counted, || "samples".into(), "from 1 to 65536")?;
    let clamp = (0.0..=MAX_CLAMP).contains(&settings.clamp_indirect);
    require(clamp, || "clamp_indirect".into(), "from 0 to 1e6")?;
    require((0.0..=1.0).contains(&settings.max_noise), || "max_noise".into(), "from 0 to 1")
}

fn check_tone(tone: &ToneMapping) -> Check {
    let fits = (-MAX_EXPOSURE..=MAX_EXPOSURE).contains(&tone.exposure);
    require(fits, || "exposure".into(), "from -64 to 64 stops")
}

fn check_lens(lens: &Lens) -> Check {
    let aperture = (0.0..=MAX_COORDINATE).contains(&lens.aperture);
    require(aperture, || "aperture".into(), "not negative, at most 1e30")?;
    let focus = lens.focus_distance.is_none_or(is_positive);
    require(focus, || "focus_distance".into(), "above zero and finite")
}

fn check_quality(quality: &Quality) -> Check {
    require(quality.max_depth <= MAX_DEPTH, || "max_depth".into(), "at most 64")?;
    let share = (0.0..=1.0).contains(&quality.min_contribution);
    require(share, || "min_contribution".into(), "from 0 to 1")?;
    let samples = (1..=MAX_SHADOW_SAMPLES).contains(&quality.shadow_samples);
    require(samples, || "shadow_samples".into(), "from 1 to 1024")
}

fn check_size(width: u32, height: u32) -> Check {
    let fits = |side| (1..=MAX_SIDE).contains(&side);
    require(fits(width), || "width".into(), "from 1 to 16384 pixels")?;
    require(fits(height), || "height".into(), "from 1 to 16384 pixels")
}

fn check_camera(camera: &Camera) -> Check {
    require(is_point(camera.position), || "camera.position".into(), FINITE)?;
    require(is_point(camera.look_at), || "camera.look_at".into(), FINITE)?;
    require(is_point(camera.up), || "camera.up".into(), FINITE)?;
    match camera.kind {
        CameraKind::Pinhole { .. } => {
            let fits = camera.fov > 0.0 && camera.fov < 180.0;
            require(fits, || "camera.fov".into(), "above 0 and below 180 degrees")?;
        }
        CameraKind::Fisheye => {
            let fits = camera.fov > 0.0 && camera.fov <= 360.0;
            require(fits, || "camera.fov".into(), "above 0 and at most 360 degrees")?;
        }
        CameraKind::Orthographic { view_height } => {
            require(is_positive(view_height), || "camera.view_height".into(), "above zero and finite")?;
        }
    }
    require(is_positive(camera.zoom), || "camera.zoom".into(), "above zero and finite")?;
    let fault = view_fault(camera.look_at - camera.position, camera.up);
    require(fault.is_none(), || "camera".into(), fault.unwrap_or_default())
}

/// The fault of a camera that looks along `direction`, both vectors of any length.
pub(in crate::scene) fn view_fault(direction: DVec3, up: DVec3) -> Option<&'static str> {
    let (Some(direction), Some(up)) = (direction.try_normalize(), up.try_normalize()) else {
        return Some("somewhere else than what it looks at, with an `up` that is not zero");
    };
    // The cross product of two parallel unit vectors is zero up to a few roundings.
    let parallel = direction.cross(up).length() <= 8.0 * f64::EPSILON;
    parallel.then_some("turned so that `up` is not parallel to the view direction")
}

fn check_light(light: &Light, name: &str) -> Check {
    let color = is_color(light.color, MAX_LIGHT);
    require(color, || format!("{name}.color"), LIGHT)?;
    let radius = light.radius >= 0.0 && is_coordinate(light.radius);
    require(radius, || format!("{name}.radius"), "not negative and finite")?;
    let samples = light.shadow_samples.is_none_or(|samples| (1..=MAX_SHADOW_SAMPLES).contains(&samples));
    require(samples, || format!("{name}.shadow_samples"), "from 1 to 1024")?;
    if let Attenuation::Polynomial { constant, linear, quadratic } = light.attenuation {
        let terms = [constant, linear, quadratic];
        let fits = terms.iter().all(|t| is_coordinate(*t) && *t >= 0.0) && terms.iter().any(|t| *t > 0.0);
        require(fits, || format!("{name}.attenuation"), "not negative, and above zero in one term")?;
    }
    match light.kind {
        LightKind::Point { position } => require(is_point(position), || format!("{name}.position"), FINITE),
        LightKind::Directional { direction } => {
            require(is_unit(direction), || format!("{name}.direction"), UNIT)
        }
        LightKind::Spot { position, direction, beam_angle, penumbra } => {
            require(is_point(position), || format!("{name}.position"), FINITE)?;
            require(is_unit(direction), || format!("{name}.direction"), UNIT)?;
            let beam = beam_angle > 0.0 && beam_angle <= 360.0;
            require(beam, || format!("{name}.beam_angle"), "above 0 and at most 360 degrees")?;
            let penumbra = (0.0..=beam_angle / 2.0).contains(&penumbra);
            require(penumbra, || format!("{name}.penumbra"), "from 0 to half the beam angle")
        }
    }
}

fn check_texture(map: &TextureMap, name: &str) -> Check {
    require(map.tiling.is_usable(), || format!("{name}.tiling"), "made of finite numbers up to 1e6")
}

fn check_material(material: &Material, name: &str) -> Check {
    require(is_color(material.diffuse, 1.0), || format!("{name}.diffuse"), "from 0 to 1")?;
    require(is_color(material.specular, 1.0), || format!("{name}.specular"), "from 0 to 1")?;
    let emission = is_color(material.emission, MAX_LIGHT);
    require(emission, || format!("{name}.emission"), LIGHT)?;
    let exponent = (0.0..=MAX_EXPONENT).contains(&material.exponent);
    require(exponent, || format!("{name}.exponent"), "from 0 to 1e6")?;
    require(is_color(material.reflect, 1.0), || format!("{name}.reflect"), "from 0 to 1")?;
    require(is_color(material.transmit, 1.0), || format!("{name}.transmit"), "from 0 to 1")?;
    let ior = (1.0 / MAX_IOR..=MAX_IOR).contains(&material.ior);
    require(ior, || format!("{name}.ior"), "from 0.01 to 100")?;
    let absorption = is_color(material.absorption, 1.0) && material.absorption.min_element() > 0.0;
    require(absorption, || format!("{name}.absorption"), "above 0 and at most 1")?;
    if let Some(model) = &material.metallic_roughness {
        for (key, share) in [
            ("metallic", model.metallic),
            ("roughness", model.roughness),
            ("transmission", model.transmission),
            ("specular_factor", model.specular_factor),
        ] {
            require((0.0..=1.0).contains(&share), || format!("{name}.{key}"), "from 0 to 1")?;
        }
    }
    if let Some(Checker { colors, size, .. }) = &material.checker {
        let colors = colors.iter().all(|color| is_color(*color, 1.0));
        require(colors, || format!("{name}.checker"), "of colours from 0 to 1")?;
        let size = f64::from(*size);
        require(is_positive(size), || format!("{name}.checker.size"), "above zero and finite")?;
    }
    let one_source = material.checker.is_none() || material.texture.is_none();
    require(one_source, || format!("{name}.checker"), "without a texture in the same material")?;
    let strength = |map: NormalMap| (0.0..=MAX_NORMAL_STRENGTH).contains(&map.strength);
    let fits = material.normal_map.is_none_or(strength);
    require(fits, || format!("{name}.normal_map.strength"), "from 0 to 100")
}

/// Whether a pixel can have this number of samples: 1, 4, 9, ... 256 with the direct integrator, 1 to 65536 paths.
pub(in crate::scene) fn is_sample_count(integrator: &Integrator, samples: u32) -> bool {
    match integrator {
        Integrator::Direct => {
            let root = samples.isqrt();
            (1..=MAX_SAMPLES).contains(&samples) && root * root == samples
        }
        Integrator::Path(_) => (1..=MAX_PATH_SAMPLES).contains(&samples),
    }
}

fn is_coordinate(value: f64) -> bool {
    value.abs() <= MAX_COORDINATE
}

fn is_positive(value: f64) -> bool {
    value > 0.0 && is_coordinate(value)
}

fn is_point(point: DVec3) -> bool {
    point.to_array().into_iter().all(is_coordinate)
}

fn is_unit(direction: DVec3) -> bool {
    (direction.length_squared() - 1.0).abs() <= 16.0 * f64::EPSILON
}

fn is_color(color: Vec3, limit: f32) -> bool {
    color.to_array().iter().all(|c| (0.0..=limit).contains(c))
}

#[cfg(test)]
mod tests;
