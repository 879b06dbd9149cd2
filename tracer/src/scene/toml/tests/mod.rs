//! Complete scenes, defaults, warnings, and arbitrary texts.

mod bounces;
mod checkers;
mod faults;
mod groups;
mod keys;
mod motion;
mod paths;
mod shapes;
mod textures;
mod views;
mod volumes;

use glam::{DVec3, Vec2};
use proptest::prelude::*;

use super::*;
use crate::scene::{Attenuation, Background, Filter, LightKind, NormalMode, Tiling, Wrap};

fn read(text: &str) -> Read<SceneText> {
    super::read(text, 0.0)
}

/// A scene with one object of every kind, as on the format's page.
const WHOLE: &str = r#"
ambient = [0.05, 0.05, 0.05]
[render]
width = 640
height = 480
samples = 9
max_depth = 5
min_contribution = 0.004
[camera]
kind = "pinhole"
position = [0.0, 1.0, 4.0]
look_at = [0.0, 1.0, 0.0]
up = [0.0, 1.0, 0.0]
fov = 35.0
zoom = 2
[background]
gradient = { bottom = [0.1, 0.1, 0.1], top = [1, 1, 1] }
[[light]]
kind = "spot"
position = [3, 6, 4]
look_at = [3, 0, 4]
color = [1.0, 0.5, 0.25]
intensity = 4.0
attenuation = { constant = 1, linear = 0.1, quadratic = 0.01 }
beam_angle = 60
penumbra = 10
radius = 0.0
shadows = false
[[light]]
kind = "directional"
direction = [0, -10, 0]
[material.marble]
diffuse = [0.8, 0.78, 0.75]
specular = [0.3, 0.3, 0.3]
exponent = 20
reflect = 0.0
transmit = 0
[[model]]
file = "bust.obj"
material = "marble"
normals = "flat"
translate = [1, 2, 3]
rotate = [0.0, 30.0, 0.0]
scale = [1, -2, 1]
[[model]]
file = "bust.obj"
scale = 0.5
[[sphere]]
center = [0.0, 1.0, 0.0]
radius = 1.0
material = "marble"
[[plane]]
point = [0.0, 0.0, 0.0]
normal = [0.0, 3.0, 4.0]
[[triangle]]
vertices = [[0,0,0], [1,0,0], [0,1,0]]
material = "marble"
"#;

#[test]
fn models_have_an_up_axis_and_a_crease_angle() {
    let text = "[[model]]\nfile = \"a.obj\"\nup = \"z\"\nscale = [1, 2, 3]\nrotate = [10, 20, 30]\n\
                [[model]]\nfile = \"a.obj\"\nup = \"y\"\ncrease_angle = 25\n\
                [[model]]\nfile = \"a.obj\"\nnormals = \"flat\"\ncrease_angle = 25\n";
    let scene = read(text).unwrap();
    let [z, y, flat] = &scene.models[..] else { panic!("three models") };
    // The file is rotated first, about x, so that its z axis becomes the scene's y axis.
    assert_eq!((z.rotate, z.scale), (DVec3::new(-80.0, 20.0, 30.0), DVec3::new(1.0, 3.0, 2.0)));
    assert_eq!((z.crease_angle, y.crease_angle), (None, Some((25.0, text.find("25").unwrap()))));
    assert_eq!((y.rotate, y.scale), (DVec3::ZERO, DVec3::ONE));
    assert_eq!(flat.normals, NormalMode::Flat);
    assert_eq!(scene.warnings.len(), 1);
    assert!(
        scene.warnings[0].message.contains("`crease_angle` in [[model]] has no effect"),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn a_whole_scene_is_read() {
    let scene = read(WHOLE).unwrap();
    assert_eq!(scene.warnings, []);
    assert_eq!((scene.render.width, scene.render.height, scene.render.samples), (640, 480, 9));
    let camera = scene.camera.unwrap();
    assert_eq!(camera.aim, Aim::Point(DVec3::Y));
    assert_eq!((camera.fov, camera.zoom), (35.0, 2.0));
    let gradient = Background::Gradient { bottom: Vec3::splat(0.1), top: Vec3::ONE };
    assert_eq!(scene.background.radiance, RadianceText::Plain(gradient));
    let spot = &scene.lights[0];
    assert_eq!(spot.color, Vec3::new(4.0, 2.0, 1.0));
    assert!(!spot.shadows);
    assert_eq!(spot.attenuation, Attenuation::Polynomial { constant: 1.0, linear: 0.1, quadratic: 0.01 });
    let (position, direction) = (DVec3::new(3.0, 6.0, 4.0), DVec3::NEG_Y);
    assert_eq!(spot.kind, LightKind::Spot { position, direction, beam_angle: 60.0, penumbra: 10.0 });
    assert_eq!(scene.lights[1].kind, LightKind::Directional { direction });
    assert_eq!(scene.models.len(), 2);
    assert_eq!(scene.models[0].material, Some(0));
    assert_eq!(scene.models[0].normals, NormalMode::Flat);
    assert_eq!(scene.models[0].scale, DVec3::new(1.0, -2.0, 1.0));
    assert_eq!(scene.models[1].material, None);
    assert_eq!(scene.models[1].scale, DVec3::splat(0.5));
    assert_eq!(scene.planes[0].normal, DVec3::new(0.0, 0.6, 0.8));
    // The plane has no material: the neutral one follows those of the file.
    assert_eq!(scene.planes[0].material, 1);
    assert_eq!(scene.materials[1], Material::NEUTRAL);
    assert_eq!(scene.triangles[0].vertices[1], DVec3::X);
}

#[test]
fn absent_keys_have_defaults() {
    let scene =
        read("[[light]]\nposition = [1, 2, 3]\n[camera]\nposition = [0,0,0]\ndirection = [0,0,-2]").unwrap();
    assert_eq!(scene.render, RenderSettings::default());
    assert_eq!(scene.ambient, Vec3::ZERO);
    let black = RadianceText::Plain(Background::Color(Vec3::ZERO));
    assert_eq!(scene.background, BackgroundText { radiance: black, visible: true });
    let camera = scene.camera.unwrap();
    assert_eq!((camera.aim, camera.up), (Aim::Direction(DVec3::NEG_Z), DVec3::Y));
    assert_eq!((camera.fov, camera.zoom), (40.0, 1.0));
    let light = &scene.lights[0];
    assert_eq!(light.kind, LightKind::Point { position: DVec3::new(1.0, 2.0, 3.0) });
    assert_eq!((light.color, light.attenuation, light.shadows), (Vec3::ONE, Attenuation::None, true));
    assert!(read("").unwrap().camera.is_none());
}

/// The message for a faulty text: "line:column: message".
fn fault(text: &str) -> String {
    let fault = read(text).expect_err(text);
    let (line, column) = place(text, fault.at);
    format!("{line}:{column}: {}", fault.message)
}

/// The warnings of a text: "line:column message" each.
fn warnings(text: &str) -> Vec<String> {
    let scene = read(text).unwrap_or_else(|fault| panic!("{text}: {}", fault.message));
    let shown = |warning: &Fault| {
        let (line, column) = place(text, warning.at);
        format!("{line}:{column} {}", warning.message)
    };
    scene.warnings.iter().map(shown).collect()
}

/// Asserts the position of the fault and that its message contains all words.
fn assert_faults(cases: &[(&str, &str, &[&str])]) {
    for (text, place, words) in cases {
        let message = fault(text);
        assert!(message.starts_with(&format!("{place}: ")), "{text:?} at {place}: {message}");
        for word in *words {
            assert!(message.contains(word), "{text:?} lacks {word:?}: {message}");
        }
    }
}

#[test]
fn keys_without_effect_are_accepted_with_a_warning() {
    let text = "[camera]\nposition=[0,0,0]\nlook_at=[0,0,1]\nview_height = 2.0\n\
                [[light]]\nposition=[0,0,0]\nbeam_angle = 40.0\ndirection=[0,-1,0]\n\
                [[light]]\nkind=\"directional\"\ndirection=[0,-1,0]\nattenuation = \"inverse_square\"\n\
                [[triangle]]\nvertices=[[1,1,1],[1,1,1],[2,2,2]]\n";
    let scene = read(text).unwrap();
    let warnings: Vec<String> =
        scene.warnings.iter().map(|w| format!("{}: {}", place(text, w.at).0, w.message)).collect();
    assert_eq!(warnings.len(), 5, "{warnings:?}");
    for (line, word) in
        [(4, "view_height"), (7, "beam_angle"), (8, "direction"), (12, "attenuation"), (14, "area")]
    {
        let found = warnings.iter().any(|w| w.starts_with(&format!("{line}: ")) && w.contains(word));
        assert!(found, "{line} {word}: {warnings:?}");
    }
    assert!(scene.triangles.is_empty());
}

#[test]
fn directions_are_normalised() {
    for factor in [1.0, 1e-300, 1e29] {
        let text = format!("[[plane]]\npoint=[0,0,0]\nnormal=[0, {:e}, {:e}]", -3.0 * factor, 4.0 * factor);
        let normal = read(&text).unwrap().planes[0].normal;
        assert!((normal - DVec3::new(0.0, -0.6, 0.8)).length() < 1e-15, "{factor}: {normal}");
    }
}

#[test]
fn rotations_turn_the_camera_and_its_up() {
    let camera = |rotation: &str| {
        let text = format!("[camera]\nposition = [0,0,0]\nrotation = {rotation}");
        let camera = read(&text).unwrap().camera.unwrap();
        let Aim::Direction(direction) = camera.aim else { panic!("a rotation gives a direction") };
        (direction, camera.up)
    };
    assert_eq!(camera("[0, 0, 0]"), (DVec3::NEG_Z, DVec3::Y));
    assert_eq!(camera("[90, 0, 0]"), (DVec3::Y, DVec3::Z));
    assert_eq!(camera("[0, 90, 0]"), (DVec3::NEG_X, DVec3::Y));
    assert_eq!(camera("[0, 0, 90]"), (DVec3::NEG_Z, DVec3::NEG_X));
    // Rolled and pitched first, then yawed: down to the left of the start, with the up direction towards +Z.
    assert_eq!(camera("[-90, 90, 90]"), (DVec3::NEG_Y, DVec3::Z));
}

/// Pieces of scene files that reach deep into the parser in some combinations.
fn piece() -> impl Strategy<Value = String> {
    prop_oneof![
        prop::sample::select(KEYS).prop_map(|key| format!("[{key}]\n")),
        prop::sample::select(KEYS).prop_map(|key| format!("[[{key}]]\n")),
        prop::sample::select(light::LIGHT_KEYS).prop_map(str::to_owned),
        prop::sample::select(camera::CAMERA_KEYS).prop_map(str::to_owned),
        prop::sample::select(objects::MODEL_KEYS).prop_map(str::to_owned),
        prop::sample::select(vec![
            "=",
            "= [0, 1e300, -1]\n",
            "= 0x10\n",
            "= \"spot\"\n",
            "= {x = 1}\n",
            "= nan\n"
        ])
        .prop_map(str::to_owned),
        any::<f64>().prop_map(|number| format!("= {number}\n")),
        "[ -~]{0,6}",
        Just("\n".to_owned()),
    ]
}

proptest! {
    #[test]
    fn any_text_is_read_or_refused_inside_the_text(text in prop::collection::vec(piece(), 0..20)) {
        let text = text.concat();
        if let Err(fault) = read(&text) {
            prop_assert!(fault.at <= text.len());
            prop_assert!(!fault.message.is_empty());
        }
    }

    #[test]
    fn any_characters_are_read_or_refused(text in any::<String>()) {
        if let Err(fault) = read(&text) {
            prop_assert!(place(&text, fault.at) >= (1, 1));
        }
    }

    #[test]
    fn a_damaged_scene_is_read_or_refused(at in 0..WHOLE.len(), byte in 0u8..128) {
        let mut bytes = WHOLE.as_bytes().to_vec();
        bytes[at] = byte;
        let text = String::from_utf8(bytes).unwrap();
        if let Err(fault) = read(&text) {
            prop_assert!(fault.at <= text.len());
        }
    }
}
