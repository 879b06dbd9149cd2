//! Value noise: random numbers on a lattice, smoothly between them.

use glam::DVec3;

use super::random::uniform;

/// Noise of a `kind` at a point, from 0 to 1; its cells have a side of 1.
pub(crate) fn noise(kind: u64, place: DVec3) -> f64 {
    let cell = place.floor();
    let t = place - cell;
    let t = t * t * (DVec3::splat(3.0) - t * 2.0);
    let corner = |dx: i64, dy: i64, dz: i64| {
        let [x, y, z] =
            [cell.x as i64 + dx, cell.y as i64 + dy, cell.z as i64 + dz].map(|c| (c + 4096) as u64);
        uniform(kind, x << 40 | y << 20 | z)
    };
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let edge = |dy, dz| mix(corner(0, dy, dz), corner(1, dy, dz), t.x);
    let face = |dz| mix(edge(0, dz), edge(1, dz), t.y);
    mix(face(0), face(1), t.z)
}

/// Noise in several octaves, each with half the amplitude and half the size of the octave before it. From 0 to 1.
pub(crate) fn octaves(kind: u64, count: u32, place: DVec3) -> f64 {
    let octave = |i: u32| {
        let finer = f64::from(1 << i);
        (noise(kind + u64::from(i), place * finer) / finer, 1.0 / finer)
    };
    let (sum, most) = (0..count).map(octave).fold((0.0, 0.0), |all, one| (all.0 + one.0, all.1 + one.1));
    sum / most
}
