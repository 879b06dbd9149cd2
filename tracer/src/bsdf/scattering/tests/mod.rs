//! Physics of all materials: furnace, reciprocity, and directions that follow their density.

mod directions;
mod furnace;

use glam::{DVec3, Vec3};

use super::parts::Parts;
use super::recipe::Recipe;
use super::{Scattered, Scattering, Setting};
use crate::scene::{Material, MetallicRoughness};
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, SimdBase, all, best, dispatch, f32x16, splat, three};

const BLACK: Material = Material { diffuse: Vec3::ZERO, specular: Vec3::ZERO, ..Material::NEUTRAL };

fn white(color: f32) -> Material {
    Material { diffuse: Vec3::splat(color), ..BLACK }
}

fn blinn_phong(diffuse: f32, specular: f32, exponent: f32) -> Material {
    Material { specular: Vec3::splat(specular), exponent, ..white(diffuse) }
}

/// White metallic-roughness; the index of refraction is 1.5.
fn metallic_roughness(metallic: f32, roughness: f32, transmission: f32) -> Material {
    let model = MetallicRoughness { metallic, roughness, transmission, specular_factor: 1.0, texture: None };
    Material { metallic_roughness: Some(model), ..white(1.0) }
}

fn glass() -> Material {
    Material { transmit: Vec3::ONE, ..BLACK }
}

/// A vector at an angle to z, given by its cosine, and at an angle around it.
fn at(cosine: f64, turn: f64) -> DVec3 {
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    DVec3::new(sine * libm::cos(turn), sine * libm::sin(turn), cosine)
}

/// The normal of all tests: along no axis.
fn normal() -> DVec3 {
    DVec3::new(0.3, -0.5, 0.8).normalize()
}

/// A vector out of the frame of the normal, and into it.
fn turned(vector: DVec3) -> DVec3 {
    let tangent = normal().cross(DVec3::X).normalize();
    tangent * vector.x + normal().cross(tangent) * vector.y + normal() * vector.z
}

fn back(vector: DVec3) -> DVec3 {
    let tangent = normal().cross(DVec3::X).normalize();
    DVec3::new(vector.dot(tangent), vector.dot(normal().cross(tangent)), vector.dot(normal()))
}

/// A surface of one material, seen from a cosine to its normal, on the side of n_from.
#[derive(Clone, Copy)]
struct Seen {
    material: Material,
    /// Factors of the roughness and of the share of metal by a texture.
    factors: [f32; 2],
    viewer: DVec3,
    eta: f32,
}

fn seen(material: Material, cosine: f64, eta: f32) -> Seen {
    Seen { material, factors: [1.0; 2], viewer: turned(at(cosine, 0.7)), eta }
}

#[inline(always)]
fn splat_vector<S: Simd>(simd: S, vector: DVec3) -> Vec3x16<S> {
    Vec3x16::splat(simd, vector.as_vec3().to_array())
}

impl Seen {
    #[inline(always)]
    fn scattering<S: Simd>(&self, simd: S) -> Scattering<S> {
        let geometric = splat_vector(simd, normal());
        let setting = Setting {
            to_viewer: splat_vector(simd, self.viewer),
            geometric,
            normals: geometric,
            eta: Lanes([self.eta; LANES]),
        };
        let recipe = Recipe::of(&self.material, true);
        let diffuse = Vec3x16::splat(simd, self.material.diffuse.to_array());
        let mut numbers = Recipe::splat(simd, &recipe);
        let [roughness, metal] = self.factors;
        numbers.multiply([splat(simd, roughness), splat(simd, metal)]);
        let parts =
            recipe.is_more_than_diffuse().then(|| Box::new(Parts::new(simd, &numbers, diffuse, &setting)));
        Scattering { normals: geometric, diffuse, parts }
    }
}

/// Red value and density of a direction.
fn eval(seen: &Seen, direction: DVec3) -> [f64; 2] {
    #[inline(always)]
    fn with<S: Simd>(simd: S, seen: &Seen, direction: DVec3) -> [f32; 2] {
        let evaluated = seen.scattering(simd).eval(simd, splat_vector(simd, direction));
        [evaluated.value.0[0][0], evaluated.density[0]]
    }
    dispatch!(best(), simd => with(simd, seen, direction)).map(f64::from)
}

/// A random direction.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sample {
    direction: DVec3,
    weight: [f32; 3],
    density: f32,
    alive: bool,
    refracted: bool,
}

/// Directions for some random numbers.
fn sample(level: crate::simd::Level, seen: &Seen, numbers: &[[f32; LANES]; 3]) -> [Sample; LANES] {
    #[inline(always)]
    fn with<S: Simd>(simd: S, seen: &Seen, numbers: &[[f32; LANES]; 3]) -> [Sample; LANES] {
        let [part, u, v] = three!(i => f32x16::load_array(simd, numbers[i]));
        let Scattered { direction, weight, density, scattered, refracted } =
            seen.scattering(simd).sample(simd, part, [u, v]);
        std::array::from_fn(|lane| Sample {
            direction: DVec3::from_array(three!(i => f64::from(direction.0[i][lane]))),
            weight: three!(i => weight.0[i][lane]),
            density: density[lane],
            alive: scattered >> lane & 1 == 1,
            refracted: refracted >> lane & 1 == 1,
        })
    }
    dispatch!(level, simd => with(simd, seen, numbers))
}

/// Additive recurrence with the roots of x^4 = x + 1: evenly spread in three dimensions (Roberts, "The unreasonable effectiveness of
/// quasirandom sequences", 2018).
fn numbers(index: usize) -> [f32; 3] {
    let g = 1.220_744_084_605_759_5_f64;
    [1.0 / g, 1.0 / (g * g), 1.0 / (g * g * g)].map(|step| {
        let x = 0.5 + step * (index + 1) as f64;
        ((x - x.floor()) as f32).min(1.0 - f32::EPSILON)
    })
}

fn numbers_of_block(block: usize) -> [[f32; LANES]; 3] {
    let mut all = [[0.0; LANES]; 3];
    for lane in 0..LANES {
        for (row, number) in all.iter_mut().zip(numbers(block * LANES + lane)) {
            row[lane] = number;
        }
    }
    all
}

fn samples(seen: &Seen, blocks: usize) -> impl Iterator<Item = Sample> {
    (0..blocks).flat_map(move |block| sample(best(), seen, &numbers_of_block(block)))
}

/// Mean red weight of directions on the side that they belong to: the albedo.
fn albedo(seen: &Seen, blocks: usize) -> f64 {
    let side = |sample: &Sample| (sample.direction.dot(normal()) < 0.0) == sample.refracted;
    let weight = |s: Sample| if s.alive && side(&s) { f64::from(s.weight[0]) } else { 0.0 };
    samples(seen, blocks).map(weight).sum::<f64>() / (blocks * LANES) as f64
}

/// Materials without perfectly smooth parts.
fn rough() -> Vec<Material> {
    let plastic = Material { diffuse: Vec3::new(0.2, 0.9, 0.1), ..metallic_roughness(0.3, 0.4, 0.0) };
    let dull = MetallicRoughness { specular_factor: 0.3, ..plastic.metallic_roughness.unwrap() };
    vec![
        white(0.7),
        blinn_phong(0.4, 0.3, 20.0),
        blinn_phong(0.0, 0.9, 300.0),
        metallic_roughness(1.0, 0.25, 0.0),
        metallic_roughness(1.0, 1.0, 0.0),
        metallic_roughness(0.0, 0.5, 0.0),
        metallic_roughness(1.0, 0.6, 0.0),
        plastic,
        Material { metallic_roughness: Some(dull), ..plastic },
    ]
}

#[test]
fn reflection_is_reciprocal() {
    for material in rough() {
        for (from, to, turn) in [(0.2, 0.9, 2.0), (0.5, 0.6, 3.0), (0.05, 0.4, 3.6), (1.0, 0.3, 0.0)] {
            let (v, l) = (turned(at(from, 0.0)), turned(at(to, turn)));
            let seen = seen(material, 1.0, 1.0);
            let there = eval(&Seen { viewer: v, ..seen }, l)[0] / to;
            let back = eval(&Seen { viewer: l, ..seen }, v)[0] / from;
            assert!((there - back).abs() <= 1e-3 * there.max(1e-3), "{material:?}: {there} and {back}");
        }
    }
}

#[test]
fn weights_are_values_over_densities() {
    for material in rough() {
        let seen = seen(material, 0.6, 1.0);
        for sample in samples(&seen, 64).filter(|s| s.alive && s.direction.dot(normal()) > 1e-3) {
            let [value, density] = eval(&seen, sample.direction);
            let [weight, found] = [f64::from(sample.weight[0]), f64::from(sample.density)];
            assert!((density / found - 1.0).abs() < 1e-3, "{density} and {found} of {material:?}");
            assert!((value / density - weight).abs() < 1e-3 * weight.max(1e-3));
        }
    }
}

#[test]
fn samples_have_the_same_bits_on_every_level() {
    let clear = [
        glass(),
        metallic_roughness(0.1, 0.6, 0.8),
        Material { thin: true, ..metallic_roughness(0.0, 0.3, 1.0) },
        Material { reflect: Vec3::splat(0.5), ..blinn_phong(0.3, 0.1, 40.0) },
    ];
    for material in rough().into_iter().chain(clear) {
        for cosine in [1e-4, 0.3, 1.0] {
            let seen = seen(material, cosine, 1.0 / 1.5);
            for block in 0..16 {
                let numbers = numbers_of_block(block);
                let first = sample(all()[0], &seen, &numbers);
                assert!(first.iter().all(|s| s.weight.iter().all(|w| w.is_finite() && *w >= 0.0)));
                assert!(first.iter().all(|s| (s.direction.length() - 1.0).abs() < 1e-5));
                for level in all() {
                    assert_eq!(sample(level, &seen, &numbers), first, "{material:?} at {cosine}");
                }
            }
        }
    }
}

/// A diffuse point scatters the same whatever materials the other points of its block have.
#[test]
fn diffuse_points_do_not_depend_on_their_neighbours() {
    #[inline(always)]
    fn with<S: Simd>(simd: S, mixed: bool) -> [Sample; LANES] {
        let viewer = splat_vector(simd, turned(at(0.4, 1.0)));
        let geometric = splat_vector(simd, normal());
        let setting = Setting { to_viewer: viewer, geometric, normals: geometric, eta: Lanes([1.0; LANES]) };
        let mut recipe = Recipe::splat(simd, &Recipe::of(&white(0.7), true));
        let other = Recipe::of(&blinn_phong(0.7, 0.3, 30.0), true);
        recipe.put(simd, crate::simd::mask_of(simd, 0xff00), &other);
        let diffuse = Vec3x16::splat(simd, [0.7; 3]);
        let parts = mixed.then(|| Box::new(Parts::new(simd, &recipe, diffuse, &setting)));
        let scattering = Scattering { normals: geometric, diffuse, parts };
        let numbers = numbers_of_block(3);
        let [part, u, v] = three!(i => f32x16::load_array(simd, numbers[i]));
        let found = scattering.sample(simd, part, [u, v]);
        let value = scattering.eval(simd, found.direction);
        std::array::from_fn(|lane| Sample {
            direction: DVec3::from_array(three!(i => f64::from(found.direction.0[i][lane]))),
            weight: [found.weight.0[0][lane], value.value.0[1][lane], value.density[lane]],
            density: found.density[lane],
            alive: found.scattered >> lane & 1 == 1,
            refracted: found.refracted >> lane & 1 == 1,
        })
    }
    let alone = dispatch!(best(), simd => with(simd, false));
    let mixed = dispatch!(best(), simd => with(simd, true));
    assert_eq!(alone[..8], mixed[..8]);
    assert_ne!(alone[8..], mixed[8..]);
}

/// Smooth meshes are seen at points whose shading normal looks away: they are not black.
#[test]
fn normals_that_look_away_reflect() {
    let level = best();
    let found = dispatch!(level, simd => {
        let away = turned(at(-0.2, 0.0));
        let viewer = turned(at(0.05, 0.0));
        let setting = Setting {
            to_viewer: splat_vector(simd, viewer),
            geometric: splat_vector(simd, normal()),
            normals: splat_vector(simd, away),
            eta: Lanes([1.0; LANES]),
        };
        let mirror = Material { reflect: Vec3::ONE, ..BLACK };
        let recipe = Recipe::splat(simd, &Recipe::of(&mirror, true));
        let parts = Parts::new(simd, &recipe, Vec3x16::splat(simd, [0.0; 3]), &setting);
        let half = splat(simd, 0.5);
        let found = parts.sample(simd, half, [half, half]);
        let direction = DVec3::from_array(three!(i => f64::from(found.direction.0[i][0])));
        (found.scattered, found.weight.0[0][0], direction)
    });
    assert_eq!(found.0, 0xffff);
    assert!((found.1 - 1.0).abs() < 1e-6 && found.2.dot(normal()) > 0.0);
}
