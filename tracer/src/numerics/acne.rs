//! Shadow acne and light leaks at surfaces: pixels compared with the oracle's, under the scene's own lights and under
//! grazing light.

use glam::{DVec3, Vec3};

use super::oracle::{affordable, chosen, compare};
use super::{Check, Effort, Outcome, Subject};
use crate::compile::CompileError;
use crate::frame::Basis;
use crate::scene::{Attenuation, Light, LightKind, Scene};

/// Elevations of a sun, in degrees above the horizontal plane.
const ELEVATIONS: [f64; 3] = [0.1, 1.0, 5.0];

/// Counts pixels that differ from the oracle's. Pixels in shadow with few neighbours in shadow are compared first,
/// because acne consists of them.
///
/// # Errors
/// A scene that cannot be traced.
pub fn acne(subject: &Subject, effort: &Effort) -> Result<Vec<Outcome>, CompileError> {
    let mut outcomes = vec![under("the scene's lights".to_owned(), subject, effort)?];
    for elevation in ELEVATIONS {
        let mut scene = subject.scene.clone();
        scene.lights = vec![sun(&scene, elevation)];
        outcomes.push(under(format!("a sun at {elevation} degrees"), &subject.with(scene), effort)?);
    }
    Ok(outcomes)
}

fn under(case: String, subject: &Subject, effort: &Effort) -> Result<Outcome, CompileError> {
    let picture = subject.rendered(effort.side)?;
    let mut unshadowed = subject.clone();
    unshadowed.scene.lights.iter_mut().for_each(|light| light.shadows = false);
    let lit = unshadowed.rendered(effort.side)?;
    let view = subject.view(effort.side);
    let specks = specks(&picture, &lit, view.width as usize);
    let pixels = chosen(&specks, picture.len() / 3, affordable(subject, effort));
    let comparison = compare(subject, &view, &picture, &pixels);
    Ok(Outcome {
        check: Check::Acne,
        case,
        unit: "pixels",
        tested: comparison.tested,
        at_edges: comparison.at_edges,
        wrong: comparison.wrong,
        failures: comparison.failures.iter().map(ToString::to_string).collect(),
    })
}

/// White directional light along the ground, from the right and from behind the camera.
fn sun(scene: &Scene, elevation: f64) -> Light {
    let Basis { forward, right, .. } = Basis::of(&scene.camera);
    let up = scene.camera.up.normalize_or(DVec3::Y);
    let flat = |v: DVec3| (v - up * v.dot(up)).normalize_or_zero();
    let (sine, cosine) = libm::sincos(elevation.to_radians());
    let along = (flat(right) * 0.6 - flat(forward) * 0.8).normalize_or(right);
    let to_light = (along * cosine + up * sine).normalize_or(up);
    Light {
        kind: LightKind::Directional { direction: -to_light },
        color: Vec3::ONE,
        attenuation: Attenuation::None,
        shadows: true,
        radius: 0.0,
        shadow_samples: None,
    }
}

/// Pixels in shadow with at most two neighbours of eight in shadow.
pub(super) fn specks(picture: &[u8], lit: &[u8], width: usize) -> Vec<usize> {
    let dark: Vec<bool> = picture.chunks_exact(3).zip(lit.chunks_exact(3)).map(|(a, b)| a != b).collect();
    let height = dark.len() / width.max(1);
    let is_dark = |x: usize, y: usize| x < width && y < height && dark[y * width + x];
    let neighbours = |pixel: usize| {
        let (x, y) = (pixel % width, pixel / width);
        // The neighbours of index 0 include `usize::MAX`, which is outside as well.
        let columns = [x.wrapping_sub(1), x, x + 1];
        let rows = [y.wrapping_sub(1), y, y + 1];
        let around = rows.into_iter().flat_map(|row| columns.into_iter().map(move |column| (column, row)));
        around.filter(|&place| place != (x, y) && is_dark(place.0, place.1)).count()
    };
    (0..dark.len()).filter(|&pixel| dark[pixel] && neighbours(pixel) <= 2).collect()
}
