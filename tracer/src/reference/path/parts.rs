//! How a surface scatters light: diffuse and rough reflection, a mirrored direction, a refracted direction, refraction by microfacets.
//!
//! One part is selected at random in proportion to an estimate of the light that it scatters. F is the exact Fresnel share:
//!
//! ```text
//! diffuse   c_d / pi, below a lobe times the share that the lobe leaves
//! lobe      see `lobe`
//! mirror    c_r R, with `fresnel` c_r F R
//! glass     max(c_r, c_t) F R + c_t (1 - F) T
//! frosted   (1 - F) T at random microfacets
//! ```

use glam::{DVec2, DVec3};

use super::super::optics;
use super::super::surface::SurfacePoint;
use super::PathOracle;
use super::hemisphere::{cosine_density, cosine_direction};
use super::interface::Interface;
use super::lobe::{Left, Lobe};
use super::numbers::Numbers;
use super::step::Path;
use crate::sampler::Vertex;

/// Least cosine of the angle between the viewer and the normals of all parts but the diffuse one: shading normals behind it are bent.
const LEAST_COSINE: f64 = 1e-3;

/// Least share of frosted glass that counts as transmitted when a part is selected.
const LEAST_FROSTED: f64 = 0.25;

/// The parts of a surface at a point.
pub(super) struct Parts {
    /// Shading normal on the side of the viewer, and the geometric one.
    normal: DVec3,
    geometric: DVec3,
    /// Colour of diffuse light, and the share of it that a lobe above leaves.
    diffuse: DVec3,
    left: Option<Left>,
    /// Rough reflection.
    lobe: Option<Lobe>,
    /// Colours of mirrored and refracted light, and of light that microfacets refract.
    smooth: [DVec3; 2],
    frosted: DVec3,
    interface: Interface,
    /// Directions of mirrored and refracted light; there is no refracted one in total internal reflection.
    mirrored: DVec3,
    refracted: Option<DVec3>,
    /// Of diffuse, lobe, mirrored, refracted and frosted light.
    probabilities: [f64; 5],
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

impl PathOracle<'_> {
    /// The parts of a surface that a path hits.
    pub(super) fn parts(&self, path: &Path, surface: &SurfacePoint) -> Parts {
        let oracle = self.oracle;
        let material = oracle.material(surface);
        let sides = path.bodies.sides(&oracle.scene.materials, surface.material_index, surface.front);
        let interface = Interface::of(material, sides.indices);
        let (direction, ns) = (surface.direction, seen_normal(surface));
        let share = interface.share(-direction.dot(ns));
        let cosine = (-direction.dot(ns)).clamp(1e-6, 1.0);
        let coat = self.coat(surface);
        let base = oracle.diffuse(surface);
        let (below, left) = match &coat {
            Some(coat) => (base * coat.below * coat.left.at(cosine), Some(coat.left)),
            None => (base, None),
        };
        let mut smooth = [DVec3::ZERO; 2];
        let mut frosted = DVec3::ZERO;
        let mut of_lobe = DVec3::ZERO;
        let mut lobe = None;
        if material.metallic_roughness.is_none() {
            let (c_r, c_t) = (material.reflect.as_dvec3(), material.transmit.as_dvec3());
            let transparent = material.is_transparent();
            let factor = if transparent || material.fresnel { share } else { 1.0 };
            smooth[0] = if transparent { c_r.max(c_t) } else { c_r } * factor;
            smooth[1] = c_t * (1.0 - share);
        }
        if let Some(coat) = coat {
            let tinted = base * coat.glass;
            if coat.is_rough() {
                of_lobe = coat.albedo(cosine, share);
                frosted = tinted;
                lobe = Some(Lobe::new(coat, ns, -direction));
            } else {
                smooth[0] += coat.mirrored(cosine, share);
                smooth[1] += tinted * (1.0 - share);
            }
        }
        let estimates = [below, of_lobe, smooth[0], smooth[1], frosted * (1.0 - share).max(LEAST_FROSTED)];
        let mirrored = optics::leaving(optics::mirrored(direction, ns), surface.ng).normalize();
        let bent = if material.thin { Some(direction) } else { optics::bent(direction, ns, sides.indices) };
        let refracted = bent.map(|bent| optics::leaving(bent, -surface.ng).normalize());
        Parts {
            normal: surface.ns,
            geometric: surface.ng,
            diffuse: left.map_or(below, |left| below / left.mean()),
            left: left.map(|left| left.seen_from(ns)),
            lobe,
            smooth,
            frosted,
            interface,
            mirrored,
            refracted,
            probabilities: probabilities(estimates),
        }
    }
}

impl Parts {
    /// f cos and the density over solid angle of a direction, without perfectly smooth parts and light behind microfacets.
    pub(super) fn eval(&self, direction: DVec3) -> (DVec3, f64) {
        let cosine = cosine_density(self.normal, direction);
        let left = self.left.map_or(DVec3::ONE, |left| left.towards(direction));
        let (mut value, mut density) = (self.diffuse * cosine * left, self.probabilities[0] * cosine);
        if let Some(lobe) = &self.lobe {
            let (of_lobe, its_density) = lobe.eval(direction, &self.interface);
            value += of_lobe;
            density += self.probabilities[1] * its_density;
        }
        (value, density)
    }

    /// A random direction; `None` if the surface scatters no light.
    pub(super) fn scatter(&self, bounce: u32, numbers: &Numbers) -> Option<Scattered> {
        let at = numbers.at_vertex(bounce, Vertex::Direction);
        let part = self.select(numbers.at_vertex(bounce, Vertex::Lobe).x)?;
        let alone = |direction: DVec3, color: DVec3, through: bool| Scattered {
            direction,
            weight: color / self.probabilities[part],
            density: f64::INFINITY,
            through,
        };
        match part {
            0 => self.evaluated(cosine_direction(self.normal, at)),
            1 => self.evaluated(self.lobe.as_ref()?.sample(at)),
            2 => Some(alone(self.mirrored, self.smooth[0], false)),
            3 => Some(alone(self.refracted?, self.smooth[1], true)),
            _ => {
                let (direction, share) = self.through_facet(at)?;
                Some(alone(direction, self.frosted * share, true))
            }
        }
    }

    /// The part that a number from 0 to 1 selects.
    fn select(&self, number: f64) -> Option<usize> {
        let mut end = 0.0;
        self.probabilities.iter().position(|&probability| {
            end += probability;
            probability > 0.0 && number < end
        })
    }

    fn evaluated(&self, direction: DVec3) -> Option<Scattered> {
        let (value, density) = self.eval(direction);
        (density > 0.0).then(|| Scattered { direction, weight: value / density, density, through: false })
    }

    /// A direction behind a microfacet, on the far side of the surface, and the share of light that it transmits.
    fn through_facet(&self, at: DVec2) -> Option<(DVec3, f64)> {
        let (direction, share) = self.lobe.as_ref()?.refract(at, &self.interface)?;
        Some((optics::leaving(direction, -self.geometric), share))
    }
}

/// Shares of estimates of light, channels averaged.
fn probabilities(estimates: [DVec3; 5]) -> [f64; 5] {
    let light = estimates.map(DVec3::element_sum);
    let total: f64 = light.iter().sum();
    light.map(|light| if total > 0.0 { light / total } else { 0.0 })
}

/// The shading normal, bent towards the viewer where the viewer would see its back.
fn seen_normal(surface: &SurfacePoint) -> DVec3 {
    let missing = LEAST_COSINE + surface.ns.dot(surface.direction);
    if missing > 0.0 { (surface.ns - surface.direction * missing).normalize() } else { surface.ns }
}
