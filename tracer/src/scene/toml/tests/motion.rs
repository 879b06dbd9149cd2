//! The shutter, and objects that move.

use super::*;
use crate::scene::Motion;

const CAMERA: &str = "[render]\nintegrator = \"path\"\n[camera]\nposition = [0, 0, 9]\nlook_at = [0, 0, 0]\n";
const BALL: &str = "[[sphere]]\ncenter = [1, 2, 3]\nradius = 1\ncenter_end = [5, 2, -1]\n";

fn with_shutter(shutter: &str, rest: &str) -> SceneText {
    let text = format!("{CAMERA}shutter = {shutter}\n{rest}");
    read(&text).unwrap_or_else(|fault| panic!("{text}: {}", fault.message))
}

#[test]
fn spheres_move_between_both_ends_of_the_shutter() {
    let found = with_shutter("[0.25, 0.5]", BALL);
    assert_eq!(found.spheres[0].center, DVec3::new(2.0, 2.0, 2.0));
    assert_eq!(found.motions, [Motion::Sphere { sphere: 0, center: DVec3::new(3.0, 2.0, 1.0) }]);
    let whole = with_shutter("[0, 1]", BALL);
    assert_eq!(whole.spheres[0].center, DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(whole.motions, [Motion::Sphere { sphere: 0, center: DVec3::new(5.0, 2.0, -1.0) }]);
    // An instant.
    let instant = with_shutter("[1, 1]", BALL);
    assert_eq!((instant.spheres[0].center, instant.motions), (DVec3::new(5.0, 2.0, -1.0), vec![]));
    let resting = with_shutter(
        "[0, 1]",
        "[[sphere]]\ncenter = [0.1, 0.2, 0.3]\nradius = 1\ncenter_end = [0.1, 0.2, 0.3]",
    );
    assert_eq!((resting.spheres[0].center, resting.motions), (DVec3::new(0.1, 0.2, 0.3), vec![]));
}

#[test]
fn models_move_and_rotate() {
    let model = "[[model]]\nfile = \"a.obj\"\n[[model]]\nfile = \"a.obj\"\ntranslate = [1, 0, 0]\nrotate = [0, 20, 0]\n";
    let found = with_shutter("[0.5, 1]", &format!("{model}rotate_end = [0, 40, 80]"));
    assert_eq!(found.models[1].translate, DVec3::X);
    assert_eq!(found.models[1].rotate, DVec3::new(0.0, 30.0, 40.0));
    let rotate = DVec3::new(0.0, 40.0, 80.0);
    assert_eq!(found.motions, [Motion::Model { model: 1, translate: DVec3::X, rotate }]);
    let found = with_shutter("[0, 1]", &format!("{model}translate_end = [1, 4, 0]\nup = \"z\""));
    let rotate = DVec3::new(-90.0, 20.0, 0.0);
    assert_eq!(found.motions, [Motion::Model { model: 1, translate: DVec3::new(1.0, 4.0, 0.0), rotate }]);
    let rotated = with_shutter("[0, 1]", &format!("{model}rotate_end = [0, 20, 8]\nup = \"z\""));
    let rotate = DVec3::new(-90.0, 20.0, 8.0);
    assert_eq!(rotated.motions, [Motion::Model { model: 1, translate: DVec3::X, rotate }]);
}

#[test]
fn groups_place_both_ends() {
    let group = "[[group]]\ntranslate = [10, 0, 0]\nscale = 2\nchildren = [\"a\"]\n";
    let found = with_shutter("[0, 1]", &format!("{group}{BALL}name = \"a\""));
    assert_eq!(found.spheres[0].center, DVec3::new(12.0, 4.0, 6.0));
    assert_eq!(found.motions, [Motion::Sphere { sphere: 0, center: DVec3::new(20.0, 4.0, -2.0) }]);
    let model = "[[model]]\nfile = \"a.obj\"\nname = \"a\"\n";
    let found = with_shutter("[0, 1]", &format!("{group}{model}translate_end = [0, 1, 0]"));
    let (translate, rotate) = (DVec3::new(10.0, 2.0, 0.0), DVec3::ZERO);
    assert_eq!(found.motions, [Motion::Model { model: 0, translate, rotate }]);
    let stretched = group.replace("scale = 2", "scale = [1, 2, 1]");
    let moved = with_shutter("[0, 1]", &format!("{stretched}{model}translate_end = [0, 1, 0]"));
    assert_eq!(moved.motions, [Motion::Model { model: 0, translate, rotate }]);
    let rotated = format!("{CAMERA}shutter = [0, 1]\n{stretched}{model}rotate_end = [0, 1, 0]");
    let message = read(&rotated).unwrap_err().message;
    assert!(message.contains("rotates, by different factors"), "{message}");
}

#[test]
fn times_that_are_no_interval_are_refused() {
    for shutter in
        ["[0]", "[0, 1, 2]", "0.5", "[0.5, 0.25]", "[-0.5, 1]", "[0, 1.5]", "[0, nan]", "[\"a\", 1]"]
    {
        let text = format!("{CAMERA}shutter = {shutter}\n");
        assert!(read(&text).unwrap_err().message.contains("shutter"), "{shutter}");
    }
    let text = format!(
        "{CAMERA}shutter = [0, 1]\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\ncenter_end = [0, 1e31, 0]"
    );
    assert!(read(&text).unwrap_err().message.contains("center_end"));
    let volume = format!("{CAMERA}[[volume]]\nmodel = \"a.obj\"\ntranslate_end = [0, 0, 0]");
    assert!(read(&volume).unwrap_err().message.contains("unknown key `translate_end` in [[volume]]"));
}

#[test]
fn keys_of_motion_without_effect_are_warned_about() {
    let model = "[[model]]\nfile = \"a.obj\"\ntranslate_end = [0, 1, 0]\n";
    for shutter in ["", "shutter = [0, 0]\n"] {
        let found = warnings(&format!("{CAMERA}{shutter}{BALL}{BALL}{model}"));
        let [ball, model] = &found[..] else { panic!("{found:?}") };
        assert!(ball.ends_with("`center_end` in [[sphere]] has no effect without a `shutter` in [camera] that closes after time 0"));
        assert!(model.contains("`translate_end` in [[model]] has no effect"));
    }
    assert_eq!(warnings(&format!("{CAMERA}shutter = [0, 1]\n{BALL}{model}")), [""; 0]);
    assert_eq!(warnings(&format!("{CAMERA}shutter = [0.5, 0.5]\n{BALL}")), [""; 0]);
    let nothing = warnings(&format!("{CAMERA}shutter = [0, 1]\n"));
    assert!(nothing.len() == 1 && nothing[0].contains("`shutter` in [camera] has no effect"), "{nothing:?}");
    let direct = CAMERA.replace("path", "direct");
    let found = warnings(&format!("{direct}shutter = [0, 1]\n{BALL}{BALL}"));
    assert!(found.len() == 1 && found[0].contains("the direct integrator shows no motion"), "{found:?}");
    assert_eq!(warnings(&format!("{direct}shutter = [0.5, 0.5]\n{BALL}")), [""; 0]);
}
