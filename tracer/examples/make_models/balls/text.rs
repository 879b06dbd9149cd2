//! Spheres as lines of a scene file.

use glam::DVec3;

/// A sphere with the name of its material.
pub(super) struct Ball {
    pub(super) center: DVec3,
    pub(super) radius: f64,
    pub(super) material: String,
}

impl Ball {
    /// An entry of the array `sphere`, on a line of its own and without spaces. Lengths have three decimals.
    fn line(&self) -> String {
        let [x, y, z] = self.center.to_array().map(number);
        let radius = number(self.radius);
        format!("{{center=[{x},{y},{z}],radius={radius},material=\"{}\"}},\n", self.material)
    }
}

/// The spheres as the array `sphere`, in fewer bytes than `[[sphere]]` tables. It belongs before the first table.
pub(super) fn array(balls: &[Ball]) -> String {
    let lines: String = balls.iter().map(Ball::line).collect();
    format!("sphere = [\n{lines}]\n")
}

/// At most three decimals, without the sign of a zero.
pub(super) fn number(value: f64) -> String {
    let text = format!("{:.3}", (value * 1000.0).round() / 1000.0 + 0.0);
    let short = text.trim_end_matches('0');
    if short.ends_with('.') { format!("{short}0") } else { short.to_owned() }
}

/// A colour or another list of numbers.
pub(super) fn list(values: [f64; 3]) -> String {
    format!("[{}]", values.map(number).join(", "))
}
