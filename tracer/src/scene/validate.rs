//! Checks of a scene that comes from elsewhere: every index in range, every number finite and inside its bounds,
//! every list bounded. A scene that passes can be compiled and traced without further questions.

use std::collections::BTreeSet;

use glam::{DVec3, Vec3};

use super::{
    Attenuation, Background, Camera, FrameView, Light, LightKind, Material, Model, RenderSettings, Scene,
};
use crate::image::MAX_SIDE;
use crate::mesh::MeshId;

/// Lights of a scene.
pub const MAX_LIGHTS: usize = 4096;
/// Materials of a scene, those of its models' files included.
pub const MAX_MATERIALS: usize = 1 << 18;
/// Instances of meshes in a scene.
pub const MAX_MODELS: usize = 1 << 16;
/// Spheres of a scene.
pub const MAX_SPHERES: usize = 1 << 20;
/// Infinite planes of a scene; every ray meets all of them.
pub const MAX_PLANES: usize = 1024;
/// Single triangles of a scene; more belong into a model.
pub const MAX_TRIANGLES: usize = 1 << 20;
/// Material slots of one model.
pub const MAX_SLOTS: usize = 1 << 16;
/// Rays per pixel.
pub const MAX_SAMPLES: u32 = 256;
/// Bounces of a ray.
pub const MAX_DEPTH: u32 = 64;
/// Magnitude of a coordinate, radius, scale factor or degree: its square and their products stay finite in `f64`.
pub const MAX_COORDINATE: f64 = 1e30;
/// A light's intensity and colour: finite in `f32` after they are multiplied with a scene's attenuation.
pub const MAX_LIGHT: f32 = 1e30;
/// The Phong exponent.
pub const MAX_EXPONENT: f32 = 1e6;

/// Why a scene cannot be drawn.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ValidateError {
    /// A list is longer than allowed.
    #[error("the scene has {count} {what}; {limit} are allowed")]
    TooMany {
        /// What is listed.
        what: &'static str,
        /// How many there are.
        count: usize,
        /// How many there may be.
        limit: usize,
    },
    /// A number is not what it must be.
    #[error("{what} must be {expected}")]
    Unfit {
        /// The number, as a path into the scene.
        what: String,
        /// What it must be.
        expected: &'static str,
    },
    /// A material that is not there.
    #[error("{what} names material {index}, but the scene has {count}")]
    NoSuchMaterial {
        /// Who names it.
        what: String,
        /// The index named.
        index: u32,
        /// Materials of the scene.
        count: usize,
    },
}

type Check = Result<(), ValidateError>;

impl Scene {
    /// The compiled meshes that the scene shows.
    pub fn mesh_ids(&self) -> BTreeSet<MeshId> {
        self.models.iter().map(|model| model.mesh).collect()
    }

    /// Checks a scene that was not made by this program's loader, such as one from the wire.
    ///
    /// # Errors
    /// The first list that is too long, number that is out of bounds, or index that points nowhere.
    pub fn validate(&self) -> Result<(), ValidateError> {
        self.check_counts()?;
        require(is_color(self.ambient, MAX_LIGHT), || "ambient".into(), "finite and not negative")?;
        check_render(&self.render)?;
        check_camera(&self.camera)?;
        check_background(&self.background)?;
        each("lights", &self.lights, check_light)?;
        each("materials", &self.materials, check_material)?;
        each("models", &self.models, |model, name| self.check_model(model, name))?;
        each("spheres", &self.spheres, |sphere, name| {
            require(is_point(sphere.center), || format!("{name}.center"), FINITE)?;
            require(is_positive(sphere.radius), || format!("{name}.radius"), "above zero and finite")?;
            self.check_material_index(sphere.material, name)
        })?;
        each("planes", &self.planes, |plane, name| {
            require(is_point(plane.point), || format!("{name}.point"), FINITE)?;
            require(is_unit(plane.normal), || format!("{name}.normal"), UNIT)?;
            self.check_material_index(plane.material, name)
        })?;
        each("triangles", &self.triangles, |triangle, name| {
            let finite = triangle.vertices.iter().all(|v| is_point(*v));
            require(finite, || format!("{name}.vertices"), FINITE)?;
            self.check_material_index(triangle.material, name)
        })
    }

    fn check_counts(&self) -> Check {
        for (what, count, limit) in [
            ("lights", self.lights.len(), MAX_LIGHTS),
            ("materials", self.materials.len(), MAX_MATERIALS),
            ("models", self.models.len(), MAX_MODELS),
            ("spheres", self.spheres.len(), MAX_SPHERES),
            ("planes", self.planes.len(), MAX_PLANES),
            ("single triangles", self.triangles.len(), MAX_TRIANGLES),
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
        require(scale, || format!("{name}.scale"), "finite and not zero along any axis")
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
    /// Checks what is to be drawn of a scene, when it comes from the wire.
    ///
    /// # Errors
    /// A camera that sees nothing, a size or number of samples out of bounds.
    pub fn validate(&self) -> Result<(), ValidateError> {
        check_camera(&self.camera)?;
        check_size(self.width, self.height, self.samples)?;
        require(is_coordinate(self.spin), || "spin".into(), FINITE)
    }
}

const FINITE: &str = "finite and at most 1e30 in magnitude";
const UNIT: &str = "of unit length";

fn require(holds: bool, what: impl FnOnce() -> String, expected: &'static str) -> Check {
    if holds { Ok(()) } else { Err(ValidateError::Unfit { what: what(), expected }) }
}

fn each<T>(list: &str, items: &[T], check: impl Fn(&T, &str) -> Check) -> Check {
    items.iter().enumerate().try_for_each(|(i, item)| check(item, &format!("{list}[{i}]")))
}

fn check_render(render: &RenderSettings) -> Check {
    check_size(render.width, render.height, render.samples)?;
    require(render.max_depth <= MAX_DEPTH, || "render.max_depth".into(), "at most 64")?;
    let share = (0.0..=1.0).contains(&render.min_contribution);
    require(share, || "render.min_contribution".into(), "from 0 to 1")
}

fn check_size(width: u32, height: u32, samples: u32) -> Check {
    let fits = |side| (1..=MAX_SIDE).contains(&side);
    require(fits(width), || "width".into(), "from 1 to 16384 pixels")?;
    require(fits(height), || "height".into(), "from 1 to 16384 pixels")?;
    require(is_sample_count(samples), || "samples".into(), "a square number from 1 to 256")
}

fn check_camera(camera: &Camera) -> Check {
    require(is_point(camera.position), || "camera.position".into(), FINITE)?;
    require(is_point(camera.look_at), || "camera.look_at".into(), FINITE)?;
    require(is_point(camera.up), || "camera.up".into(), FINITE)?;
    require(camera.fov > 0.0 && camera.fov < 180.0, || "camera.fov".into(), "above 0 and below 180 degrees")?;
    require(is_positive(camera.zoom), || "camera.zoom".into(), "above zero and finite")?;
    let fault = view_fault(camera.look_at - camera.position, camera.up);
    require(fault.is_none(), || "camera".into(), fault.unwrap_or_default())
}

/// What is wrong with a camera that looks along `direction`, both of any length.
pub(super) fn view_fault(direction: DVec3, up: DVec3) -> Option<&'static str> {
    let (Some(direction), Some(up)) = (direction.try_normalize(), up.try_normalize()) else {
        return Some("somewhere else than what it looks at, with an `up` that is not zero");
    };
    // The cross product of two parallel unit vectors is zero up to a few roundings.
    let parallel = direction.cross(up).length() <= 8.0 * f64::EPSILON;
    parallel.then_some("turned so that `up` is not parallel to the view direction")
}

fn check_background(background: &Background) -> Check {
    let fits = match background {
        Background::Color(color) => is_color(*color, 1.0),
        Background::Gradient { bottom, top } => is_color(*bottom, 1.0) && is_color(*top, 1.0),
    };
    require(fits, || "background".into(), "from 0 to 1 in every channel")
}

fn check_light(light: &Light, name: &str) -> Check {
    let color = is_color(light.color, MAX_LIGHT);
    require(color, || format!("{name}.color"), "finite, not negative, at most 1e30")?;
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

fn check_material(material: &Material, name: &str) -> Check {
    require(is_color(material.diffuse, 1.0), || format!("{name}.diffuse"), "from 0 to 1")?;
    require(is_color(material.specular, 1.0), || format!("{name}.specular"), "from 0 to 1")?;
    let exponent = (0.0..=MAX_EXPONENT).contains(&material.exponent);
    require(exponent, || format!("{name}.exponent"), "from 0 to 1e6")
}

/// Whether a pixel can be divided into that many samples: 1, 4, 9, ... 256.
pub(super) fn is_sample_count(samples: u32) -> bool {
    let root = samples.isqrt();
    (1..=MAX_SAMPLES).contains(&samples) && root * root == samples
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
mod tests {
    use super::super::{NormalMode, Plane, Sphere, Triangle};
    use super::*;

    fn scene() -> Scene {
        let direction = DVec3::NEG_Y;
        let light = |kind| Light {
            kind,
            color: Vec3::ONE,
            attenuation: Attenuation::Polynomial { constant: 1.0, linear: 0.0, quadratic: 0.5 },
            shadows: true,
        };
        let position = DVec3::splat(3.0);
        Scene {
            ambient: Vec3::splat(0.1),
            render: RenderSettings::default(),
            camera: Camera { position: DVec3::Z, look_at: DVec3::ZERO, up: DVec3::Y, fov: 40.0, zoom: 1.0 },
            background: Background::Gradient { bottom: Vec3::ZERO, top: Vec3::ONE },
            lights: vec![
                light(LightKind::Point { position }),
                light(LightKind::Spot { position, direction, beam_angle: 40.0, penumbra: 20.0 }),
                light(LightKind::Directional { direction }),
            ],
            materials: vec![Material::NEUTRAL; 2],
            models: vec![Model {
                mesh: MeshId([7; 32]),
                materials: vec![0, 1],
                normals: NormalMode::Smooth,
                translate: DVec3::ZERO,
                rotate: DVec3::ZERO,
                scale: DVec3::new(1.0, -2.0, 3.0),
            }],
            spheres: vec![Sphere { center: DVec3::ZERO, radius: 1.0, material: 0 }],
            planes: vec![Plane { point: DVec3::ZERO, normal: DVec3::Y, material: 1 }],
            triangles: vec![Triangle { vertices: [DVec3::X, DVec3::Y, DVec3::Z], material: 1 }],
        }
    }

    fn spoiled(spoil: impl FnOnce(&mut Scene)) -> String {
        let mut scene = scene();
        spoil(&mut scene);
        scene.validate().unwrap_err().to_string()
    }

    #[test]
    fn a_sound_scene_passes_and_names_its_meshes() {
        assert_eq!(scene().validate(), Ok(()));
        assert_eq!(scene().mesh_ids(), BTreeSet::from([MeshId([7; 32])]));
        assert_eq!(FrameView::of(&scene()).validate(), Ok(()));
    }

    #[test]
    fn indices_that_point_nowhere_are_found() {
        assert_eq!(
            spoiled(|s| s.spheres[0].material = 2),
            "spheres[0] names material 2, but the scene has 2"
        );
        assert!(spoiled(|s| s.planes[0].material = u32::MAX).starts_with("planes[0] names material"));
        assert!(spoiled(|s| s.triangles[0].material = 9).starts_with("triangles[0] names material 9"));
        assert!(spoiled(|s| s.models[0].materials[1] = 5).starts_with("models[0] names material 5"));
    }

    #[test]
    fn numbers_out_of_bounds_are_found_by_name() {
        type Spoil = fn(&mut Scene);
        let cases: [(Spoil, &str); 22] = [
            (|s| s.ambient.x = f32::NAN, "ambient"),
            (|s| s.render.width = 0, "width"),
            (|s| s.render.height = 16_385, "height"),
            (|s| s.render.samples = 8, "samples"),
            (|s| s.render.max_depth = 65, "max_depth"),
            (|s| s.render.min_contribution = -0.1, "min_contribution"),
            (|s| s.camera.position.x = f64::INFINITY, "camera.position"),
            (|s| s.camera.fov = 180.0, "camera.fov"),
            (|s| s.camera.zoom = 0.0, "camera.zoom"),
            (|s| s.camera.look_at = s.camera.position, "somewhere else"),
            (|s| s.camera.up = DVec3::Z * 5.0, "parallel"),
            (|s| s.background = Background::Color(Vec3::splat(2.0)), "background"),
            (|s| s.lights[0].color.y = -1.0, "lights[0].color"),
            (|s| s.lights[1].kind = LightKind::Directional { direction: DVec3::ONE }, "lights[1].direction"),
            (|s| s.lights[2].kind = LightKind::Point { position: DVec3::NAN }, "lights[2].position"),
            (|s| s.materials[1].exponent = f32::INFINITY, "materials[1].exponent"),
            (|s| s.materials[0].diffuse.z = 1.5, "materials[0].diffuse"),
            (|s| s.models[0].scale.y = 0.0, "models[0].scale"),
            (|s| s.models[0].rotate.y = f64::NAN, "models[0].rotate"),
            (|s| s.spheres[0].radius = -1.0, "spheres[0].radius"),
            (|s| s.planes[0].normal = DVec3::ZERO, "planes[0].normal"),
            (|s| s.triangles[0].vertices[2].y = 1e31, "triangles[0].vertices"),
        ];
        for (spoil, name) in cases {
            let message = spoiled(spoil);
            assert!(message.contains(name), "{message} / {name}");
        }
    }

    #[test]
    fn attenuations_that_divide_by_zero_are_found() {
        let message = spoiled(|s| {
            s.lights[0].attenuation = Attenuation::Polynomial { constant: 0.0, linear: 0.0, quadratic: 0.0 };
        });
        assert!(message.contains("lights[0].attenuation"), "{message}");
    }

    #[test]
    fn lists_are_bounded() {
        let message = spoiled(|s| s.planes = vec![s.planes[0]; MAX_PLANES + 1]);
        assert_eq!(message, "the scene has 1025 planes; 1024 are allowed");
        let message = spoiled(|s| s.lights = vec![s.lights[0]; MAX_LIGHTS + 1]);
        assert!(message.contains("4097 lights"), "{message}");
    }

    #[test]
    fn cameras_are_refused_only_when_up_is_truly_parallel() {
        assert_eq!(view_fault(DVec3::new(1e-9, -1.0, 0.0), DVec3::Y), None);
        assert!(view_fault(DVec3::new(0.1, 0.7, -0.3) * 1e-20, DVec3::new(-0.1, -0.7, 0.3) * 1e20).is_some());
    }

    #[test]
    fn frames_from_the_wire_are_checked() {
        let mut view = FrameView::of(&scene());
        view.spin = f64::NAN;
        assert!(view.validate().unwrap_err().to_string().starts_with("spin"));
        view = FrameView { width: 0, ..FrameView::of(&scene()) };
        assert!(view.validate().unwrap_err().to_string().contains("1 to 16384"));
    }
}
