//! Keys of animations.

use super::*;

const CAMERA: &str = "[camera]\nposition = [0, 0, 9]\nlook_at = [0, 0, 0]\n";
const LIGHT: &str = "[[light]]\nposition = [0, 9, 0]\n";

fn at(text: &str, time: f64) -> SceneText {
    super::super::read(text, time).unwrap_or_else(|fault| panic!("{text}: {}", fault.message))
}

#[test]
fn spheres_pass_through_their_keys() {
    let text = "[[sphere]]\nradius = 2\n[[sphere.key]]\ntime = 1\ncenter = [1, 0, 0]\n\
                [[sphere.key]]\ntime = 3\ncenter = [5, 2, 0]\nradius = 3\n\
                [[sphere.key]]\ntime = 4\ncenter = [5, 2, 9]\nradius = 1\n";
    for (time, center, radius) in [
        (0.0, [1.0, 0.0, 0.0], 3.0),
        (1.0, [1.0, 0.0, 0.0], 3.0),
        (3.0, [5.0, 2.0, 0.0], 3.0),
        (3.5, [5.0, 2.0, 4.5], 2.0),
        (4.0, [5.0, 2.0, 9.0], 1.0),
        (99.0, [5.0, 2.0, 9.0], 1.0),
    ] {
        let scene = at(text, time);
        assert_eq!(scene.spheres[0].radius, radius, "at {time}");
        let distance = scene.spheres[0].center.distance(DVec3::from_array(center));
        assert!(if time == 3.5 { distance < 2.0 } else { distance == 0.0 }, "at {time}: {distance}");
    }
    let scene = at(text, 0.0);
    assert!(scene.moves && scene.camera_path.is_empty());
    assert_eq!(scene.last_key, 4.0);
    assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
    assert!(
        scene.warnings[0].message.contains("`radius` in [[sphere]] has no effect"),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn models_lights_and_what_is_in_groups_move() {
    let text = "[[model]]\nfile = \"a.obj\"\nup = \"z\"\nscale = 3\n\
                [[model.key]]\ntime = 0\nrotate = [0, 0, 0]\n[[model.key]]\ntime = 2\nrotate = [0, 90, 0]\n\
                [[light]]\ncolor = [1, 0.5, 0]\n\
                key = [{ time = 0, position = [0, 9, 0], intensity = 1 }, { time = 2, position = [4, 9, 0], intensity = 3 }]\n\
                [[box]]\nname = \"crate\"\nmin = [0, 0, 0]\nmax = [1, 1, 1]\n\
                [[sphere]]\nname = \"ball\"\ncenter = [1, 0, 0]\nradius = 1\n\
                [[group]]\nchildren = [\"crate\", \"ball\"]\n\
                [[group.key]]\ntime = 0\nrotate = [0, 0, 0]\ntranslate = [0, 0, 0]\nscale = 1\n\
                [[group.key]]\ntime = 2\nrotate = [0, 0, 180]\ntranslate = [0, 4, 0]\nscale = [3, 3, 3]\n";
    let scene = at(text, 1.0);
    assert_eq!(scene.models[0].rotate, DVec3::new(-90.0, 45.0, 0.0));
    assert_eq!(scene.models[0].scale, DVec3::splat(3.0));
    assert_eq!(scene.lights[0].kind, LightKind::Point { position: DVec3::new(2.0, 9.0, 0.0) });
    assert_eq!(scene.lights[0].color, glam::Vec3::new(2.0, 1.0, 0.0));
    // Twice as large, turned by 90 degrees about z, two up.
    assert!(scene.spheres[0].center.distance(DVec3::new(0.0, 4.0, 0.0)) < 1e-12);
    assert!((scene.spheres[0].radius - 2.0).abs() < 1e-12);
    let corners = scene.triangles.iter().flat_map(|triangle| triangle.vertices);
    let far = corners.fold(DVec3::ZERO, |far, corner| far.max(corner.abs()));
    assert!(far.distance(DVec3::new(2.0, 4.0, 2.0)) < 1e-12, "{far}");
}

#[test]
fn spots_follow_a_point_and_directions_remain_of_unit_length() {
    let spot = "[[light]]\nkind = \"spot\"\nposition = [0, 2, 0]\n\
                key = [{ time = 0, look_at = [0, 0, 0] }, { time = 1, look_at = [2, 2, 0] }]\n";
    let LightKind::Spot { direction, .. } = at(spot, 1.0).lights[0].kind else { panic!("no spot") };
    assert_eq!(direction, DVec3::X);
    let sun = "[[light]]\nkind = \"directional\"\n\
               key = [{ time = 0, direction = [0, -1, 0] }, { time = 1, direction = [-3, 0, 0] }]\n";
    let LightKind::Directional { direction } = at(sun, 0.5).lights[0].kind else { panic!("no sun") };
    assert!((direction.length() - 1.0).abs() < 1e-12 && direction.x < 0.0 && direction.y < 0.0);
}

#[test]
fn the_camera_passes_through_its_keys() {
    let text = format!(
        "{CAMERA}[[camera_key]]\ntime = 0\nposition = [0, 0, 9]\nfov = 40\n[[camera_key]]\ntime = 1\nposition = [9, 0, 0]\n\
         [[camera_key]]\ntime = 2\nposition = [0, 0, -9]\nfov = 20\n"
    );
    let scene = at(&text, 0.0);
    assert!(!scene.moves && !scene.camera_path.is_empty());
    let base = crate::scene::Camera { position: DVec3::Z * 9.0, look_at: DVec3::ZERO, ..Default::default() };
    let camera = |time| scene.camera_path.camera(&base, time);
    assert_eq!((camera(1.0).position, camera(2.0).position), (DVec3::X * 9.0, DVec3::Z * -9.0));
    assert_eq!((camera(0.0).fov, camera(1.0).fov, camera(2.0).fov), (40.0, 30.0, 20.0));
    assert_eq!(camera(1.3).look_at, DVec3::ZERO);
}

#[test]
fn wrong_keys_are_refused_with_their_place() {
    let sphere = |keys: &str| format!("[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nkey = [{keys}]\n");
    for (text, words) in [
        (sphere("{ time = 0, center = [0, 0, 0] }"), "1 times [[sphere.key]]"),
        (sphere("{ time = 1, radius = 1 }, { time = 1, radius = 2 }"), "must be later"),
        (sphere("{ time = 1, radius = 1 }, { time = 0, radius = 2 }"), "must be later"),
        (
            sphere("{ time = 0, radius = 1 }, { time = 1, center = [0, 0, 0] }"),
            "only one [[sphere.key]] has `",
        ),
        (sphere("{ time = 0, radius = 1 }, { time = 1, radius = 0 }"), "`radius` in [[sphere.key]]"),
        (sphere("{ time = -1, radius = 1 }, { time = 1, radius = 2 }"), "of seconds from 0"),
        (sphere("{ radius = 1 }, { time = 1, radius = 2 }"), "`time` is missing"),
        (sphere("{ time = 0, centre = [0, 0, 0] }, { time = 1 }"), "did you mean `center`"),
        (
            format!("{}center_end = [1, 0, 0]\n", sphere("{ time = 0 }, { time = 1 }")),
            "contradicts [[sphere.key]]",
        ),
        (
            "[[group]]\nchildren = []\nkey = [{ time = 0, scale = 1 }, { time = 1, scale = [1, -1, 1] }]\n"
                .into(),
            "pass through 0",
        ),
        (format!("{CAMERA}[[camera_key]]\ntime = 0\nposition = [0, 0, 0]\n"), "1 times [[camera_key]]"),
        (format!("{CAMERA}camera_key = 3\n"), "unknown key"),
        (
            format!("{CAMERA}[[camera_key]]\ntime = 0\nfov = 180\n[[camera_key]]\ntime = 1\nfov = 10\n"),
            "below 180",
        ),
        (
            format!("{LIGHT}key = [{{ time = 0, intensity = 1 }}, {{ time = 1, intensity = -1 }}]\n"),
            "`intensity` in [[light.key]]",
        ),
    ] {
        let fault = read(&text).expect_err(&text);
        assert!(fault.message.contains(words), "{text}: {}", fault.message);
        assert!(fault.at > 0 && fault.at < text.len(), "{text}: at {}", fault.at);
    }
}
