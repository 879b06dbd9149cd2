//! Rotations by degrees. Made of `libm`'s sine and cosine, so that every platform turns by the same bits.

use glam::{DMat3, DVec3};

/// Sine and cosine of an angle in degrees; exact at multiples of 90, where radians are not.
pub fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    // Remainders are exact, so whole turns cost no digits.
    let within_turn = degrees % 360.0;
    let quarters = (within_turn / 90.0).round();
    let (sin, cos) = libm::sincos((within_turn - 90.0 * quarters).to_radians());
    match (quarters as i32).rem_euclid(4) {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// Turns about the X axis, right-handed.
pub fn about_x(degrees: f64) -> DMat3 {
    let (s, c) = sin_cos_degrees(degrees);
    DMat3::from_cols(DVec3::X, DVec3::new(0.0, c, s), DVec3::new(0.0, -s, c))
}

/// Turns about the Y axis, right-handed.
pub fn about_y(degrees: f64) -> DMat3 {
    let (s, c) = sin_cos_degrees(degrees);
    DMat3::from_cols(DVec3::new(c, 0.0, -s), DVec3::Y, DVec3::new(s, 0.0, c))
}

/// Turns about the Z axis, right-handed.
pub fn about_z(degrees: f64) -> DMat3 {
    let (s, c) = sin_cos_degrees(degrees);
    DMat3::from_cols(DVec3::new(c, s, 0.0), DVec3::new(-s, c, 0.0), DVec3::Z)
}

/// A model's rotation: about x, then y, then z.
pub fn of_model(degrees: DVec3) -> DMat3 {
    about_z(degrees.z) * about_y(degrees.y) * about_x(degrees.x)
}

/// A camera's rotation `[pitch, yaw, roll]`: roll about Z, then pitch about X, then yaw about Y.
pub fn of_camera(pitch: f64, yaw: f64, roll: f64) -> DMat3 {
    about_y(yaw) * about_x(pitch) * about_z(roll)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarter_turns_are_exact() {
        for (degrees, expected) in [
            (0.0, (0.0, 1.0)),
            (90.0, (1.0, 0.0)),
            (180.0, (0.0, -1.0)),
            (270.0, (-1.0, 0.0)),
            (-90.0, (-1.0, 0.0)),
            (36_000_090.0, (1.0, 0.0)),
            (-540.0, (0.0, -1.0)),
        ] {
            assert_eq!(sin_cos_degrees(degrees), expected, "{degrees}");
        }
    }

    #[test]
    fn other_angles_are_those_of_the_library() {
        for i in -800..800 {
            let degrees = f64::from(i) * 0.9;
            let (sin, cos) = sin_cos_degrees(degrees);
            assert!((sin - degrees.to_radians().sin()).abs() < 1e-14, "{degrees}");
            assert!((cos - degrees.to_radians().cos()).abs() < 1e-14, "{degrees}");
        }
    }

    #[test]
    fn axes_turn_right_handed() {
        assert_eq!(about_x(90.0) * DVec3::Y, DVec3::Z);
        assert_eq!(about_y(90.0) * DVec3::Z, DVec3::X);
        assert_eq!(about_z(90.0) * DVec3::X, DVec3::Y);
    }

    #[test]
    fn models_turn_about_x_then_y_then_z() {
        // Y goes to Z about x, Z goes to X about y, X goes to Y about z.
        assert_eq!(of_model(DVec3::splat(90.0)) * DVec3::Y, DVec3::Y);
        // X stays about x, goes to -Z about y, and stays there about z.
        assert_eq!(of_model(DVec3::splat(90.0)) * DVec3::X, DVec3::NEG_Z);
    }

    #[test]
    fn cameras_roll_then_pitch_then_yaw() {
        // A positive pitch looks up, a positive yaw looks to the left, a positive roll tips the head to the left.
        assert_eq!(of_camera(90.0, 0.0, 0.0) * DVec3::NEG_Z, DVec3::Y);
        assert_eq!(of_camera(0.0, 90.0, 0.0) * DVec3::NEG_Z, DVec3::NEG_X);
        assert_eq!(of_camera(0.0, 0.0, 90.0) * DVec3::Y, DVec3::NEG_X);
        // Up goes to -X by the roll, stays there in the pitch, and goes to Z by the yaw.
        assert_eq!(of_camera(90.0, 90.0, 90.0) * DVec3::Y, DVec3::Z);
    }
}
