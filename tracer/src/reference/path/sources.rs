//! The lights of paths: emitting triangles and spheres, lights of the scene, the sky. One is selected in proportion to its power, or by a
//! tree if there are many.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::super::Oracle;
use super::super::shading::attenuation;
use super::super::shape::{Primitive, Shape};
use super::light_tree::{Lamp, LightTree, Receiver};
use super::sky_light::SkyLight;
use crate::intersect::Primitive as Name;
use crate::scene::{Attenuation, Background, Light, LightKind, Material};

/// Most lights without extent whose light is computed at every first vertex.
const ALL_AT_FIRST: usize = 16;

/// The lights of a scene.
pub(super) struct Sources {
    list: Vec<Source>,
    /// The tree of those that have a place, if they are many.
    tree: Option<LightTree>,
    /// Indices of the lights of the scene that shine.
    pub lights: Vec<usize>,
    /// Whether the light of all lights without extent is computed at first vertices.
    pub all_at_first: bool,
}

/// A light, with its power relative to the others.
pub(super) struct Source {
    pub kind: Kind,
    power: f64,
    lamp: Option<Lamp>,
}

/// The kinds of light.
pub(super) enum Kind {
    /// The front of a triangle, or the outside of a sphere: index of the primitive.
    Surface(usize),
    /// A light of the scene that is a ball.
    Ball(usize),
    /// A light of the scene without extent.
    Point(usize),
    Sky(SkyLight),
}

/// Which lights are selected from.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Among {
    WithExtent,
    All,
}

/// A selected light with its probability.
pub(super) struct Selected<'a> {
    pub kind: &'a Kind,
    pub probability: f64,
}

impl Sources {
    /// The lights of the scene of an oracle.
    pub(super) fn of(oracle: &Oracle) -> Self {
        let scene = &oracle.scene;
        let shines = oracle.primitives.iter().any(|primitive| material(oracle, primitive).is_emissive())
            || matches!(scene.background, Background::Sky(_));
        let shining = if scene.has_default_light && shines { 0 } else { scene.lights.len() };
        let lights: Vec<usize> = (0..shining).collect();
        let mut list = Vec::new();
        // The light that an object of the size of the scene gets from lights that are no part of it.
        let reach = oracle.half_diagonal.unwrap_or(1.0);
        let section = PI * reach * reach;
        for &index in &lights {
            let light = &scene.lights[index];
            let kind = if oracle.is_ball(light) { Kind::Ball(index) } else { Kind::Point(index) };
            let power = PI * section * mean(light.color) * attenuation(light, reach);
            list.push(Source { kind, power, lamp: lamp(oracle, light, reach) });
        }
        list.extend(surfaces(oracle));
        if let Some(sky) = SkyLight::of(oracle) {
            let power = PI * section * sky.mean() * strength(oracle);
            list.push(Source { kind: Kind::Sky(sky), power, lamp: None });
        }
        let without_extent = lights.iter().filter(|&&index| !oracle.is_ball(&scene.lights[index]));
        let all_at_first = without_extent.count() <= ALL_AT_FIRST;
        let tree = tree(&list, reach);
        Self { list, tree, lights, all_at_first }
    }

    /// The lights that the vertex after a number of bounces selects from.
    pub(super) fn among(&self, bounce: u32) -> Among {
        if bounce == 0 && self.all_at_first { Among::WithExtent } else { Among::All }
    }

    /// The light that a point selects by a number in [0, 1).
    pub(super) fn select(&self, among: Among, to: &Receiver, number: f64) -> Option<Selected<'_>> {
        let in_tree = self.share_of_tree(among);
        if let Some(tree) = self.tree.as_ref().filter(|_| number < in_tree) {
            let (source, probability) = tree.select(among, to, number / in_tree)?;
            return Some(Selected { kind: &self.list[source].kind, probability: probability * in_tree });
        }
        // The powers outside of the tree follow its share.
        let total = self.total(among);
        let mut end = in_tree;
        self.outside().filter(|source| source.power_among(among) > 0.0).find_map(|source| {
            let probability = source.power_among(among) / total;
            end += probability;
            (number < end).then_some(Selected { kind: &source.kind, probability })
        })
    }

    /// Probability that a point selects one of the lights for which a condition holds.
    pub(super) fn probability(&self, among: Among, to: &Receiver, is: impl Fn(&Kind) -> bool) -> f64 {
        let total = self.total(among);
        let powers = self.outside().filter(|source| is(&source.kind));
        let power: f64 = powers.map(|source| source.power_among(among)).sum();
        let outside = if total > 0.0 { power / total } else { 0.0 };
        let in_tree = self.tree.iter().flat_map(|tree| {
            let sources = tree.sources.iter().filter(|&&source| is(&self.list[source].kind));
            sources.map(|&source| tree.probability(among, to, source) * self.share_of_tree(among))
        });
        outside + in_tree.sum::<f64>()
    }

    /// The sky, if it is a light.
    pub(super) fn sky(&self) -> Option<&SkyLight> {
        self.list.iter().find_map(|source| match &source.kind {
            Kind::Sky(sky) => Some(sky),
            _ => None,
        })
    }

    /// The sources that are not in the tree.
    fn outside(&self) -> impl Iterator<Item = &Source> {
        self.list.iter().filter(|source| self.tree.is_none() || source.lamp.is_none())
    }

    fn share_of_tree(&self, among: Among) -> f64 {
        let (total, outside) =
            (self.total(among), self.outside().map(|source| source.power_among(among)).sum::<f64>());
        if total > 0.0 { 1.0 - outside / total } else { 0.0 }
    }

    fn total(&self, among: Among) -> f64 {
        self.list.iter().map(|source| source.power_among(among)).sum()
    }
}

impl Source {
    fn power_among(&self, among: Among) -> f64 {
        match (among, &self.kind) {
            (Among::WithExtent, Kind::Point(_)) => 0.0,
            _ if self.power.is_finite() => self.power,
            _ => 0.0,
        }
    }
}

impl Oracle {
    /// Whether a light is a ball: without shadows it has no extent.
    pub(super) fn is_ball(&self, light: &Light) -> bool {
        let placed = !matches!(light.kind, LightKind::Directional { .. });
        placed && light.radius > 0.0 && light.shadows && self.view.quality.shadows
    }
}

/// Emitting triangles and spheres: models first, in the order of their meshes, then spheres, then triangles. Emission that a texture or a
/// cut-out changes from point to point is found by being hit, and so is that of unlit surfaces, and of spheres that shine inwards.
fn surfaces(oracle: &Oracle) -> Vec<Source> {
    let mut found = Vec::new();
    for (index, primitive) in oracle.primitives.iter().enumerate() {
        let material = material(oracle, primitive);
        let varies = material.emission_texture.is_some() || material.cutout.is_some();
        if !material.is_emissive() || varies || material.unlit {
            continue;
        }
        let radiance = mean(material.emission);
        let (area, lamp) = match &primitive.shape {
            Shape::Triangle { corners, skin, .. } => {
                let [a, b, c] = *corners;
                let doubled = (b - a).cross(c - a);
                let front = if skin.mirrored { -doubled } else { doubled }.normalize_or_zero();
                (doubled.length() / 2.0, Lamp::triangle(*corners, front, radiance))
            }
            Shape::Sphere { center, radius, inside_out: false, .. } => {
                let irradiance = [PI * radiance * radius * radius, 0.0];
                (4.0 * PI * radius * radius, Lamp::ball(*center, *radius, irradiance))
            }
            Shape::Sphere { .. } | Shape::Disk { .. } | Shape::Plane { .. } => continue,
        };
        let (power, lamp) = (PI * area * radiance, Some(lamp));
        found.push((primitive.name, Source { kind: Kind::Surface(index), power, lamp }));
    }
    found.sort_by_key(|(name, _)| match *name {
        Name::Model { model, triangle } => (0, model, triangle),
        Name::Sphere(index) => (1, index, 0),
        Name::Triangle(index) => (2, index, 0),
        Name::Disk(index) | Name::Plane(index) => (3, index, 0),
    });
    found.into_iter().map(|(_, source)| source).collect()
}

/// Where a light of the scene is, and what it lights; directional lights have no place.
fn lamp(oracle: &Oracle, light: &Light, reach: f64) -> Option<Lamp> {
    let (position, axis, half_angle) = match light.kind {
        LightKind::Point { position } => (position, DVec3::Z, PI),
        LightKind::Spot { position, direction, beam_angle, .. } => {
            (position, direction.normalize(), (beam_angle / 2.0).to_radians())
        }
        LightKind::Directional { .. } => return None,
    };
    let far = PI * mean(light.color) * attenuation(light, reach);
    let falls = match light.attenuation {
        Attenuation::None => false,
        Attenuation::InverseSquare => true,
        Attenuation::Polynomial { quadratic, .. } => quadratic > 0.0,
    };
    let irradiance = if falls { [far * reach * reach, 0.0] } else { [0.0, far] };
    let radius = if oracle.is_ball(light) { light.radius } else { 0.0 };
    let ball = Lamp::ball(position - oracle.view.camera.position, radius, irradiance);
    Some(Lamp { axis, angles: [half_angle.min(PI), 0.0], ..ball })
}

/// The tree of the lights that have a place and a power.
fn tree(list: &[Source], reach: f64) -> Option<LightTree> {
    let is_in_tree = |source: &Source| source.power_among(Among::All) > 0.0;
    let placed = list.iter().enumerate().filter(|(_, source)| is_in_tree(source));
    let lamps = placed.filter_map(|(index, source)| Some((index, source.lamp.clone()?)));
    LightTree::of(lamps.collect(), reach)
}

fn material<'a>(oracle: &'a Oracle, primitive: &Primitive) -> &'a Material {
    &oracle.scene.materials[primitive.material as usize]
}

fn strength(oracle: &Oracle) -> f64 {
    match &oracle.scene.background {
        Background::Sky(sky) => f64::from(sky.strength),
        Background::Color(_) | Background::Gradient { .. } => 0.0,
    }
}

/// Mean of the channels.
fn mean(color: Vec3) -> f64 {
    color.as_dvec3().dot(DVec3::ONE) / 3.0
}
