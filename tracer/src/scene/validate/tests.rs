use glam::{DMat3, Vec2};

use super::*;
use crate::material::CheckerSpace;
use crate::material::MetallicRoughness;
use crate::scene::data::{Disk, Motion, NormalMode, PathSettings, Plane, Sky, Sphere};
use crate::texture::Filter;

fn scene() -> Scene {
    let direction = DVec3::NEG_Y;
    let light = |kind| Light {
        kind,
        color: Vec3::ONE,
        attenuation: Attenuation::Polynomial { constant: 1.0, linear: 0.0, quadratic: 0.5 },
        shadows: true,
        radius: 0.0,
        shadow_samples: None,
    };
    let position = DVec3::splat(3.0);
    Scene {
        ambient: Vec3::splat(0.1),
        render: RenderSettings::default(),
        camera: Camera {
            position: DVec3::Z,
            look_at: DVec3::ZERO,
            up: DVec3::Y,
            fov: 40.0,
            zoom: 1.0,
            kind: crate::scene::CameraKind::PINHOLE,
        },
        background: Background::Gradient { bottom: Vec3::ZERO, top: Vec3::ONE },
        lights: vec![
            light(LightKind::Point { position }),
            light(LightKind::Spot { position, direction, beam_angle: 40.0, penumbra: 20.0 }),
            light(LightKind::Directional { direction }),
        ],
        materials: vec![Material::NEUTRAL; 2],
        textures: vec![],
        models: vec![Model {
            mesh: MeshId([7; 32]),
            materials: vec![0, 1],
            normals: NormalMode::Smooth,
            translate: DVec3::ZERO,
            rotate: DVec3::ZERO,
            scale: DVec3::new(1.0, -2.0, 3.0),
            group: DMat3::IDENTITY,
        }],
        spheres: vec![Sphere {
            center: DVec3::ZERO,
            radius: 1.0,
            material: 0,
            inside_out: false,
            uv_rotate: DVec3::ZERO,
        }],
        planes: vec![Plane { point: DVec3::ZERO, normal: DVec3::Y, material: 1, size: 1.0 }],
        triangles: vec![Triangle { vertices: [DVec3::X, DVec3::Y, DVec3::Z], uvs: None, material: 1 }],
        disks: vec![Disk { center: DVec3::ZERO, normal: DVec3::Z, radius: 2.0, material: 0 }],
        background_visible: true,
        ..Scene::default()
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
    assert_eq!(spoiled(|s| s.spheres[0].material = 2), "spheres[0] names material 2, but the scene has 2");
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
        (|s| s.render.quality.max_depth = 65, "max_depth"),
        (|s| s.render.quality.min_contribution = -0.1, "min_contribution"),
        (|s| s.camera.position.x = f64::INFINITY, "camera.position"),
        (|s| s.camera.fov = 180.0, "camera.fov"),
        (|s| s.camera.zoom = 0.0, "camera.zoom"),
        (|s| s.camera.look_at = s.camera.position, "somewhere else"),
        (|s| s.camera.up = DVec3::Z * 5.0, "parallel"),
        (|s| s.background = Background::Color(Vec3::splat(-2.0)), "background"),
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
fn textures_are_listed_and_laid_on_what_has_coordinates() {
    let textured = |s: &mut Scene| {
        s.textures = vec![TextureMap::new(TextureId([3; 32]), Filter::Nearest)];
        s.materials.push(Material { texture: Some(0), ..Material::NEUTRAL });
    };
    let mut sound = scene();
    textured(&mut sound);
    (sound.triangles[0].material, sound.triangles[0].uvs) = (2, Some([Vec2::ZERO; 3]));
    sound.models[0].materials[0] = 2;
    assert_eq!(sound.validate(), Ok(()));
    assert_eq!(sound.texture_ids(), BTreeSet::from([TextureId([3; 32])]));

    for spoil in [
        (|s: &mut Scene| s.materials[1].texture = Some(0)) as fn(&mut Scene),
        |s| s.materials[1].cutout = Some(0),
        |s| s.materials[1].emission_texture = Some(0),
    ] {
        assert_eq!(spoiled(spoil), "materials[1].texture must be one of the scene's textures");
    }
    let message = spoiled(|s| s.materials[1].emission.y = f32::INFINITY);
    assert_eq!(message, "materials[1].emission must be finite, not negative, at most 1e30");
    let message = spoiled(|s| {
        textured(s);
        s.textures[0].tiling.offset.x = f32::NAN;
    });
    assert_eq!(message, "textures[0].tiling must be made of finite numbers up to 1e6");
    // Spheres and planes have texture coordinates of their own.
    (sound.spheres[0].material, sound.planes[0].material) = (2, 2);
    assert_eq!(sound.validate(), Ok(()));
    type Spoil = fn(&mut Scene);
    let cases: [(Spoil, &str); 3] = [
        (|s| s.disks[0].material = 2, "disks[0].material must be without a texture"),
        (|s| s.triangles[0].material = 2, "triangles[0].material must be without a texture"),
        (|s| s.triangles[0].uvs = Some([Vec2::NAN; 3]), "triangles[0].uvs must be finite"),
    ];
    for (spoil, expected) in cases {
        let message = spoiled(|s| {
            textured(s);
            spoil(s);
        });
        assert!(message.starts_with(expected), "{message}");
    }
}

#[test]
fn numbers_of_bounces_skies_and_shapes_are_bounded() {
    type Spoil = fn(&mut Scene);
    let cases: [(Spoil, &str); 17] = [
        (|s| s.materials[0].reflect.x = 1.5, "materials[0].reflect must be from 0 to 1"),
        (|s| s.materials[0].transmit.y = -0.5, "materials[0].transmit must be from 0 to 1"),
        (|s| s.materials[0].ior = 0.0, "materials[0].ior must be from 0.01 to 100"),
        (|s| s.materials[0].ior = f32::NAN, "materials[0].ior"),
        (|s| s.materials[0].absorption.z = 0.0, "materials[0].absorption must be above 0 and at most 1"),
        (|s| s.lights[0].radius = -1.0, "lights[0].radius must be not negative"),
        (|s| s.lights[0].radius = f64::INFINITY, "lights[0].radius"),
        (|s| s.lights[1].shadow_samples = Some(0), "lights[1].shadow_samples must be from 1 to 1024"),
        (|s| s.lights[1].shadow_samples = Some(1025), "lights[1].shadow_samples"),
        (|s| s.render.quality.shadow_samples = 0, "shadow_samples must be from 1 to 1024"),
        (
            |s| s.camera.kind = CameraKind::Orthographic { view_height: 0.0 },
            "camera.view_height must be above zero",
        ),
        (
            |s| (s.camera.kind, s.camera.fov) = (CameraKind::Fisheye, 361.0),
            "camera.fov must be above 0 and at most 360",
        ),
        (|s| s.disks[0].radius = 0.0, "disks[0].radius"),
        (|s| s.disks[0].normal = DVec3::ONE, "disks[0].normal must be of unit length"),
        (|s| s.planes[0].size = 0.0, "planes[0].size"),
        (|s| s.spheres[0].uv_rotate.x = f64::NAN, "spheres[0].uv_rotate"),
        (|s| s.models[0].group.x_axis = DVec3::ZERO, "models[0].group must be finite and invertible"),
    ];
    for (spoil, expected) in cases {
        let message = spoiled(spoil);
        assert!(message.starts_with(expected), "{message} / {expected}");
    }
    let sky = |picture, rotate, strength| Background::Sky(Sky { picture, rotate, strength });
    for (background, expected) in [
        (sky(SkyPicture::Panorama(0), 0.0, 1.0), "background.picture must be made of the scene's textures"),
        (sky(SkyPicture::Cubemap([0; 6]), 0.0, 1.0), "background.picture"),
        (sky(SkyPicture::Panorama(0), f64::NAN, 1.0), "background.rotate"),
        (sky(SkyPicture::Panorama(0), 0.0, -1.0), "background.strength"),
    ] {
        assert!(spoiled(|s| s.background = background).starts_with(expected), "{expected}");
    }
}

#[test]
fn patterns_are_bounded_and_laid_on_what_has_coordinates() {
    let checker = |space| Checker { colors: [Vec3::ZERO, Vec3::ONE], size: 0.5, space };
    let laid = |s: &mut Scene, space| s.materials[0].checker = Some(checker(space));
    for space in [CheckerSpace::Object, CheckerSpace::World] {
        let mut sound = scene();
        laid(&mut sound, space);
        assert_eq!(sound.validate(), Ok(()));
    }
    let message = spoiled(|s| laid(s, CheckerSpace::Uv));
    assert!(message.starts_with("disks[0].material must be without a texture or a pattern"), "{message}");
    for (size, color) in [(0.0, 1.0), (f32::NAN, 1.0), (f32::INFINITY, 1.0), (1.0, 1.5), (1.0, f32::NAN)] {
        let pattern = Checker { size, colors: [Vec3::ZERO, Vec3::splat(color)], space: CheckerSpace::World };
        let message = spoiled(|s| s.materials[1].checker = Some(pattern));
        assert!(message.starts_with("materials[1].checker"), "{message}");
    }
    let message = spoiled(|s| {
        laid(s, CheckerSpace::World);
        s.materials[0].texture = Some(0);
    });
    assert_eq!(message, "materials[0].checker must be without a texture in the same material");
    let message = spoiled(|s| s.materials[1].normal_map = Some(NormalMap { texture: 0, strength: 1.0 }));
    assert_eq!(message, "materials[1].texture must be one of the scene's textures");
    let message = spoiled(|s| s.materials[1].normal_map = Some(NormalMap { texture: 0, strength: 101.0 }));
    assert_eq!(message, "materials[1].normal_map.strength must be from 0 to 100");
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

fn paths(change: impl FnOnce(&mut PathSettings)) -> Integrator {
    let mut settings = PathSettings::DEFAULT;
    change(&mut settings);
    Integrator::Path(settings)
}

#[test]
fn samples_are_counted_by_the_integrator() {
    for (samples, direct, path) in [
        (0, false, false),
        (1, true, true),
        (2, false, true),
        (256, true, true),
        (289, false, true),
        (65_536, false, true),
        (65_537, false, false),
    ] {
        assert_eq!(is_sample_count(&Integrator::Direct, samples), direct, "{samples}");
        assert_eq!(is_sample_count(&paths(|_| ()), samples), path, "{samples}");
        let view = FrameView { integrator: paths(|_| ()), samples, ..FrameView::of(&scene()) };
        assert_eq!(view.validate().is_ok(), path, "{samples}");
    }
}

#[test]
fn numbers_of_paths_lenses_and_tone_are_bounded() {
    type Spoil = fn(&mut Scene);
    let cases: [(Spoil, &str); 11] = [
        (
            |s| s.render.integrator = paths(|p| p.clamp_indirect = -1.0),
            "clamp_indirect must be from 0 to 1e6",
        ),
        (|s| s.render.integrator = paths(|p| p.clamp_indirect = f32::NAN), "clamp_indirect"),
        (|s| s.render.integrator = paths(|p| p.max_noise = 1.5), "max_noise must be from 0 to 1"),
        (|s| s.render.integrator = paths(|p| p.max_noise = f32::NAN), "max_noise"),
        (|s| s.render.tone.exposure = 65.0, "exposure must be from -64 to 64 stops"),
        (|s| s.render.tone.exposure = f32::NAN, "exposure"),
        (|s| s.lens.aperture = -1.0, "aperture must be not negative"),
        (|s| s.lens.aperture = f64::NAN, "aperture"),
        (|s| s.lens.aperture = f64::INFINITY, "aperture"),
        (|s| s.lens.focus_distance = Some(0.0), "focus_distance must be above zero"),
        (|s| s.lens.focus_distance = Some(f64::NAN), "focus_distance"),
    ];
    for (spoil, expected) in cases {
        let message = spoiled(spoil);
        assert!(message.starts_with(expected), "{message} / {expected}");
        let mut spoiled = scene();
        spoil(&mut spoiled);
        let of_view = FrameView::of(&spoiled).validate().unwrap_err().to_string();
        assert_eq!(of_view, message, "a view is checked as its scene is");
    }
}

#[test]
fn shares_of_metallic_roughness_are_bounded() {
    let sound = MetallicRoughness {
        metallic: 1.0,
        roughness: 0.0,
        transmission: 1.0,
        specular_factor: 0.0,
        texture: None,
    };
    let with = |model| spoiled(|s| s.materials[1].metallic_roughness = Some(model));
    for bad in [-0.5, 1.5, f32::NAN, f32::INFINITY] {
        for (model, key) in [
            (MetallicRoughness { metallic: bad, ..sound }, "metallic"),
            (MetallicRoughness { roughness: bad, ..sound }, "roughness"),
            (MetallicRoughness { transmission: bad, ..sound }, "transmission"),
            (MetallicRoughness { specular_factor: bad, ..sound }, "specular_factor"),
        ] {
            assert_eq!(with(model), format!("materials[1].{key} must be from 0 to 1"));
        }
    }
    let message = with(MetallicRoughness { texture: Some(0), ..sound });
    assert_eq!(message, "materials[1].texture must be one of the scene's textures");
    let mut scene = scene();
    scene.materials[1].metallic_roughness = Some(sound);
    assert_eq!(scene.validate(), Ok(()));
}

#[test]
fn passes_and_formats_are_those_of_the_integrator() {
    let direct = FrameView::of(&scene());
    let path = FrameView { integrator: paths(|_| ()), samples: 16, first_sample: 32, ..direct };
    let sums = FrameView { format: PixelFormat::Sums, ..path };
    let linear = FrameView { format: PixelFormat::Linear, ..direct };
    for view in [path, sums, linear, FrameView { first_sample: 65_520, ..path }] {
        assert_eq!(view.validate(), Ok(()), "{view:?}");
    }
    let goal = paths(|p| p.max_noise = 0.1);
    let whole = FrameView { integrator: goal, first_sample: 0, ..path };
    assert_eq!(whole.validate(), Ok(()));
    for (view, expected) in [
        (FrameView { first_sample: 1, ..direct }, "first_sample must be 0 with the direct integrator"),
        (FrameView { format: PixelFormat::Sums, ..direct }, "format must be bytes or linear"),
        (FrameView { first_sample: 65_521, ..path }, "first_sample must be at most 65536 less"),
        (FrameView { first_sample: u32::MAX, ..path }, "first_sample must be at most 65536 less"),
        (FrameView { integrator: goal, ..path }, "max_noise must be 0 for a pass"),
        (FrameView { integrator: goal, first_sample: 0, ..sums }, "max_noise must be 0 for a pass"),
    ] {
        let message = view.validate().unwrap_err().to_string();
        assert!(message.starts_with(expected), "{message} / {expected}");
    }
}

#[test]
fn volumes_out_of_bounds_are_found_by_name() {
    let volume = |boundary| Volume { boundary, density: 1.0, color: Vec3::ONE };
    let ball = |radius| VolumeBoundary::Sphere { center: DVec3::ZERO, radius };
    let with = |volume: Volume| spoiled(|s| s.volumes = vec![volume]);
    let mut sound = scene();
    sound.volumes = vec![volume(ball(1.0)); MAX_VOLUMES];
    assert_eq!(sound.validate(), Ok(()));
    sound.volumes.push(volume(ball(1.0)));
    assert!(sound.validate().unwrap_err().to_string().contains("65 volumes; 64 are allowed"));
    assert!(with(volume(ball(0.0))).starts_with("volumes[0].radius"));
    assert!(with(Volume { density: -1.0, ..volume(ball(1.0)) }).starts_with("volumes[0].density"));
    assert!(with(Volume { density: f64::NAN, ..volume(ball(1.0)) }).starts_with("volumes[0].density"));
    assert!(with(Volume { color: Vec3::splat(1.5), ..volume(ball(1.0)) }).starts_with("volumes[0].color"));
    let flat = VolumeBoundary::Box { lower: DVec3::ZERO, upper: DVec3::new(1.0, 0.0, 1.0) };
    assert!(with(volume(flat)).starts_with("volumes[0].box"));
    let bare = Model { materials: Vec::new(), ..scene().models[0].clone() };
    sound.volumes = vec![volume(VolumeBoundary::Model(Model { mesh: MeshId([8; 32]), ..bare.clone() }))];
    assert_eq!(sound.validate(), Ok(()));
    assert_eq!(sound.mesh_ids(), BTreeSet::from([MeshId([7; 32]), MeshId([8; 32])]));
    let seen = Model { materials: vec![0], ..bare.clone() };
    assert!(with(volume(VolumeBoundary::Model(seen))).starts_with("volumes[0].model.materials"));
    let flat = Model { scale: DVec3::ZERO, ..bare };
    assert!(with(volume(VolumeBoundary::Model(flat))).starts_with("volumes[0].model.scale"));
}

#[test]
fn motions_are_of_different_objects_that_emit_nothing() {
    let (translate, rotate, center) = (DVec3::X, DVec3::Y, DVec3::Z);
    let of_sphere = Motion::Sphere { sphere: 0, center };
    let of_model = Motion::Model { model: 0, translate, rotate };
    let mut sound = scene();
    sound.motions = vec![of_sphere, of_model];
    assert_eq!(sound.validate(), Ok(()));
    let fault = |spoil: fn(&mut Scene)| {
        let mut scene = sound.clone();
        spoil(&mut scene);
        scene.validate().unwrap_err().to_string()
    };
    assert!(fault(|s| s.motions.push(s.motions[0])).contains("3 moving objects; 2 are allowed"));
    assert!(
        fault(|s| s.motions[1] = s.motions[0]).contains("motions[1] must be of an object without another")
    );
    for (motion, what) in [
        (Motion::Sphere { sphere: 1, center }, "motions[0] must be of one of the scene's spheres"),
        (
            Motion::Model { model: u32::MAX, translate, rotate },
            "motions[0] must be of one of the scene's models",
        ),
        (Motion::Sphere { sphere: 0, center: DVec3::splat(1e31) }, "motions[0].center must be finite"),
        (Motion::Model { model: 0, translate: DVec3::NAN, rotate }, "motions[0].translate must be finite"),
        (Motion::Model { model: 0, translate, rotate: DVec3::INFINITY }, "motions[0].rotate must be finite"),
    ] {
        let message = Scene { motions: vec![motion], ..scene() }.validate().unwrap_err().to_string();
        assert!(message.starts_with(what), "{message}");
    }
    let emitting = |s: &mut Scene| s.materials[0].emission = Vec3::X;
    assert!(
        fault(emitting).starts_with("spheres[0] must be of materials without emission, because it moves")
    );
    assert!(
        fault(|s| s.materials[1].emission = Vec3::X).starts_with("models[0] must be of materials without")
    );
    let stretched = |s: &mut Scene| s.models[0].group = DMat3::from_diagonal(DVec3::new(1.0, 2.0, 1.0));
    assert!(fault(stretched).starts_with("models[0].group must be one that scales all axes by one factor"));
    let mirrored = |s: &mut Scene| s.models[0].group = DMat3::from_diagonal(DVec3::new(-3.0, 3.0, 3.0));
    mirrored(&mut sound);
    assert_eq!(sound.validate(), Ok(()));
}
