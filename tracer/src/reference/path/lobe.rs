//! Rough reflection, and the share of light that reaches a diffuse surface below: with
//! F(x) = (x + (1 - x) (1 - v.h)^5) (1 + x (s(v) s(l) - 1)), the exact Fresnel share Fx, f1 of `facets` and s, a, b of `energy`:
//!
//! ```text
//! f     = f1 (m F(base) + w F(d)) + t Fx p / cos
//! left  = q + r (a + F0 b)
//! ```
//!
//! Glass reflects by the density p of mirrored directions; those below the surface are mirrored at it.

use glam::{DVec2, DVec3};

use super::super::optics;
use super::super::surface::SurfacePoint;
use super::PathOracle;
use super::energy::{LobeTerms, Row};
use super::facets::{FacetReflection, Facets, LEAST_ALPHA};
use super::interface::Interface;
use crate::scene::Shading;

/// Coefficients of the reflection above a diffuse surface.
#[derive(Clone, Copy)]
pub(super) struct Coat {
    alpha: f64,
    /// Shares of metal, opaque dielectric and glass, and the reflectances of the first two at straight incidence.
    metal: f64,
    metal_straight: DVec3,
    opaque: f64,
    opaque_straight: f64,
    pub glass: f64,
    /// Share of the diffuse surface.
    pub below: f64,
    pub left: Left,
}

/// The share of light that a coat leaves.
#[derive(Clone, Copy)]
pub(super) struct Left {
    q: f64,
    r: f64,
    straight: DVec3,
    row: Row,
    normal: DVec3,
}

/// Rough reflection towards one viewer.
pub(super) struct Lobe {
    coat: Coat,
    facets: Facets,
    row: Row,
    /// s(v).
    scale: f64,
}

impl PathOracle<'_> {
    /// The coat of a surface; `None` for one that is diffuse or smooth alone.
    pub(super) fn coat(&self, surface: &SurfacePoint) -> Option<Coat> {
        let oracle = self.oracle;
        let material = oracle.material(surface);
        if let Some(model) = &material.metallic_roughness {
            let [of_roughness, of_metal] = oracle.rough_factors(surface);
            let ior = f64::from(material.ior);
            let dielectric = ((ior - 1.0) / (ior + 1.0)).powi(2);
            let (k, t) = (f64::from(model.specular_factor), f64::from(model.transmission));
            let metal = f64::from(model.metallic) * of_metal;
            let coat = Coat {
                alpha: (f64::from(model.roughness) * of_roughness).powi(2),
                metal,
                metal_straight: oracle.diffuse(surface),
                opaque: (1.0 - metal) * (1.0 - t) * k,
                opaque_straight: dielectric,
                glass: (1.0 - metal) * t,
                below: (1.0 - metal) * (1.0 - t),
                left: Left::new(1.0 - k, k * (1.0 - dielectric), DVec3::splat(dielectric)),
            };
            return Some(coat.with_rows());
        }
        let highlight = material.is_specular() && oracle.view.quality.shading == Shading::Full;
        let specular = material.specular.as_dvec3();
        let coat = Coat {
            alpha: (2.0 / (f64::from(material.exponent) + 2.0)).sqrt(),
            metal: 1.0,
            metal_straight: specular,
            opaque: 0.0,
            opaque_straight: 0.0,
            glass: 0.0,
            below: 1.0,
            left: Left::new(0.0, 1.0, specular),
        };
        highlight.then(|| coat.with_rows())
    }
}

impl Coat {
    fn with_rows(mut self) -> Self {
        self.left.row = self.row();
        self
    }

    fn row(&self) -> Row {
        Row::of(if self.is_rough() { self.alpha } else { 0.0 })
    }

    /// Whether the coat is rough: it has a lobe instead of a mirrored direction.
    pub(super) fn is_rough(&self) -> bool {
        self.metal + self.opaque + self.glass > 0.0 && self.alpha >= LEAST_ALPHA
    }

    /// An estimate of the light of the lobe; `share` is what glass reflects at the cosine.
    pub(super) fn albedo(&self, cosine: f64, share: f64) -> DVec3 {
        let LobeTerms { a, b, .. } = self.row().at(cosine);
        let of = |straight: DVec3| DVec3::ONE - (DVec3::ONE - straight) * (DVec3::splat(a) + straight * b);
        let albedo =
            self.metal * of(self.metal_straight) + self.opaque * of(DVec3::splat(self.opaque_straight));
        (albedo + self.glass * share).max(DVec3::ZERO)
    }

    /// Light in the mirrored direction of a perfectly smooth surface.
    pub(super) fn mirrored(&self, cosine: f64, share: f64) -> DVec3 {
        self.reflected(cosine, 0.0) + self.glass * share
    }

    /// The light of metal and opaque dielectric for f1 = 1; `more` is s(v) s(l) - 1.
    fn reflected(&self, cosine: f64, more: f64) -> DVec3 {
        let edge = (1.0 - cosine).max(0.0).powi(5);
        let of =
            |straight: DVec3| (straight + (DVec3::ONE - straight) * edge) * (DVec3::ONE + straight * more);
        self.metal * of(self.metal_straight) + self.opaque * of(DVec3::splat(self.opaque_straight))
    }
}

impl Left {
    fn new(q: f64, r: f64, straight: DVec3) -> Self {
        Self { q, r, straight, row: Row::of(0.0), normal: DVec3::ZERO }
    }

    /// The same for light around a normal.
    pub(super) fn seen_from(self, normal: DVec3) -> Self {
        Self { normal, ..self }
    }

    /// The share at a cosine.
    pub(super) fn at(&self, cosine: f64) -> DVec3 {
        let LobeTerms { a, b, .. } = self.row.at(cosine);
        self.of([a, b]).max(DVec3::ZERO)
    }

    /// The share of light from a direction.
    pub(super) fn towards(&self, direction: DVec3) -> DVec3 {
        self.at(self.normal.dot(direction))
    }

    /// Its mean over the cosine-weighted hemisphere.
    pub(super) fn mean(&self) -> DVec3 {
        self.of(self.row.means()).max(DVec3::splat(1e-6))
    }

    fn of(&self, [a, b]: [f64; 2]) -> DVec3 {
        self.q + self.r * (a + self.straight * b)
    }
}

impl Lobe {
    /// The lobe of a coat around a normal on the side of the viewer.
    pub(super) fn new(coat: Coat, normal: DVec3, to_viewer: DVec3) -> Self {
        let facets = Facets::new(normal, to_viewer, coat.alpha);
        let row = coat.row();
        let scale = row.at(facets.viewer.z).scale;
        Self { coat, facets, row, scale }
    }

    /// f cos and the density over solid angle of a direction.
    pub(super) fn eval(&self, direction: DVec3, interface: &Interface) -> (DVec3, f64) {
        let light = self.facets.local(direction);
        if !(light.z > 0.0) {
            return (DVec3::ZERO, 0.0);
        }
        let direct = self.facets.reflection(light);
        let from_below = self.facets.reflection(light * DVec3::new(1.0, 1.0, -1.0));
        let more = self.scale * self.row.at(light.z).scale - 1.0;
        let of_glass = |found: &FacetReflection| found.density * interface.share(found.cosine);
        let glass = self.coat.glass * (of_glass(&direct) + of_glass(&from_below));
        let value = self.coat.reflected(direct.cosine, more) * direct.value + glass;
        (value, direct.density + from_below.density)
    }

    /// A random direction with that density.
    pub(super) fn sample(&self, at: DVec2) -> DVec3 {
        let half = self.facets.half_vector(at);
        let light = optics::mirrored(-self.facets.viewer, half);
        self.facets.global(DVec3::new(light.x, light.y, light.z.abs()))
    }

    /// A random direction behind a microfacet, below the surface, and the share of light that the facet transmits. Behind a sheet the
    /// direction is a reflected one, mirrored at the surface. `None` where a facet reflects all light.
    pub(super) fn refract(&self, at: DVec2, interface: &Interface) -> Option<(DVec3, f64)> {
        let half = self.facets.half_vector(at);
        let viewer = self.facets.viewer;
        let share = interface.share(viewer.dot(half));
        let light = if interface.thin {
            optics::mirrored(-viewer, half)
        } else {
            optics::bent(-viewer, half, interface.indices)?
        };
        Some((self.facets.global(DVec3::new(light.x, light.y, -light.z.abs())), 1.0 - share))
    }
}
