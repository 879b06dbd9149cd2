//! Kinds of cameras and backgrounds.

use std::path::Path;

use super::*;
use crate::scene::{CameraKind, FovAxis};

const CAMERA: &str = "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\n";

fn camera(keys: &str) -> CameraText {
    read(&format!("{CAMERA}{keys}\n")).unwrap().camera.unwrap()
}

#[test]
fn cameras_have_a_kind() {
    let pinhole = camera("fov_axis = \"horizontal\"\nfov = 90");
    assert_eq!((pinhole.kind, pinhole.fov), (CameraKind::Pinhole { fov_axis: FovAxis::Horizontal }, 90.0));
    assert_eq!(camera("").kind, CameraKind::PINHOLE);
    assert_eq!(camera("fov_axis = \"vertical\"").kind, CameraKind::PINHOLE);
    let orthographic = camera("kind = \"orthographic\"\nview_height = 3.5\nzoom = 2");
    assert_eq!((orthographic.kind, orthographic.zoom), (CameraKind::Orthographic { view_height: 3.5 }, 2.0));
    assert_eq!(camera("kind = \"orthographic\"").kind, CameraKind::Orthographic { view_height: 2.0 });
    let fisheye = camera("kind = \"fisheye\"\nfov = 360");
    assert_eq!((fisheye.kind, fisheye.fov), (CameraKind::Fisheye, 360.0));
    assert_eq!(camera("kind = \"fisheye\"").fov, 180.0);
}

#[test]
fn faults_of_cameras_name_their_place() {
    for (keys, place, words) in [
        ("kind = \"fisheye\"\nfov = 361", "5:7", "above 0 and at most 360 degrees"),
        ("kind = \"fisheye\"\nfov = 0", "5:7", "above 0"),
        ("kind = \"orthographic\"\nview_height = 0", "5:15", "above 0"),
        ("kind = \"orthographic\"\nview_height = -1", "5:15", "above 0"),
        ("kind = \"ortho\"", "4:8", "known here: `pinhole`, `orthographic`, `fisheye`"),
        ("fov_axis = \"diagonal\"", "4:12", "known here: `vertical`, `horizontal`"),
        ("fov = 200", "4:7", "below 180 degrees"),
    ] {
        assert_faults(&[(&format!("{CAMERA}{keys}"), place, &[words])]);
    }
}

#[test]
fn keys_of_other_cameras_are_warned_about() {
    for (keys, expected) in [
        ("view_height = 2", "4:15 `view_height` in [camera] has no effect on a pinhole camera"),
        (
            "kind = \"orthographic\"\nfov = 30",
            "5:7 `fov` in [camera] has no effect on an orthographic camera",
        ),
        (
            "kind = \"orthographic\"\nfov_axis = \"vertical\"",
            "5:12 `fov_axis` in [camera] has no effect on an orthographic camera",
        ),
        ("kind = \"fisheye\"\nzoom = 2", "5:8 `zoom` in [camera] has no effect on a fisheye camera"),
        (
            "kind = \"fisheye\"\nview_height = 2",
            "5:15 `view_height` in [camera] has no effect on a fisheye camera",
        ),
    ] {
        assert_eq!(warnings(&format!("{CAMERA}{keys}\n")), [expected]);
    }
}

#[test]
fn strength_is_a_factor_of_colours() {
    let radiance = |keys: &str| read(&format!("[background]\n{keys}\n")).unwrap().background;
    let color = radiance("color = [0.5, 0.25, 1]\nstrength = 4\nvisible = false");
    assert_eq!(color.radiance, RadianceText::Plain(Background::Color(Vec3::new(2.0, 1.0, 4.0))));
    assert!(!color.visible);
    let gradient = radiance("gradient = { bottom = [0, 0, 0.5], top = [1, 1, 1] }\nstrength = 0.5");
    let expected = Background::Gradient { bottom: Vec3::new(0.0, 0.0, 0.25), top: Vec3::splat(0.5) };
    assert_eq!((gradient.radiance, gradient.visible), (RadianceText::Plain(expected), true));
}

#[test]
fn skies_name_their_pictures() {
    let text = "[background]\npanorama = \"maps/sky.hdr\"\nrotate = 90\nstrength = 2\n";
    let scene = read(text).unwrap();
    let RadianceText::Sky(sky) = &scene.background.radiance else { panic!("a sky") };
    assert_eq!((sky.rotate, sky.strength), (90.0, 2.0));
    let SkyPictureText::Panorama(picture) = &sky.picture else { panic!("a panorama") };
    assert_eq!((picture.file.as_path(), place(text, picture.at)), (Path::new("maps/sky.hdr"), (2, 12)));
    let text = "[background]\ncubemap = [\"a\", \"b\", \"c\", \"d\", \"e\", \"f\"]\n";
    let scene = read(text).unwrap();
    let RadianceText::Sky(sky) = &scene.background.radiance else { panic!("a sky") };
    assert_eq!((sky.rotate, sky.strength), (0.0, 1.0));
    let SkyPictureText::Cubemap(faces) = &sky.picture else { panic!("a cube map") };
    assert_eq!(faces.each_ref().map(|face| face.file.to_str().unwrap()), ["a", "b", "c", "d", "e", "f"]);
    assert_eq!(place(text, faces[5].at), (2, 37));
    assert_eq!(scene.warnings, []);
}

#[test]
fn faults_of_backgrounds_name_their_place() {
    for (keys, place, words) in [
        ("panorama = \"\"", "2:12", "the name of a picture file"),
        ("panorama = 3", "2:12", "a text in quotes"),
        ("panorama = \"a.hdr\"\ncolor = [0, 0, 0]", "3:9", "`color` contradicts `panorama`"),
        ("cubemap = [\"a\", \"b\"]", "2:11", "six picture files"),
        ("cubemap = \"a.png\"", "2:11", "six picture files"),
        ("cubemap = [\"a\", \"b\", \"c\", \"d\", \"e\", 6]", "2:37", "a text in quotes, but is 6"),
        ("color = [0, 0, 0]\nstrength = -1", "3:12", "from 0 to 1e30"),
        ("color = [0, 0, 0]\nvisible = 1", "3:11", "true or false"),
        ("panorama = \"a.hdr\"\nrotate = inf", "3:10", "finite"),
        ("rotate = 3", "1:1", "`color` is missing in [background] (or `gradient`, `cubemap` or `panorama`)"),
    ] {
        assert_faults(&[(&format!("[background]\n{keys}"), place, &[words])]);
    }
    assert_eq!(
        warnings("[background]\ncolor = [0, 0, 0]\nrotate = 30\n"),
        ["3:10 `rotate` in [background] has no effect on a background without a picture"]
    );
}

#[test]
fn a_key_without_effect_is_reported_once_for_all_tables() {
    let sphere = "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nuv_rotate = [0, 90, 0]\n";
    let expected = "4:13 `uv_rotate` in [[sphere]] has no effect without a texture";
    assert_eq!(warnings(&sphere.repeat(100)), [expected]);
}
