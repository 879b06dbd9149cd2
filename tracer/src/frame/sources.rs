//! The lights that paths select from.

use std::f64::consts::PI;

use glam::DVec3;

use super::PreparedFrame;
use crate::compile::Item;
use crate::light::EyeLight;
use crate::light::table::{Beam, LightTable, SkyTable, Sources};
use crate::scene::{Attenuation, Background, Light, LightKind, Material, SkyPicture};

/// The lights of a frame; `None` if the scene has none that paths could select.
pub(super) fn light_table(frame: &PreparedFrame) -> Option<LightTable> {
    let scene = frame.scene();
    // Of scenes without finite primitives any size will do: powers are relative.
    let reach = frame.bounds().map_or(1.0, |(lo, hi)| (hi - lo).length() / 2.0 * frame.per_unit);
    let mut sources = Sources::new(reach);
    for (index, (light, placed)) in scene.lights.iter().zip(&frame.lights).enumerate() {
        let strength = light.color * attenuation(light, reach / frame.per_unit) as f32;
        let radius = if placed.extent.is_some() { light.radius * frame.per_unit } else { 0.0 };
        sources.add_light(index as u32, beam(light, placed), radius, strength);
    }
    if frame.features.emissive {
        frame.items.range().for_each(|item| add_item(frame, item, &mut sources));
    }
    if let Background::Sky(sky) = &scene.background {
        let texture = |index: u32| &frame.textures()[index as usize].0;
        let table = match sky.picture {
            SkyPicture::Panorama(panorama) => SkyTable::of_panorama(texture(panorama)),
            SkyPicture::Cubemap(faces) => SkyTable::of_cube_map(faces.map(texture)),
        };
        if let Some(table) = table {
            sources.add_sky(table, sky.strength);
        }
    }
    sources.into_table()
}

/// Where a light is, and what it lights.
fn beam(light: &Light, placed: &EyeLight) -> Option<Beam> {
    let position = placed.emitter.position()?;
    let (axis, half_angle) = match light.kind {
        LightKind::Spot { direction, beam_angle, .. } => {
            (direction.normalize_or_zero(), (beam_angle / 2.0).to_radians())
        }
        LightKind::Point { .. } | LightKind::Directional { .. } => (DVec3::Z, PI),
    };
    let falls = match light.attenuation {
        Attenuation::None => false,
        Attenuation::InverseSquare => true,
        Attenuation::Polynomial { quadratic, .. } => quadratic > 0.0,
    };
    Some(Beam { position, axis, half_angle, falls })
}

/// Adds an item that emits light.
fn add_item(frame: &PreparedFrame, item: u32, sources: &mut Sources) {
    let scene = frame.scene();
    let material = |index: u32| &scene.materials[index as usize];
    match frame.items.get(item) {
        Item::Triangle(index) => {
            let (triangle, material) = (&frame.triangles[index], material(scene.triangles[index].material));
            if is_source(material) {
                sources.add_triangle((item, 0), triangle.corners, triangle.normal, material.emission);
            }
        }
        Item::Sphere(index) => {
            let (sphere, described) = (&frame.spheres[index], &scene.spheres[index]);
            let material = material(described.material);
            if is_source(material) && !described.inside_out {
                sources.add_sphere((item, 0), sphere.center, sphere.radius, material.emission);
            }
        }
        Item::Model(index) => add_model(frame, item, index, sources),
        Item::Disk(_) => {}
    }
}

fn add_model(frame: &PreparedFrame, item: u32, index: usize, sources: &mut Sources) {
    let (scene, instance) = (frame.scene(), &frame.instances[index]);
    let slots = &scene.models[index].materials;
    if !slots.iter().any(|&slot| is_source(&scene.materials[slot as usize])) {
        return;
    }
    for triangle in 0..instance.mesh.triangle_count() as u32 {
        let material = &scene.materials[slots[instance.mesh.slot(triangle) as usize] as usize];
        if is_source(material) {
            let corners = instance.mesh.corners(triangle);
            let corners = corners.map(|corner| instance.linear * corner.as_dvec3() + instance.translation);
            let [a, b, c] = corners;
            let winding = (b - a).cross(c - a).normalize_or_zero();
            // A mirror turns the winding of the placed corners round, and leaves the front where it is.
            let front = if instance.linear.determinant() < 0.0 { -winding } else { winding };
            sources.add_triangle((item, triangle), corners, front, material.emission);
        }
    }
}

/// Whether a material makes primitives sources. Unlit ones show their diffuse colour as well, which no selected light has.
fn is_source(material: &Material) -> bool {
    material.is_emissive()
        && !material.unlit
        && material.emission_texture.is_none()
        && material.cutout.is_none()
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
