//! Phong in Hall's form, a file a term:
//!
//! ```text
//! I = c_d I_a + sum_j S_j A_j B_j I_j ( c_d max(0, N.L_j) + c_s max(0, N.H_j)^p_r )
//! ```
//!
//! [`background`] stands where nothing is hit, [`diffuse`] and [`specular`] are the two terms in the brackets,
//! [`visibility`] is S_j; A_j B_j I_j come from [`crate::light`].

mod background;
mod diffuse;
mod specular;
mod visibility;

use glam::{DVec3, Vec3};

use crate::frame::PreparedFrame;
use crate::light::Incidence;
use crate::render::RayCounts;
use crate::scene::Material;
use crate::trace::{Ray, Surface};

/// A light that adds less than this to every channel is left out, with its shadow ray: a thousand of them together
/// stay below a quarter of the darkest step of the 8-bit picture.
const LEAST_CONTRIBUTION: f32 = 1.0 / (1 << 24) as f32;

/// What a ray from the camera sees: linear RGB.
pub(crate) fn radiance(frame: &PreparedFrame, direction: DVec3, counts: &mut RayCounts) -> Vec3 {
    counts.primary += 1;
    let ray = Ray { origin: DVec3::ZERO, direction };
    match frame.closest(&ray) {
        Some(hit) => reflected(frame, &frame.surface(&ray, &hit), direction, counts),
        None => background::background(&frame.scene().background, direction),
    }
}

/// What a surface sends back along the ray that sees it.
fn reflected(frame: &PreparedFrame, surface: &Surface, direction: DVec3, counts: &mut RayCounts) -> Vec3 {
    let scene = frame.scene();
    let material = &scene.materials[surface.material as usize];
    let to_viewer = (-direction).normalize_or_zero().as_vec3();
    let mut sum = material.diffuse * scene.ambient;
    for light in &frame.lights {
        let Some(incidence) = light.incidence(surface.point) else { continue };
        let contribution = contribution(material, surface.ns, to_viewer, &incidence);
        if contribution.max_element() < LEAST_CONTRIBUTION {
            continue;
        }
        if !light.shadows || visibility::is_visible(frame, surface, &incidence, counts) {
            sum += contribution;
        }
    }
    sum
}

/// What a light adds if nothing is in its way. A light behind the surface adds nothing.
fn contribution(material: &Material, normal: Vec3, to_viewer: Vec3, incidence: &Incidence) -> Vec3 {
    let n_dot_l = normal.dot(incidence.direction);
    if n_dot_l <= 0.0 {
        return Vec3::ZERO;
    }
    let mut reflectance = diffuse::diffuse(material.diffuse, n_dot_l);
    if material.specular != Vec3::ZERO {
        reflectance += specular::specular(material, normal, incidence.direction, to_viewer);
    }
    incidence.radiance * reflectance
}
