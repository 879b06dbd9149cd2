//! Single paths of the integrator against those of the oracle, by the same random numbers.
//!
//! The integrator computes in `f32`: rounding moves some hits across an edge, and some numbers across the end of a selection or of roulette. Such
//! paths go elsewhere. There are few of them, and they change no mean.
//!
//! ```text
//!   scenes     small scenes with every kind of light
//!   rough      rough surfaces
//!   touching   bodies of glass that touch
//!   compare    samples of both
//! ```

mod compare;
mod rough;
mod scenes;
mod touching;

use compare::{compare, path_view};
use scenes::Furnished;

use crate::scene::{CameraKind, Filter, Lens, PathSettings, Sampler};

/// Largest share of samples that rounding may send elsewhere.
const FEW: f64 = 0.002;

/// Largest bias in standard deviations.
const NO_BIAS: f64 = 4.5;

fn assert_same(
    furnished: &Furnished,
    settings: PathSettings,
    depth: u8,
    change: impl Fn(&mut crate::scene::FrameView),
) {
    let mut view = path_view(furnished, settings, depth);
    change(&mut view);
    let compared = compare(furnished, &view, 0..6);
    let share = compared.share();
    let first: Vec<_> = compared.different().take(5).collect();
    assert!(share <= FEW, "{share} of the samples differ: {first:?}");
    let [found, expected] = compared.means();
    assert!(compared.bias() < NO_BIAS, "{} deviations: {found}, not {expected}", compared.bias());
    assert!(expected.min_element() > 0.0, "{expected}");
}

fn seeded(seed: u32) -> PathSettings {
    PathSettings { seed, ..PathSettings::default() }
}

#[test]
fn single_paths_of_a_diffuse_room_are_those_of_the_oracle() {
    for seed in [0, 1, 99] {
        assert_same(&scenes::diffuse_room(), seeded(seed), 6, |_| {});
    }
    let independent = PathSettings { sampler: Sampler::Independent, ..PathSettings::default() };
    assert_same(&scenes::diffuse_room(), independent, 6, |_| {});
}

#[test]
fn settings_change_single_paths_as_in_the_oracle() {
    let room = scenes::diffuse_room();
    assert_same(&room, PathSettings { roulette: false, ..seeded(3) }, 9, |_| {});
    assert_same(&room, PathSettings { clamp_indirect: 0.05, ..seeded(4) }, 6, |_| {});
    for depth in [0, 1, 2] {
        assert_same(&room, seeded(5), depth, |_| {});
    }
    assert_same(&room, seeded(6), 4, |view| view.quality.shadows = false);
}

#[test]
fn single_paths_of_every_camera_are_those_of_the_oracle() {
    let room = scenes::diffuse_room();
    for kind in [CameraKind::Orthographic { view_height: 4.0 }, CameraKind::Fisheye] {
        assert_same(&room, seeded(7), 4, |view| view.camera.kind = kind);
    }
    for focus_distance in [None, Some(3.0)] {
        assert_same(&room, seeded(8), 4, |view| view.lens = Lens { aperture: 0.2, focus_distance });
    }
}

#[test]
fn single_paths_through_glass_and_mirrors_are_those_of_the_oracle() {
    for seed in [0, 10] {
        assert_same(&scenes::room_of_mirrors(), seeded(seed), 10, |_| {});
    }
}

#[test]
fn single_paths_through_bodies_that_touch_are_those_of_the_oracle() {
    for seed in [0, 16] {
        assert_same(&touching::touching_glass(), seeded(seed), 12, |_| {});
    }
}

#[test]
fn single_paths_among_rough_surfaces_are_those_of_the_oracle() {
    for seed in [0, 17] {
        assert_same(&rough::rough_room(), seeded(seed), 10, |_| {});
    }
}

#[test]
fn single_paths_among_textures_of_roughness_are_those_of_the_oracle() {
    for seed in [0, 18] {
        assert_same(&rough::rough_textures(), seeded(seed), 8, |_| {});
    }
    let filter = Some(Filter::Nearest);
    assert_same(&rough::rough_textures(), seeded(19), 5, |view| view.quality.filter = filter);
}

#[test]
fn light_inside_of_a_body_is_absorbed_as_in_the_oracle() {
    assert_same(&scenes::water(), seeded(0), 8, |_| {});
}

#[test]
fn single_paths_under_a_panorama_are_those_of_the_oracle() {
    for seed in [0, 11] {
        assert_same(&scenes::outdoors(), seeded(seed), 6, |_| {});
    }
}

#[test]
fn single_paths_under_a_cube_map_are_those_of_the_oracle() {
    for seed in [0, 13] {
        assert_same(&scenes::under_a_cube_map(), seeded(seed), 6, |_| {});
    }
}

#[test]
fn one_of_many_lights_is_selected_as_in_the_oracle() {
    assert_same(&scenes::many_lights(), seeded(0), 5, |_| {});
}

#[test]
fn single_paths_among_objects_that_move_are_those_of_the_oracle() {
    for seed in [0, 12] {
        assert_same(&scenes::moving_room(), seeded(seed), 6, |_| {});
    }
    let room = scenes::moving_room();
    assert_same(&room, seeded(13), 6, |view| view.spin = 40.0);
    for kind in [CameraKind::Orthographic { view_height: 4.0 }, CameraKind::Fisheye] {
        assert_same(&room, seeded(14), 4, |view| view.camera.kind = kind);
    }
    assert_same(&room, seeded(15), 4, |view| view.lens = Lens { aperture: 0.2, focus_distance: None });
}

#[test]
fn single_paths_through_glass_that_moves_are_those_of_the_oracle() {
    assert_same(&scenes::moving_glass(), seeded(0), 10, |_| {});
}

#[test]
fn one_of_many_lamps_is_selected_as_in_the_oracle() {
    for seed in [0, 12] {
        assert_same(&scenes::many_lamps(), seeded(seed), 5, |_| {});
    }
    assert_same(&scenes::lamps_outdoors(), seeded(0), 5, |_| {});
}
