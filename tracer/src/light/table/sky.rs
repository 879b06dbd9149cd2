//! Directions to a sky, by the light that comes from there: to a panorama here, to a cube map by `cube`.

use std::f32::consts::{FRAC_1_PI, PI, TAU};
use std::sync::Arc;

use super::LightSamples;
use super::cube::CubeTable;
use crate::simd::math::{atan2, sin_cos};
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, SimdBase, SimdFloat, each_bit, f32x16, splat, three};
use crate::texture::Texture;

/// Least sine of the angle to the poles that densities are computed for: there the picture is infinitely wide.
const LEAST_SINE: f32 = 1e-4;

/// Selects directions to a sky.
#[derive(Clone, Debug)]
pub(crate) struct SkyTable(Picture);

#[derive(Clone, Debug)]
enum Picture {
    Panorama(Arc<Texture>),
    Cube(Box<CubeTable>),
}

impl SkyTable {
    /// The table of a panorama; `None` if it is black.
    pub(crate) fn of_panorama(panorama: &Arc<Texture>) -> Option<Self> {
        panorama.light().map(|_| Self(Picture::Panorama(Arc::clone(panorama))))
    }

    /// The table of a cube map with the faces +X, -X, +Y, -Y, +Z, -Z; `None` if it is black.
    pub(crate) fn of_cube_map(faces: [&Arc<Texture>; 6]) -> Option<Self> {
        CubeTable::new(faces).map(|cube| Self(Picture::Cube(Box::new(cube))))
    }

    /// Mean of red, green and blue, averaged over all directions.
    pub(super) fn mean(&self) -> f64 {
        use std::f64::consts::{FRAC_PI_2, PI};
        match &self.0 {
            // The weights have the area on the sphere, whose mean over the rows is 2 / pi.
            Picture::Panorama(panorama) => {
                panorama.light().map_or(0.0, |light| light.total() * FRAC_PI_2 / 3.0)
            }
            Picture::Cube(cube) => cube.total() / (12.0 * PI),
        }
    }

    /// Samples directions of some lanes; `rotation` are sine and cosine of the sky's rotation about +Y.
    #[inline(always)]
    pub(super) fn sample<S: Simd>(
        &self,
        simd: S,
        [sin, cos]: [f32; 2],
        lanes: u32,
        at: [f32x16<S>; 2],
        samples: &mut LightSamples,
    ) {
        let panorama = match &self.0 {
            Picture::Panorama(panorama) => panorama,
            Picture::Cube(cube) => return sample_cube(simd, cube, [sin, cos], lanes, at, samples),
        };
        let Some(light) = panorama.light() else { return };
        let at = [at[0].to_array(), at[1].to_array()];
        let (mut turn, mut rise) = (Lanes::ZERO, Lanes([0.5; LANES]));
        let mut density = Lanes::ZERO;
        for lane in each_bit(lanes) {
            let place = light.place([at[0][lane], at[1][lane]]);
            (turn.0[lane], rise.0[lane]) = (place.at[0], place.at[1]);
            density.0[lane] = place.density;
        }
        let (turn, rise) = (turn.load(simd), rise.load(simd));
        let [turn_sin, turn_cos] = sin_cos(simd, turn * splat(simd, TAU) - splat(simd, PI));
        let [rise_sin, rise_cos] = sin_cos(simd, rise * splat(simd, PI));
        let (x, z) = (rise_sin * turn_sin, -(rise_sin * turn_cos));
        let (sin, cos) = (splat(simd, sin), splat(simd, cos));
        let direction = Vec3x16([cos * x + sin * z, -rise_cos, cos * z - sin * x]).normalize(simd);
        let density = density.load(simd) * per_solid_angle(simd, rise_sin);
        put_sky(direction, density, lanes, samples);
    }

    /// Density over solid angle with which [`SkyTable::sample`] selects directions, given as unit vectors.
    #[inline(always)]
    pub(super) fn density<S: Simd>(&self, simd: S, [sin, cos]: [f32; 2], direction: Vec3x16<S>) -> f32x16<S> {
        let panorama = match &self.0 {
            Picture::Panorama(panorama) => panorama,
            Picture::Cube(cube) => return density_of_cube(simd, cube, [sin, cos], direction),
        };
        let Some(light) = panorama.light() else { return splat(simd, 0.0) };
        let [x, y, z] = direction.0;
        let (sin, cos) = (splat(simd, sin), splat(simd, cos));
        let (x, z) = (cos * x - sin * z, sin * x + cos * z);
        let turn = atan2(simd, x, -z) * splat(simd, 0.5 * FRAC_1_PI) + splat(simd, 0.5);
        let sine = (x * x + z * z).sqrt();
        let rise = atan2(simd, sine, -y) * splat(simd, FRAC_1_PI);
        let (turn, rise) = (turn.to_array(), rise.to_array());
        let density = Lanes(std::array::from_fn(|lane| light.density([turn[lane], rise[lane]])));
        density.load(simd) * per_solid_angle(simd, sine)
    }
}

/// Puts directions and densities into some lanes.
#[inline(always)]
fn put_sky<S: Simd>(direction: Vec3x16<S>, density: f32x16<S>, lanes: u32, samples: &mut LightSamples) {
    let direction = three!(axis => direction.0[axis].to_array());
    let density = density.to_array();
    for lane in each_bit(lanes) {
        for axis in 0..3 {
            samples.direction[axis].0[lane] = direction[axis][lane];
        }
        samples.distance[lane] = f64::INFINITY;
        samples.density.0[lane] = density[lane];
    }
    samples.live |= lanes;
    samples.sky |= lanes;
    samples.shadows |= lanes;
}

/// [`SkyTable::sample`] of a cube map.
#[inline(never)]
fn sample_cube<S: Simd>(
    simd: S,
    cube: &CubeTable,
    [sin, cos]: [f32; 2],
    lanes: u32,
    at: [f32x16<S>; 2],
    samples: &mut LightSamples,
) {
    let at = [at[0].to_array(), at[1].to_array()];
    let mut found = [Lanes([1.0; LANES]), Lanes::ZERO, Lanes::ZERO];
    let (mut density, mut sampled) = (Lanes::ZERO, 0);
    for lane in each_bit(lanes) {
        let Some(sample) = cube.sample([at[0][lane], at[1][lane]]) else { continue };
        for axis in 0..3 {
            found[axis].0[lane] = sample.direction[axis];
        }
        density.0[lane] = sample.density;
        sampled |= 1 << lane;
    }
    let [x, y, z] = Vec3x16::load(simd, &found).0;
    let (sin, cos) = (splat(simd, sin), splat(simd, cos));
    let direction = Vec3x16([cos * x + sin * z, y, cos * z - sin * x]).normalize(simd);
    put_sky(direction, density.load(simd), sampled, samples);
}

/// [`SkyTable::density`] of a cube map.
#[inline(never)]
fn density_of_cube<S: Simd>(
    simd: S,
    cube: &CubeTable,
    [sin, cos]: [f32; 2],
    direction: Vec3x16<S>,
) -> f32x16<S> {
    let [x, y, z] = direction.0;
    let (sin, cos) = (splat(simd, sin), splat(simd, cos));
    let turned_back = [cos * x - sin * z, y, sin * x + cos * z];
    let turned_back = three!(axis => turned_back[axis].to_array());
    let at = |lane: usize| cube.density(three!(axis => turned_back[axis][lane]));
    Lanes(std::array::from_fn(at)).load(simd)
}

/// Density over solid angle where that over the picture is 1: 1 / (2 pi^2 sin), by the sine of the angle to the poles.
#[inline(always)]
fn per_solid_angle<S: Simd>(simd: S, sine: f32x16<S>) -> f32x16<S> {
    splat(simd, 1.0 / (TAU * PI)) / sine.max(splat(simd, LEAST_SINE))
}
