//! What the keys of a scene file become once its files are loaded: skies, normal maps, patterns, groups, glass.

use super::*;
use crate::scene::{Background, CameraKind, FrameView, SkyPicture};

fn picture(folder: &Folder, name: &str, width: u32, height: u32) {
    let pixels = vec![200; (3 * width * height) as usize];
    image::save(&folder.path(name), &RgbImage { width, height, pixels }).unwrap();
}

fn folder(scene: &str) -> Folder {
    Folder::with(&[("s.toml", &format!("{CAMERA}{scene}"))])
}

const BALL: &str = "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n";

#[test]
fn panoramas_and_cube_maps_become_textures_of_the_scene() {
    let panorama = folder(&format!(
        "[background]\npanorama = \"sky.png\"\nrotate = 30\nstrength = 2\nvisible = false\n{BALL}"
    ));
    picture(&panorama, "sky.png", 4, 2);
    let LoadedScene { scene, textures, warnings, .. } = panorama.load("s.toml");
    assert_eq!(warnings, [""; 0]);
    let Background::Sky(sky) = scene.background else { panic!("a sky") };
    assert_eq!((sky.picture, sky.rotate, sky.strength), (SkyPicture::Panorama(0), 30.0, 2.0));
    assert!(!scene.background_visible);
    assert_eq!((textures.len(), textures[0].id()), (1, scene.textures[0].texture));

    let files = ["px", "nx", "py", "ny", "px", "nz"].map(|face| format!("\"{face}.png\""));
    let cube = folder(&format!("[background]\ncubemap = [{}]\n{BALL}", files.join(", ")));
    for (index, face) in ["px", "nx", "py", "ny", "nz"].into_iter().enumerate() {
        let pixels = vec![10 * index as u8; 3 * 9];
        image::save(&cube.path(&format!("{face}.png")), &RgbImage { width: 3, height: 3, pixels }).unwrap();
    }
    let LoadedScene { scene, textures, .. } = cube.load("s.toml");
    let Background::Sky(sky) = scene.background else { panic!("a sky") };
    // One picture may be several faces.
    assert_eq!((sky.picture, sky.strength), (SkyPicture::Cubemap([0, 1, 2, 3, 0, 4]), 1.0));
    assert!(scene.background_visible && textures.len() == 5);
}

#[test]
fn pictures_that_are_no_skies_are_refused_at_their_names() {
    let six = "[\"a.png\", \"a.png\", \"b.png\", \"a.png\", \"a.png\", \"a.png\"]";
    let cube = folder(&format!("[background]\ncubemap = {six}\n{BALL}"));
    picture(&cube, "a.png", 2, 2);
    picture(&cube, "b.png", 3, 3);
    assert_eq!(
        cube.refusal("s.toml"),
        "s.toml:5:30: this face of the cube map has 3 x 3 pixels, but must be 2 x 2, as the first one"
    );
    picture(&cube, "b.png", 2, 1);
    assert_eq!(
        cube.refusal("s.toml"),
        "s.toml:5:30: this face of the cube map has 2 x 1 pixels, but must be square"
    );
    picture(&cube, "a.png", 4, 2);
    assert!(cube.refusal("s.toml").starts_with("s.toml:5:12: this face of the cube map has 4 x 2 pixels"));
    let missing = folder(&format!("[background]\npanorama = \"none.hdr\"\n{BALL}")).refusal("s.toml");
    assert!(
        missing.starts_with("s.toml:5:12: the picture of the background: cannot read none.hdr"),
        "{missing}"
    );
}

#[test]
fn textures_and_normal_maps_of_primitives_are_loaded() {
    let scene = "[material.a]\ndiffuse = { texture = \"a.png\" }\n\
                 normal_map = { texture = \"n.png\", strength = 0.5, wrap = \"clamp\" }\n\
                 [material.b]\ndiffuse = { texture = \"a.png\", filter = \"nearest\" }\n\
                 [material.unused]\nnormal_map = { texture = \"none.png\" }\n\
                 [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"a\"\n\
                 [[plane]]\npoint = [0, 0, 0]\nnormal = [0, 1, 0]\nmaterial = \"b\"\nsize = 2\n";
    let folder = folder(scene);
    picture(&folder, "a.png", 2, 2);
    picture(&folder, "n.png", 3, 3);
    let LoadedScene { scene, textures, warnings, .. } = folder.load("s.toml");
    assert_eq!((textures.len(), scene.textures.len(), warnings), (2, 3, Vec::new()));
    let sphere = scene.materials[scene.spheres[0].material as usize];
    let map = sphere.normal_map.unwrap();
    assert_eq!(map.strength, 0.5);
    assert_eq!(scene.textures[map.texture as usize].tiling.wrap, Wrap::Clamp);
    assert!(sphere.texture.is_some_and(|texture| texture != map.texture));
    let plane = scene.materials[scene.planes[0].material as usize];
    assert_eq!(scene.textures[plane.texture.unwrap() as usize].filter, Filter::Nearest);
    std::fs::remove_file(folder.path("n.png")).unwrap();
    let message = folder.refusal("s.toml");
    assert!(message.starts_with("s.toml:6:26: the texture: cannot read n.png"), "{message}");
}

#[test]
fn a_pattern_in_texture_coordinates_needs_them_and_keeps_repeats() {
    let scene = |file: &str| {
        format!(
            "[material.tiles]\ndiffuse = {{ checker = [[0, 0, 0], [1, 1, 1]], space = \"uv\" }}\n\
             [[model]]\nfile = \"m/{file}\"\nmaterial = \"tiles\"\n"
        )
    };
    let folder = wooden(&scene("a.obj"));
    let obj = format!("{}f 1/1 2/2 3/3\n", SQUARE.replace("vt ", "vt -2."));
    std::fs::write(folder.path("m/a.obj"), obj).unwrap();
    let LoadedScene { scene: loaded, meshes, .. } = folder.load("s.toml");
    assert!(loaded.materials[0].checker.is_some() && meshes[0].has_uvs());
    assert_eq!(meshes[0].whole_repeats(0), Vec2::new(-3.0, 0.0));
    let message = wooden(&scene("bare.obj")).refusal("s.toml");
    assert!(
        message.starts_with("s.toml:8:12: `material` in [[model]] has a texture or a pattern"),
        "{message}"
    );
}

#[test]
fn models_in_groups_are_placed_and_framed() {
    let scene = "[[model]]\nname = \"flag\"\nfile = \"a.obj\"\ntranslate = [1, 0, 0]\n\
                 [[disk]]\nname = \"top\"\ncenter = [0, 0, 0]\nnormal = [0, 1, 0]\nradius = 2\n\
                 [[group]]\ntranslate = [0, 100, 0]\nscale = 3\nchildren = [\"flag\", \"top\"]\n";
    let folder = Folder::with(&[("s.toml", scene), ("a.obj", TRIANGLE)]);
    let LoadedScene { scene, warnings, .. } = folder.load("s.toml");
    assert_eq!(warnings, [""; 0]);
    assert_eq!(scene.models[0].translate, DVec3::new(3.0, 100.0, 0.0));
    assert_eq!(scene.models[0].group * DVec3::ONE, DVec3::splat(3.0));
    assert!((scene.disks[0].radius - 6.0).abs() < 1e-12);
    // The disk is 12 units wide and 100 units up: the camera shows it.
    let camera = scene.camera;
    assert!((camera.look_at - DVec3::Y * 100.0).length() < 4.0, "{}", camera.look_at);
    assert!((camera.position - camera.look_at).length() > 10.0);
}

#[test]
fn cameras_keep_their_kind() {
    for (keys, kind) in [
        ("kind = \"orthographic\"\nview_height = 3", CameraKind::Orthographic { view_height: 3.0 }),
        ("kind = \"fisheye\"\nfov = 220", CameraKind::Fisheye),
    ] {
        let camera = folder(&format!("{keys}\n{BALL}")).load("s.toml").scene.camera;
        assert_eq!(camera.kind, kind);
    }
}

#[test]
fn glass_of_a_model_reaches_the_scene_through_its_compiled_form() {
    let files = [
        ("a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl glass\nf 1 2 3\n"),
        ("a.mtl", "newmtl glass\nKd 0 0 0\nillum 7\nNi 1.25\nd 0.25\nTf 1 0.5 1\n"),
    ];
    let folder = Folder::with(&files);
    let glass = folder.load("a.obj").scene.materials[0];
    assert_eq!((glass.transmit, glass.ior, glass.fresnel), (Vec3::new(0.75, 0.375, 0.75), 1.25, true));
    let (mesh, warnings) =
        compile_model(&folder.path("a.obj"), &folder.path("."), CompileOptions::default()).unwrap();
    assert_eq!(warnings, [""; 0]);
    std::fs::write(folder.path("a.rfmesh"), mesh.bytes()).unwrap();
    assert_eq!(folder.load("a.rfmesh").scene.materials[0], glass);
}

#[test]
fn lenses_and_metallic_roughness_reach_the_scene() {
    let scene = "aperture = 0.5\nfocus_distance = 3\n[render]\nintegrator = \"path\"\nsamples = 10\nexposure = 1\n\
                 [material.gold]\ndiffuse = [1, 0.75, 0.25]\nroughness = 0.75\ntransmission = 0.5\n\
                 metallic_roughness_texture = { texture = \"rough.png\" }\n\
                 [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"gold\"\n";
    let folder = folder(scene);
    picture(&folder, "rough.png", 2, 2);
    let LoadedScene { scene, textures, warnings, .. } = folder.load("s.toml");
    assert_eq!((textures.len(), warnings), (1, Vec::new()));
    assert_eq!((scene.lens.aperture, scene.lens.focus_distance), (0.5, Some(3.0)));
    let view = FrameView::of(&scene);
    assert!(view.integrator.path().is_some() && view.validate().is_ok());
    assert_eq!((view.lens, view.samples, view.tone.exposure), (scene.lens, 10, 1.0));
    let gold = scene.materials[scene.spheres[0].material as usize];
    let model = gold.metallic_roughness.unwrap();
    assert_eq!((model.metallic, model.roughness, model.texture), (1.0, 0.75, Some(0)));
    assert_eq!(gold.diffuse, Vec3::new(1.0, 0.75, 0.25), "the base colour");
    assert_eq!(gold.transmit, Vec3::new(0.5, 0.375, 0.125), "where the texture has no metal");
    let direct = gold.shown_directly();
    assert_eq!((direct.diffuse, direct.transmit), (Vec3::ZERO, Vec3::ZERO));
}
