//! The direct integrator: Blinn-Phong in Hall's form, sixteen points at a time.
//!
//! ```text
//! I = c_d I_a + sum_j S_j A_j B_j I_j ( c_d max(0, N.L_j) + c_s max(0, N.H_j)^p_r )
//! ```
//!
//! Point, N and material come from [`crate::surface`], A_j B_j I_j from [`crate::light`], the brackets from [`crate::bsdf`],
//! S_j from [`crate::intersect::tile`].
//!
//! ```text
//!   context      a tile of rays, from its hits to its colours
//!   auxiliary    pictures without light: normals, depth, items, diffuse colours
//!   bounce       reflected and transmitted rays
//!   emission     unlit materials, and light that surfaces emit
//!   shadow       S_j
//! ```

mod auxiliary;
mod bounce;
mod context;
mod emission;
pub(super) mod shadow;
#[cfg(test)]
mod tests;

use super::background;
use super::stage::{Stage, Watch};
use crate::bsdf;
use crate::frame::PreparedFrame;
use crate::light::EyeLight;
use crate::rays::{BLOCKS, SurfaceSource, TileColors};
use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, SimdBase, bits, mask_of, select, splat, three};
use crate::surface::{Materials, Surfaces};
pub(super) use context::TileContext;

/// Least contribution of a light to any channel; a light that adds less is skipped, with its shadow ray: a thousand of them
/// add less than a quarter of the darkest step of the 8-bit picture.
const LEAST_CONTRIBUTION: f32 = 1.0 / (1 << 24) as f32;

/// Memory of the shading of a tile, kept from tile to tile.
pub(crate) struct Scratch {
    /// Sum of the terms so far.
    pub colors: TileColors,
    /// Unoccluded contribution of the current light.
    contributions: TileColors,
    /// Origins of shadow rays, indexed `[block][axis]`.
    shadow_origins: [[Lanes; 3]; BLOCKS],
}

impl Scratch {
    pub(crate) fn new() -> Self {
        let nothing = [[Lanes::ZERO; 3]; BLOCKS];
        Self { colors: nothing, contributions: nothing, shadow_origins: nothing }
    }
}

/// Shades the surface points of a tile into `context.direct.colors`.
#[inline(always)]
pub(super) fn shade<S: Simd, R: SurfaceSource, W: Watch>(
    simd: S,
    rays: &R,
    context: &mut TileContext<'_, W>,
) {
    let frame = context.frame;
    if !frame.view().quality.shading.is_light() {
        return auxiliary::shade(rays, &context.hits, &context.surfaces, &mut context.direct.colors);
    }
    let (surfaces, colors) = (&mut context.surfaces, &mut context.direct.colors);
    for block in 0..BLOCKS {
        let hit = surfaces.blocks[block].hit;
        if rays.live(block) & !hit != 0 {
            background::background(simd, rays, block, &mut colors[block]);
        }
        if hit != 0 {
            let behind = Vec3x16::load(simd, &colors[block]);
            blend(simd, hit, ambient(simd, frame, surfaces, block), behind).store(&mut colors[block]);
            if frame.features.emissive || frame.features.unlit {
                emission::add(frame, surfaces, block, &mut colors[block]);
            }
        }
    }
    for light in &frame.lights {
        add_light(simd, rays, light, context);
    }
}

/// c_d I_a of the points of a block.
#[inline(always)]
fn ambient<S: Simd>(simd: S, frame: &PreparedFrame, surfaces: &Surfaces, block: usize) -> Vec3x16<S> {
    let light = Vec3x16::splat(simd, frame.scene().ambient.to_array());
    Materials::gather(simd, frame.scene(), surfaces, block).diffuse.mul(light)
}

/// `a` in the lanes whose bit is set, else `b`.
#[inline(always)]
fn blend<S: Simd>(simd: S, lanes: u32, a: Vec3x16<S>, b: Vec3x16<S>) -> Vec3x16<S> {
    let mask = mask_of(simd, lanes);
    Vec3x16(three!(i => select(mask, a.0[i], b.0[i])))
}

/// Adds one light to all points of a tile: its unoccluded contribution, where the points are not in its shadow.
#[inline(always)]
fn add_light<S: Simd, R: SurfaceSource, W: Watch>(
    simd: S,
    rays: &R,
    light: &EyeLight,
    context: &mut TileContext<'_, W>,
) {
    let mut lit = [0_u32; BLOCKS];
    for block in 0..BLOCKS {
        let candidates = context.surfaces.blocks[block].lit;
        if candidates != 0 {
            let reached =
                unoccluded(simd, context.frame, &context.surfaces, light, block, &mut context.direct);
            lit[block] = reached & candidates;
        }
    }
    if lit == [0; BLOCKS] {
        return;
    }
    if light.shadows && shadow::is_partial(context.frame, light) {
        return shadow::add_partly_occluded(simd, rays, light, lit, context);
    }
    if light.shadows {
        context.counts.shadow += lit.iter().map(|lanes| u64::from(lanes.count_ones())).sum::<u64>();
        context.watch.enter(Stage::Shadows);
        let origins = &context.direct.shadow_origins;
        let occluded = shadow::occluded(simd, rays, &context.hits, light, origins, lit, &mut context.tile);
        context.watch.enter(Stage::Shading);
        for block in 0..BLOCKS {
            lit[block] &= !occluded[block];
        }
    }
    let Scratch { colors, contributions, .. } = &mut context.direct;
    for block in 0..BLOCKS {
        if lit[block] != 0 {
            let before = Vec3x16::load(simd, &colors[block]);
            let after = before.add(Vec3x16::load(simd, &contributions[block]));
            blend(simd, lit[block], after, before).store(&mut colors[block]);
        }
    }
}

/// Computes the unoccluded contribution of a light to the points of a block, and the origins of their shadow rays: the points,
/// moved off their surfaces to the side of the light, or onto the smooth ones. Returns the bits of the points with a contribution.
#[inline(always)]
fn unoccluded<S: Simd>(
    simd: S,
    frame: &PreparedFrame,
    surfaces: &Surfaces,
    light: &EyeLight,
    block: usize,
    scratch: &mut Scratch,
) -> u32 {
    let surface = &surfaces.blocks[block];
    let points = Vec3x16::load(simd, &surface.point);
    let geometric = Vec3x16::load(simd, &surface.ng);
    let normals = if frame.features.shaded_normals() { Vec3x16::load(simd, &surface.ns) } else { geometric };
    let zero = splat(simd, 0.0);
    let incidence = light.incidence(simd, points);
    let n_dot_l = normals.dot(incidence.direction);
    let facing = incidence.reached & bits(n_dot_l.simd_gt(zero));
    let facing = surfaces.before_untilted(simd, block, incidence.direction, facing);
    if facing & surface.lit == 0 {
        return 0;
    }
    let materials = Materials::gather(simd, frame.scene(), surfaces, block);
    let to_viewer = if frame.features.specular { Some(&surface.to_viewer) } else { None };
    let (light_at, precision) = ((incidence.direction, n_dot_l), frame.view().quality.exponent);
    let reflectance = bsdf::eval(simd, &materials, normals, light_at, to_viewer, precision);
    let contribution = incidence.radiance.mul(reflectance);
    contribution.store(&mut scratch.contributions[block]);
    let [r, g, b] = contribution.0;
    let enough = r.max(g).max(b).simd_ge(splat(simd, LEAST_CONTRIBUTION));
    if light.shadows {
        let along = geometric.dot(incidence.direction);
        let side = surfaces.to_shadow_origins(simd, block, along);
        points.add(geometric.scale(side)).store(&mut scratch.shadow_origins[block]);
    }
    facing & bits(enough)
}
