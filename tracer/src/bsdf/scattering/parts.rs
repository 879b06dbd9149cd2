//! The parts of materials that are more than diffuse surfaces, at sixteen points.
//!
//! ```text
//! diffuse     D c(v) c(l) / (pi C): what the lobe leaves, see [`super::albedo`]
//! lobe        f1 (m F(b) + w F(d)) + t Fx p, F(x) = (x + (1 - x) (1 - v.h)^5) (1 + x (s(v) s(l) - 1)), Fx the exact share
//! mirrored    perfectly smooth
//! refracted   perfectly smooth
//! frosted     refraction by microfacets
//! ```
//!
//! Directions that leave a microfacet to the wrong side of the surface are mirrored at it, and p is the density of the result over cos. Rough
//! glass has its reflection and refraction by that density, without further masking: it absorbs nothing, so none of its light is lost.
//!
//! Radiance is that of the vacuum: L / n^2, which refraction leaves as it is, so weights have no factor eta^2. Where a path starts and ends
//! outside of all bodies the factors cancel; an emitter inside of a body states L / n^2.

use super::albedo::{LobeTerms, Rows};
use super::fresnel::{exact, of_sheet, schlick};
use super::ggx::{LEAST_ALPHA, Microfacets, Reflection};
use super::recipe::Recipe;
use super::{Evaluated, Scattered, Setting, lambert, smooth};
use crate::simd::vector::Vec3x16;
use crate::simd::{Simd, SimdBase, bits, f32x16, mask_of, mask32x16, select, splat, three};

/// Least cosine of the angle between the normal and the viewer: normals behind it are bent.
const LEAST_COSINE: f32 = 1e-3;

/// Least estimate of the share that frosted glass transmits: where its normal reflects all light, some of its microfacets do not.
const LEAST_FROSTED: f32 = 0.25;

/// The parts of sixteen materials.
pub(super) struct Parts<S: Simd> {
    /// Lanes with a diffuse surface alone.
    diffuse_alone: mask32x16<S>,
    diffuse: Diffuse<S>,
    lobe: Lobe<S>,
    /// Shares of perfectly smooth reflection and refraction, linear RGB.
    reflect: Vec3x16<S>,
    transmit: Vec3x16<S>,
    /// Colour of the light that microfacets refract.
    frosted: Vec3x16<S>,
    dielectric: Dielectric<S>,
    /// Probabilities of diffuse, lobe, mirrored, refracted and frosted.
    shares: [f32x16<S>; 5],
    geometric: Vec3x16<S>,
    /// Shading normals on the side of the viewer.
    normals: Vec3x16<S>,
    to_viewer: Vec3x16<S>,
}

/// Diffuse reflection below a lobe.
struct Diffuse<S: Simd> {
    /// Shading normals as they are.
    normals: Vec3x16<S>,
    /// D c(v) / C.
    color: Vec3x16<S>,
    /// Lanes with a lobe above.
    below: mask32x16<S>,
    rest: Rest<S>,
}

/// The share that a lobe leaves: c = q + r (a + F0 b).
struct Rest<S: Simd> {
    q: f32x16<S>,
    r: f32x16<S>,
    straight: Vec3x16<S>,
}

/// Rough reflection.
struct Lobe<S: Simd> {
    facets: Microfacets<S>,
    rows: Rows<S>,
    /// s(v).
    scale: f32x16<S>,
    /// Lanes with a lobe.
    rough: mask32x16<S>,
    weights: Weights<S>,
}

/// Shares of the kinds of reflection, and their reflectances at straight incidence.
struct Weights<S: Simd> {
    metal: f32x16<S>,
    metal_straight: Vec3x16<S>,
    opaque: f32x16<S>,
    opaque_straight: f32x16<S>,
    glass: f32x16<S>,
}

/// Interfaces with bodies or sheets.
struct Dielectric<S: Simd> {
    /// n_from / n_to, of a sheet into it.
    eta: f32x16<S>,
    thin: mask32x16<S>,
}

impl<S: Simd> Dielectric<S> {
    /// Reflected share.
    #[inline(always)]
    fn share(&self, simd: S, cosine: f32x16<S>) -> f32x16<S> {
        let share = exact(simd, cosine, self.eta);
        select(self.thin, of_sheet(simd, share), share)
    }
}

impl<S: Simd> Rest<S> {
    #[inline(always)]
    fn of(&self, [a, b]: [f32x16<S>; 2]) -> Vec3x16<S> {
        Vec3x16(three!(i => self.q + self.r * (a + self.straight.0[i] * b)))
    }
}

impl<S: Simd> Weights<S> {
    /// Light that metal and opaque dielectric reflect, linear RGB. `edge` is (1 - v.h)^5, and `more` is s(v) s(l) - 1.
    #[inline(always)]
    fn reflected(&self, simd: S, edge: f32x16<S>, more: f32x16<S>) -> Vec3x16<S> {
        let one = splat(simd, 1.0);
        let of = |straight: f32x16<S>| (straight + (one - straight) * edge) * (one + straight * more);
        let grey = self.opaque * of(self.opaque_straight);
        Vec3x16(three!(i => self.metal * of(self.metal_straight.0[i]) + grey))
    }

    /// Albedo of the lobe, linear RGB, with an estimate of that of glass.
    #[inline(always)]
    fn albedo(&self, simd: S, terms: &LobeTerms<S>, glass: f32x16<S>) -> Vec3x16<S> {
        let one = splat(simd, 1.0);
        let of = |straight: f32x16<S>| one - (one - straight) * (terms.a + straight * terms.b);
        let grey = self.opaque * of(self.opaque_straight) + self.glass * glass;
        Vec3x16(three!(i => self.metal * of(self.metal_straight.0[i]) + grey))
    }
}

impl<S: Simd> Parts<S> {
    /// The parts of materials with these numbers; `base` are their diffuse or base colours.
    #[inline(always)]
    pub(super) fn new(simd: S, recipe: &Recipe<f32x16<S>>, base: Vec3x16<S>, setting: &Setting<S>) -> Self {
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let normals = facing(simd, setting.normals, setting.to_viewer);
        let cosine = normals.dot(setting.to_viewer).max(splat(simd, 1e-6)).min(one);
        let on = |switch: f32x16<S>| switch.simd_gt(zero);
        let metallic_roughness = on(recipe.metallic_roughness);
        let [r, g, b] = recipe.specular;
        let highlight = on(r.max(g).max(b));

        let rest = one - recipe.metallic;
        let (solid, clear) = (rest * (one - recipe.transmission), rest * recipe.transmission);
        let weights = Weights {
            metal: select(metallic_roughness, recipe.metallic, select(highlight, one, zero)),
            metal_straight: Vec3x16(three!(i => select(metallic_roughness, base.0[i], recipe.specular[i]))),
            opaque: select(metallic_roughness, solid * recipe.specular_factor, zero),
            opaque_straight: recipe.dielectric,
            glass: select(metallic_roughness, clear, zero),
        };
        let reflects = on(weights.metal + weights.opaque + weights.glass);
        let rough = reflects & recipe.alpha.simd_ge(splat(simd, LEAST_ALPHA));
        let rows = Rows::of(simd, select(rough, recipe.alpha, zero));
        let terms = rows.at(simd, cosine);

        let rest = Rest {
            q: select(metallic_roughness, one - recipe.specular_factor, zero),
            r: select(metallic_roughness, recipe.specular_factor * (one - recipe.dielectric), one),
            straight: Vec3x16(three!(i => select(metallic_roughness, recipe.dielectric, recipe.specular[i]))),
        };
        let below = metallic_roughness | highlight;
        let share = select(metallic_roughness, solid, one);
        let (left, mean) = (rest.of([terms.a, terms.b]), rest.of(rows.means(simd)));
        let least = splat(simd, 1e-6);
        let albedo = Vec3x16(three!(i => base.0[i] * share * select(below, left.0[i].max(zero), one)));
        let color = Vec3x16(three!(i => albedo.0[i] / select(below, mean.0[i].max(least), one)));

        let thin = on(recipe.thin);
        let dielectric = Dielectric { eta: select(thin, recipe.inverse_ior, setting.eta.load(simd)), thin };
        let glass = dielectric.share(simd, cosine);
        let factor = |of_glass: f32x16<S>| select(on(recipe.fresnel), of_glass, one);
        let smooth_reflect = weights.reflected(simd, schlick(simd, cosine), zero);
        let reflect = Vec3x16(three!(i => {
            select(metallic_roughness | highlight, select(rough, zero, smooth_reflect.0[i] + weights.glass * glass), zero)
                + recipe.reflect[i] * factor(glass)
        }));
        let tinted = Vec3x16(three!(i => weights.glass * base.0[i]));
        let passed = one - glass;
        let transmit = Vec3x16(three!(i => {
            select(rough, zero, tinted.0[i] * passed) + recipe.transmit[i] * passed
        }));
        let frosted = Vec3x16(three!(i => select(rough, tinted.0[i], zero)));

        let lobe_albedo = select(rough, brightness(simd, weights.albedo(simd, &terms, glass)), zero);
        let estimates = [
            brightness(simd, albedo),
            lobe_albedo.max(zero),
            brightness(simd, reflect),
            brightness(simd, transmit),
            brightness(simd, frosted) * passed.max(splat(simd, LEAST_FROSTED)),
        ];
        let [diffuse, lobe, mirrored, refracted, scattered] = estimates;
        let total = diffuse + lobe + mirrored + refracted + scattered;
        let total = select(on(total), total, one);
        let shares = [diffuse / total, lobe / total, mirrored / total, refracted / total, scattered / total];
        let alpha = select(rough, recipe.alpha, one);
        Self {
            diffuse_alone: !(reflects | on(largest(recipe.reflect)) | on(largest(recipe.transmit))),
            diffuse: Diffuse { normals: setting.normals, color, below, rest },
            lobe: Lobe {
                facets: Microfacets::new(simd, alpha, normals, setting.to_viewer),
                rows,
                scale: terms.scale,
                rough,
                weights,
            },
            reflect,
            transmit,
            frosted,
            dielectric,
            shares,
            geometric: setting.geometric,
            normals,
            to_viewer: setting.to_viewer,
        }
    }

    /// Value and density of directions, without perfectly smooth and frosted parts.
    #[inline(always)]
    pub(super) fn eval(&self, simd: S, direction: Vec3x16<S>) -> Evaluated<S> {
        let zero = splat(simd, 0.0);
        let mut evaluated = self.diffuse(simd, direction);
        if bits(self.lobe.rough) == 0 {
            return evaluated;
        }
        let rough = self.lobe.rough;
        let Evaluated { value, density } = self.lobe(simd, direction);
        evaluated.value = Vec3x16(three!(i => evaluated.value.0[i] + select(rough, value.0[i], zero)));
        evaluated.density += select(rough, self.shares[1] * density, zero);
        evaluated
    }

    #[inline(always)]
    fn diffuse(&self, simd: S, direction: Vec3x16<S>) -> Evaluated<S> {
        let one = splat(simd, 1.0);
        let Diffuse { normals, color, below, rest } = &self.diffuse;
        let Evaluated { value, density } = lambert::eval(simd, *color, normals.dot(direction));
        let terms = self.lobe.rows.at(simd, self.normals.dot(direction));
        let left = rest.of([terms.a, terms.b]);
        let value = Vec3x16(three!(i => value.0[i] * select(*below, left.0[i].max(splat(simd, 0.0)), one)));
        Evaluated { value, density: select(self.diffuse_alone, density, density * self.shares[0]) }
    }

    #[inline(always)]
    fn lobe(&self, simd: S, direction: Vec3x16<S>) -> Evaluated<S> {
        let Lobe { facets, rows, scale, weights, .. } = &self.lobe;
        let light = facets.local(direction);
        let [x, y, z] = light.0;
        let above = z.simd_gt(splat(simd, 0.0));
        let direct = facets.reflection(simd, light);
        let from_below = facets.reflection(simd, Vec3x16([x, y, -z]));
        let more = *scale * rows.at(simd, z).scale - splat(simd, 1.0);
        let reflected = weights.reflected(simd, schlick(simd, direct.cosine), more);
        let of_glass =
            |reflection: &Reflection<S>| reflection.density * self.dielectric.share(simd, reflection.cosine);
        let glass = weights.glass * (of_glass(&direct) + of_glass(&from_below));
        let value = Vec3x16(three!(i => {
            select(above, reflected.0[i] * direct.value + glass, splat(simd, 0.0))
        }));
        let density = select(above, direct.density + from_below.density, splat(simd, 0.0));
        Evaluated { value, density }
    }

    /// Random directions.
    #[inline(always)]
    pub(super) fn sample(&self, simd: S, part: f32x16<S>, at: [f32x16<S>; 2]) -> Scattered<S> {
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let [mut diffuse, lobe, mirrored, refracted, frosted] = self.select(simd, part);
        diffuse |= bits(self.diffuse_alone);
        let (towards, alone) = lambert::sample(simd, self.diffuse.normals, at);
        let mut direction = towards;
        let mut put = |lanes: u32, new: Vec3x16<S>| {
            let mask = mask_of(simd, lanes);
            direction = Vec3x16(three!(i => select(mask, new.0[i], direction.0[i])));
        };
        let facets = &self.lobe.facets;
        let half = if lobe | frosted == 0 { self.normals } else { facets.half_vectors(simd, at) };
        if lobe != 0 {
            let [x, y, z] = facets.mirrored(half).0.0;
            put(lobe, facets.global(Vec3x16([x, y, z.abs()])).normalize(simd));
        }
        let mut through = Vec3x16::splat(simd, [0.0; 3]);
        if mirrored != 0 {
            put(mirrored, smooth::reflected(simd, self.to_viewer, self.normals, self.geometric));
        }
        if refracted != 0 {
            put(refracted, self.refracted(simd));
        }
        if frosted != 0 {
            let (direction, weight) = self.frosted(simd, half);
            put(frosted, direction);
            through = weight;
        }
        let Evaluated { value, density } = self.eval(simd, direction);
        let found = density.simd_gt(zero);
        let density = select(found, density, one);
        let mut weight = value.scale(one / density);
        for (lanes, color, share) in [
            (mirrored, self.reflect, self.shares[2]),
            (refracted, self.transmit, self.shares[3]),
            (frosted, through, self.shares[4]),
        ] {
            let mask = mask_of(simd, lanes);
            let scaled = color.scale(one / select(mask, share, one));
            weight = Vec3x16(three!(i => select(mask, scaled.0[i], weight.0[i])));
        }
        // Nothing else finds the directions of smooth parts, nor those behind frosted glass, where no light is selected.
        let only = mirrored | refracted | frosted;
        let density = select(mask_of(simd, only), splat(simd, f32::INFINITY), density);
        Scattered {
            direction,
            weight: Vec3x16(three!(i => select(self.diffuse_alone, self.diffuse.color.0[i], weight.0[i]))),
            density: select(self.diffuse_alone, alone, density),
            scattered: bits(self.diffuse_alone) | only | ((diffuse | lobe) & bits(found)),
            refracted: refracted | frosted,
        }
    }

    /// Bits of the lanes that select each part by a random number in [0, 1).
    #[inline(always)]
    fn select(&self, simd: S, number: f32x16<S>) -> [u32; 5] {
        let mut selected = [0; 5];
        let mut rest = 0xffff & !bits(self.diffuse_alone);
        let mut end = splat(simd, 0.0);
        for (part, share) in self.shares.iter().enumerate() {
            end += *share;
            selected[part] = rest & bits(number.simd_lt(end)) & bits(share.simd_gt(splat(simd, 0.0)));
            rest &= !selected[part];
        }
        selected
    }

    #[inline(always)]
    fn refracted(&self, simd: S) -> Vec3x16<S> {
        let through = smooth::refracted(simd, self.to_viewer, self.normals, self.dielectric.eta);
        let through = smooth::on_side_of(simd, through, self.geometric.scale(splat(simd, -1.0)));
        let straight = self.to_viewer.scale(splat(simd, -1.0));
        let thin = self.dielectric.thin;
        Vec3x16(three!(i => select(thin, straight.0[i], through.0[i]))).normalize(simd)
    }

    /// Directions through microfacets, and their weights. Masking after refraction is left out, and directions that come out on the wrong side
    /// are mirrored at the surface: so no light is lost. Behind a sheet directions are those of its reflection, mirrored at the surface.
    #[inline(always)]
    fn frosted(&self, simd: S, half: Vec3x16<S>) -> (Vec3x16<S>, Vec3x16<S>) {
        let facets = &self.lobe.facets;
        let (mirrored, cosine) = facets.mirrored(half);
        let refracted = smooth::refracted(simd, facets.viewer, half, self.dielectric.eta);
        let local = Vec3x16(three!(i => select(self.dielectric.thin, mirrored.0[i], refracted.0[i])));
        let [x, y, z] = local.0;
        let below = Vec3x16([x, y, -z.abs()]);
        let passed = splat(simd, 1.0) - self.dielectric.share(simd, cosine);
        let direction = facets.global(below).normalize(simd);
        let behind = smooth::on_side_of(simd, direction, self.geometric.scale(splat(simd, -1.0)));
        (behind, self.frosted.scale(passed))
    }
}

/// Normals that the viewer sees the front of: others are bent towards the viewer, as far as needed.
#[inline(always)]
fn facing<S: Simd>(simd: S, normals: Vec3x16<S>, to_viewer: Vec3x16<S>) -> Vec3x16<S> {
    let zero = splat(simd, 0.0);
    let missing = (splat(simd, LEAST_COSINE) - normals.dot(to_viewer)).max(zero);
    let bent = normals.add(to_viewer.scale(missing)).normalize(simd);
    let bend = missing.simd_gt(zero);
    Vec3x16(three!(i => select(bend, bent.0[i], normals.0[i])))
}

#[inline(always)]
fn largest<S: Simd>([r, g, b]: [f32x16<S>; 3]) -> f32x16<S> {
    r.max(g).max(b)
}

/// Mean of the channels.
#[inline(always)]
fn brightness<S: Simd>(simd: S, color: Vec3x16<S>) -> f32x16<S> {
    let [r, g, b] = color.0;
    (r + g + b) * splat(simd, 1.0 / 3.0)
}
