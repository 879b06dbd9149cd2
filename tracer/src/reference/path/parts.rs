//! How a surface scatters light: diffuse reflection, a mirror direction and a refracted direction.
//!
//! One part is selected at random in proportion to the light that it scatters. F is the exact Fresnel share:
//!
//! ```text
//! diffuse   c_d / pi
//! mirror    c_r R, with `fresnel` c_r F R
//! glass     max(c_r, c_t) F R + c_t (1 - F) T
//! ```

use glam::DVec3;

use super::super::optics;
use super::super::surface::SurfacePoint;
use super::PathOracle;
use super::hemisphere::{cosine_density, cosine_direction};
use super::numbers::Numbers;
use super::step::Path;
use crate::sampler::Vertex;
use crate::scene::{Material, Shading};

/// Least cosine of the angle between the viewer and the normals of perfectly smooth parts: shading normals behind it are bent.
const LEAST_COSINE: f64 = 1e-3;

/// The parts of a surface at a point.
pub(super) struct Parts {
    /// Shading normal on the side of the viewer.
    normal: DVec3,
    /// Colours of diffuse, mirrored and refracted light.
    colors: [DVec3; 3],
    /// Directions of mirrored and refracted light; there is no refracted one in total internal reflection.
    mirrored: DVec3,
    refracted: Option<DVec3>,
}

/// A random direction.
pub(super) struct Scattered {
    pub direction: DVec3,
    /// f cos / density.
    pub weight: DVec3,
    /// Density over solid angle; infinite where no other direction was possible.
    pub density: f64,
    /// Whether it goes through the surface.
    pub through: bool,
}

/// A material that this oracle does not know.
pub(super) struct Unknown;

impl PathOracle<'_> {
    /// The parts of a surface that a path hits.
    ///
    /// # Errors
    /// [`Unknown`] for rough reflection.
    pub(super) fn parts(&self, path: &Path, surface: &SurfacePoint) -> Result<Parts, Unknown> {
        let materials = &self.oracle.scene.materials;
        let material = self.oracle.material(surface);
        let highlight = material.is_specular() && self.oracle.view.quality.shading == Shading::Full;
        if highlight || material.metallic_roughness.is_some() {
            return Err(Unknown);
        }
        let sides = path.bodies.sides(materials, surface.material_index, surface.front);
        let indices = if material.thin { [1.0, f64::from(material.ior)] } else { sides.indices };
        let (direction, ns) = (surface.direction, seen_normal(surface));
        let share = reflected_share(material, direction, ns, indices);
        let (c_r, c_t) = (material.reflect.as_dvec3(), material.transmit.as_dvec3());
        let transparent = material.is_transparent();
        let colors = [
            self.oracle.diffuse(surface),
            if transparent { c_r.max(c_t) * share } else { c_r * share },
            if transparent { c_t * (1.0 - share) } else { DVec3::ZERO },
        ];
        let mirrored = optics::leaving(optics::mirrored(direction, ns), surface.ng).normalize();
        let bent = if material.thin { Some(direction) } else { optics::bent(direction, ns, sides.indices) };
        let refracted = bent.map(|bent| optics::leaving(bent, -surface.ng).normalize());
        Ok(Parts { normal: surface.ns, colors, mirrored, refracted })
    }
}

impl Parts {
    /// f cos and the density over solid angle of a direction, without perfectly smooth parts.
    pub(super) fn eval(&self, direction: DVec3) -> (DVec3, f64) {
        let density = cosine_density(self.normal, direction);
        (self.colors[0] * density, self.probability(0) * density)
    }

    /// A random direction; `None` if the surface scatters no light.
    pub(super) fn scatter(&self, bounce: u32, numbers: &Numbers) -> Option<Scattered> {
        let select = numbers.at_vertex(bounce, Vertex::Lobe).x;
        let smooth = |direction: DVec3, part: usize, through: bool| Scattered {
            direction,
            weight: self.colors[part] / self.probability(part),
            density: f64::INFINITY,
            through,
        };
        let ends = [self.probability(0), self.probability(0) + self.probability(1)];
        if select < ends[0] {
            let direction = cosine_direction(self.normal, numbers.at_vertex(bounce, Vertex::Direction));
            let (value, density) = self.eval(direction);
            (density > 0.0).then(|| Scattered { direction, weight: value / density, density, through: false })
        } else if select < ends[1] {
            Some(smooth(self.mirrored, 1, false))
        } else if self.probability(2) > 0.0 {
            Some(smooth(self.refracted?, 2, true))
        } else {
            None
        }
    }

    /// Probability of a part: its share of the scattered light, channels averaged.
    fn probability(&self, part: usize) -> f64 {
        let light = self.colors.map(|color| color.element_sum());
        let total: f64 = light.iter().sum();
        if total > 0.0 { light[part] / total } else { 0.0 }
    }
}

/// Factor of mirrored light.
fn reflected_share(material: &Material, direction: DVec3, normal: DVec3, indices: [f64; 2]) -> f64 {
    if !(material.is_transparent() || material.fresnel) {
        return 1.0;
    }
    let share = if indices[0] == indices[1] {
        // No interface: nothing is reflected, along the surface neither.
        0.0
    } else {
        optics::reflected_share(direction, normal, indices)
    };
    // Light between the two surfaces of a sheet: a geometric series.
    if material.thin { 2.0 * share / (1.0 + share) } else { share }
}

/// The shading normal, bent towards the viewer where the viewer would see its back.
fn seen_normal(surface: &SurfacePoint) -> DVec3 {
    let missing = LEAST_COSINE + surface.ns.dot(surface.direction);
    if missing > 0.0 { (surface.ns - surface.direction * missing).normalize() } else { surface.ns }
}
