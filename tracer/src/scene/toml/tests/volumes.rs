//! Volumes.

use super::*;
use crate::scene::VolumeBoundary;

const PATH: &str = "[render]\nintegrator = \"path\"\n";

#[test]
fn volumes_in_spheres_and_boxes_and_models_are_read() {
    let text = format!(
        "{PATH}[[volume]]\nsphere = {{ center = [1, 2, 3], radius = 0.5 }}\n\
         [[volume]]\nbox = {{ min = [-1, 0, 0], max = [1, 1, 1] }}\ndensity = 2.5\ncolor = [0, 0.5, 1]\n\
         [[volume]]\nmodel = \"closed.obj\"\ntranslate = [0, 1, 0]\nscale = 2\nup = \"z\"\n"
    );
    let scene = read(&text).unwrap();
    assert!(scene.warnings.is_empty());
    let [ball, cuboid, model] = &scene.volumes[..] else { panic!("three volumes") };
    let center = DVec3::new(1.0, 2.0, 3.0);
    assert_eq!(ball.boundary, BoundaryText::Whole(VolumeBoundary::Sphere { center, radius: 0.5 }));
    assert_eq!((ball.density, ball.color), (1.0, Vec3::splat(0.9)));
    let (lower, upper) = (DVec3::new(-1.0, 0.0, 0.0), DVec3::ONE);
    assert_eq!(cuboid.boundary, BoundaryText::Whole(VolumeBoundary::Box { lower, upper }));
    assert_eq!((cuboid.density, cuboid.color), (2.5, Vec3::new(0.0, 0.5, 1.0)));
    let placed = "[[model]]\nfile = \"closed.obj\"\ntranslate = [0, 1, 0]\nscale = 2\nup = \"z\"\n";
    let expected = &read(placed).unwrap().models[0];
    let found = model.model().unwrap();
    assert_eq!(
        (&found.file, found.translate, found.rotate, found.scale),
        (&expected.file, expected.translate, expected.rotate, expected.scale)
    );
    assert!(ball.model().is_none());
}

#[test]
fn faults_of_volumes_have_a_place() {
    assert_faults(&[
        ("[[volume]]\ndensity = 1", "1:1", &["`sphere` is missing in [[volume]] (or `box`, or `model`)"]),
        (
            "[[volume]]\nsphere = { center = [0, 0, 0], radius = 1 }\nmodel = \"a.obj\"",
            "3:9",
            &["`model` contradicts `sphere` in [[volume]]"],
        ),
        ("[[volume]]\nsphere = { center = [0, 0, 0] }", "2:10", &["`radius` is missing"]),
        ("[[volume]]\nsphere = { center = [0, 0, 0], radius = 0 }", "2:41", &["above 0"]),
        ("[[volume]]\nbox = { min = [0, 0, 0], max = [1, 0, 1] }", "2:32", &["above `min` on every axis"]),
        ("[[volume]]\nmodel = \"\"", "2:9", &["the name of a model file"]),
        ("[[volume]]\nmodel = \"a.obj\"\ndensity = -1", "3:11", &["from 0 to 1e30"]),
        ("[[volume]]\nmodel = \"a.obj\"\ncolor = [0, 2, 0]", "3:9", &["from 0 to 1"]),
        ("[[volume]]\nmodel = \"a.obj\"\nmaterial = \"a\"", "3:1", &["unknown key `material` in [[volume]]"]),
    ]);
    let many = "[[volume]]\nmodel = \"a.obj\"\n".repeat(65);
    assert!(fault(&many).contains("65 times [[volume]], at most 64 are allowed"));
}

#[test]
fn keys_of_volumes_without_effect_are_warned_about() {
    let ball = "[[volume]]\nsphere = { center = [0, 0, 0], radius = 1 }\n";
    let found = warnings(&format!("{ball}{ball}"));
    assert!(
        found.len() == 1
            && found[0].ends_with("`volume` in the scene file has no effect with the direct integrator"),
        "{found:?}"
    );
    assert_eq!(
        warnings(&format!("{PATH}{ball}scale = 2\n")),
        ["5:9 `scale` in [[volume]] has no effect without a `model`"]
    );
}
