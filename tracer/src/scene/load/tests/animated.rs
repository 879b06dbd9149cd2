//! Scenes at times of their animations.

use super::*;
use crate::scene::SceneAnimation;

const TEXT: &str = "[camera]\nposition = [0, 0, 9]\ndirection = [0, 0, -1]\n\
    [[camera_key]]\ntime = 0\nposition = [0, 0, 9]\n[[camera_key]]\ntime = 2\nposition = [6, 0, 9]\n\
    [[model]]\nfile = \"a.obj\"\n[[model.key]]\ntime = 0\ntranslate = [0, 0, 0]\n[[model.key]]\ntime = 1\ntranslate = [2, 0, 0]\n\
    [[sphere]]\nname = \"ball\"\ncenter = [0, 0, 0]\nradius = 1\n\
    [[group]]\nchildren = [\"ball\"]\n";

fn animated(text: &str) -> (LoadedScene, SceneAnimation) {
    let folder = Folder::with(&[("a.obj", TRIANGLE), ("s.toml", text)]);
    let loaded = folder.load("s.toml");
    let animation = loaded.animation.clone().expect("an animation");
    (loaded, animation)
}

#[test]
fn the_scene_of_a_time_differs_in_what_moves_only() {
    let (loaded, animation) = animated(TEXT);
    assert!(animation.moves_objects() && animation.moves_camera());
    assert_eq!(animation.end(), 2.0);
    assert_eq!(animation.scene(&loaded.scene, 0.0).unwrap(), loaded.scene);
    let half = animation.scene(&loaded.scene, 0.5).unwrap();
    assert_eq!(half.models[0].translate, DVec3::X);
    let mut expected = loaded.scene.clone();
    expected.models[0].translate = DVec3::X;
    assert_eq!(half, expected);
    // The result depends neither on the scene of the file that is passed, nor on the order of times.
    assert_eq!(animation.scene(&half, 0.0).unwrap(), loaded.scene);
    let camera = animation.camera(&loaded.scene.camera, 1.0);
    assert_eq!(camera.position, DVec3::new(3.0, 0.0, 9.0));
    assert_eq!(camera.look_at - camera.position, loaded.scene.camera.look_at - loaded.scene.camera.position);
}

#[test]
fn a_fault_at_a_later_time_is_reported_with_its_place() {
    let keys = "[[group.key]]\ntime = 0\nscale = 1\n[[group.key]]\ntime = 1\nscale = [1, 2, 1]\n";
    let (loaded, animation) = animated(&format!("{TEXT}{keys}"));
    assert!(animation.scene(&loaded.scene, 0.0).is_ok());
    let message = animation.scene(&loaded.scene, 0.5).unwrap_err().to_string();
    assert!(message.contains("s.toml:") && message.contains("sphere"), "{message}");
}

#[test]
fn a_scene_without_keys_has_no_animation() {
    let folder = Folder::with(&[("s.toml", "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n")]);
    assert_eq!(folder.load("s.toml").animation, None);
}
