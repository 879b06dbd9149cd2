//! The sources of a frame, with their power.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::ball::Ball;
use super::select::Choice;
use super::triangle::Triangle;
use super::{LightTable, SkyTable, Source, key};
use crate::compile::Item;
use crate::frame::PreparedFrame;
use crate::rays::PrimitiveId;
use crate::scene::{Attenuation, Background, Light, LightKind, Material, SkyPicture};

impl LightTable {
    /// The lights of a frame; `None` if the scene has none that paths could select.
    pub(crate) fn of(frame: &PreparedFrame) -> Option<Self> {
        let mut sources = Sources::default();
        sources.add_lights(frame);
        if frame.features.emissive {
            sources.add_emitters(frame);
        }
        let sky = sources.add_sky(frame);
        let Sources { list, powers } = sources;
        let extended: Vec<f64> = list
            .iter()
            .zip(&powers)
            .map(|((source, _), &power)| if matches!(source, Source::Delta(_)) { 0.0 } else { power })
            .collect();
        let (all, extended) = (Choice::by_power(&powers), Choice::by_power(&extended));
        if all.is_empty() {
            return None;
        }
        let mut primitives: Vec<(PrimitiveId, u32)> = Vec::new();
        for (index, (source, primitive)) in list.iter().enumerate() {
            if let (Source::Triangle(_) | Source::Sphere(..), Some(primitive)) = (source, primitive) {
                primitives.push((*primitive, index as u32));
            }
        }
        primitives.sort_by_key(|(primitive, _)| key(*primitive));
        let sources = list.into_iter().map(|(source, _)| source).collect();
        Some(Self { sources, primitives, sky, extended, all })
    }
}

/// Sources with their power: the light that they would send to the scene, red, green and blue averaged, in square eye units.
#[derive(Default)]
struct Sources {
    list: Vec<(Source, Option<PrimitiveId>)>,
    powers: Vec<f64>,
}

impl Sources {
    fn add(&mut self, source: Source, primitive: Option<PrimitiveId>, power: f64) {
        self.list.push((source, primitive));
        self.powers.push(if power.is_finite() { power } else { 0.0 });
    }

    /// Adds the lights of the scene.
    fn add_lights(&mut self, frame: &PreparedFrame) {
        for (index, (light, eye_light)) in frame.scene().lights.iter().zip(&frame.lights).enumerate() {
            let reach = reach_of(frame);
            let power =
                PI * PI * reach * reach * mean(light.color) * attenuation(light, reach / frame.per_unit);
            let index = index as u32;
            let source = match eye_light.emitter.position().filter(|_| eye_light.extent.is_some()) {
                Some(center) => Source::Lamp(Ball::new(center, light.radius * frame.per_unit), index),
                None => Source::Delta(index),
            };
            self.add(source, None, power);
        }
    }

    /// Adds emitting triangles and spheres.
    fn add_emitters(&mut self, frame: &PreparedFrame) {
        let scene = frame.scene();
        for item in frame.items.range() {
            match frame.items.get(item) {
                Item::Triangle(index) => {
                    let triangle = &frame.triangles[index];
                    let material = &scene.materials[scene.triangles[index].material as usize];
                    let id = PrimitiveId { item, triangle: 0 };
                    self.add_triangle(id, triangle.corners, triangle.normal, material);
                }
                Item::Sphere(index) => {
                    let sphere = &frame.spheres[index];
                    let described = &scene.spheres[index];
                    let material = &scene.materials[described.material as usize];
                    if is_source(material) && !described.inside_out {
                        let ball = Ball::new(sphere.center, sphere.radius);
                        let id = PrimitiveId { item, triangle: 0 };
                        let power = PI * mean(material.emission) * ball.area();
                        self.add(Source::Sphere(ball, material.emission), Some(id), power);
                    }
                }
                Item::Model(index) => self.add_model(frame, item, index),
                Item::Disk(_) => {}
            }
        }
    }

    fn add_model(&mut self, frame: &PreparedFrame, item: u32, index: usize) {
        let (scene, instance) = (frame.scene(), &frame.instances[index]);
        let slots = &scene.models[index].materials;
        if !slots.iter().any(|&slot| is_source(&scene.materials[slot as usize])) {
            return;
        }
        for triangle in 0..instance.mesh.triangle_count() as u32 {
            let material = &scene.materials[slots[instance.mesh.slot(triangle) as usize] as usize];
            let id = PrimitiveId { item, triangle };
            let corners = instance
                .mesh
                .corners(triangle)
                .map(|corner| instance.linear * corner.as_dvec3() + instance.translation);
            self.add_triangle(id, corners, frame.front_normal(id, DVec3::ZERO), material);
        }
    }

    fn add_triangle(&mut self, id: PrimitiveId, corners: [DVec3; 3], front: DVec3, material: &Material) {
        if !is_source(material) {
            return;
        }
        if let Some(triangle) = Triangle::new(corners, front, material.emission) {
            let power = PI * mean(material.emission) * triangle.area();
            self.add(Source::Triangle(triangle), Some(id), power);
        }
    }

    /// Adds the sky, if it is a panorama. Returns its table and its index.
    fn add_sky(&mut self, frame: &PreparedFrame) -> Option<(SkyTable, u32)> {
        let Background::Sky(sky) = &frame.scene().background else { return None };
        let SkyPicture::Panorama(texture) = sky.picture else { return None };
        let (texture, _) = &frame.textures()[texture as usize];
        let table = SkyTable::new(texture)?;
        let reach = reach_of(frame);
        let index = self.list.len() as u32;
        self.add(Source::Sky, None, PI * PI * reach * reach * table.mean() * f64::from(sky.strength));
        Some((table, index))
    }
}

/// Half of the diagonal of the finite primitives, in eye units; 1 without any.
fn reach_of(frame: &PreparedFrame) -> f64 {
    frame.bounds().map_or(1.0, |(lo, hi)| (hi - lo).length() / 2.0 * frame.per_unit)
}

/// Whether a material makes primitives sources.
fn is_source(material: &Material) -> bool {
    material.is_emissive() && material.emission_texture.is_none() && material.cutout.is_none()
}

fn mean(color: Vec3) -> f64 {
    f64::from(color.x + color.y + color.z) / 3.0
}

/// A_j at a distance in world units.
fn attenuation(light: &Light, distance: f64) -> f64 {
    match (light.kind, light.attenuation) {
        (LightKind::Directional { .. }, _) | (_, Attenuation::None) => 1.0,
        (_, Attenuation::InverseSquare) => 1.0 / (distance * distance),
        (_, Attenuation::Polynomial { constant, linear, quadratic }) => {
            1.0 / (constant + linear * distance + quadratic * distance * distance)
        }
    }
}
