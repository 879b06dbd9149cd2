//! Angles of rotations, and scales of maps.

use super::*;

#[test]
fn angles_give_the_rotation_that_they_are_from() {
    let steps = [-180.0, -135.0, -90.0, -89.9999, -30.0, 0.0, 1e-7, 45.0, 90.0, 120.0, 180.0];
    for (x, y) in steps.iter().flat_map(|x| steps.iter().map(move |y| (*x, *y))) {
        for z in steps {
            let turn = rotation::of_model(DVec3::new(x, y, z));
            let again = rotation::of_model(degrees_of(turn));
            let error = [turn.x_axis - again.x_axis, turn.y_axis - again.y_axis, turn.z_axis - again.z_axis];
            assert!(error.iter().all(|column| column.length() < 1e-7), "{x} {y} {z}: {error:?}");
        }
    }
}

#[test]
fn a_scale_is_uniform_within_six_digits() {
    let scale_of = |linear: DMat3| Placement { linear, translate: DVec3::ZERO }.uniform_scale();
    let turn = rotation::of_model(DVec3::new(12.0, 34.0, 56.0));
    for factor in [1e-20, 0.5, 1.0, 3.0, 1e20] {
        let scale = scale_of(turn * factor).unwrap();
        assert!((scale / factor - 1.0).abs() < 1e-12, "{factor}: {scale}");
        assert!(scale_of(turn * -factor).is_some());
    }
    assert_eq!(scale_of(DMat3::IDENTITY), Some(1.0));
    let rounded = |linear: DMat3| {
        DMat3::from_cols_array(&linear.to_cols_array().map(|number| (number * 1e6).round() / 1e6))
    };
    assert!(scale_of(rounded(turn)).is_some());
    assert_eq!(scale_of(turn * DMat3::from_diagonal(DVec3::new(1.0, 1.0, 1.001))), None);
    assert_eq!(scale_of(DMat3::from_cols(DVec3::X, DVec3::new(0.001, 1.0, 0.0), DVec3::Z)), None);
}

#[test]
fn maps_that_cannot_be_inverted_are_not_usable() {
    let usable = |linear: DMat3, translate: DVec3| Placement { linear, translate }.is_usable();
    assert!(usable(DMat3::IDENTITY, DVec3::splat(1e30)));
    assert!(!usable(DMat3::IDENTITY, DVec3::splat(1.1e30)));
    assert!(!usable(DMat3::from_diagonal(DVec3::new(1.0, 0.0, 1.0)), DVec3::ZERO));
    assert!(!usable(DMat3::IDENTITY * 1e-200, DVec3::ZERO), "the determinant is zero");
    assert!(!usable(DMat3::IDENTITY * 2e30, DVec3::ZERO));
    assert!(usable(DMat3::IDENTITY * 1e-30, DVec3::ZERO));
}
