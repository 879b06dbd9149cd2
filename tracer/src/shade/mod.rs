//! Phong in Hall's form, sixteen points at a time, a file a term:
//!
//! ```text
//! I = c_d I_a + sum_j S_j A_j B_j I_j ( c_d max(0, N.L_j) + c_s max(0, N.H_j)^p_r )
//! ```
//!
//! [`surface`] finds the point, N and the material of each ray's hit ([`facet`] those of flat triangles, in [`space`]), [`texel`]
//! the share that a texture leaves of c_d, [`tint`] that of the colours of vertices, [`glow`] is what is seen without light,
//! [`background`] stands where nothing is hit,
//! [`specular`] is the second term in the brackets; A_j B_j I_j come from [`crate::light`], S_j from
//! [`crate::tile::shadow`].

mod background;
mod binomial;
mod facet;
mod glow;
mod group;
mod material;
mod space;
mod specular;
mod surface;
#[cfg(test)]
mod tests;
mod texel;
mod tint;

use crate::frame::PreparedFrame;
use crate::light::{Emitter, EyeLight, JUST_BEFORE};
use crate::render::RayCounts;
use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, SimdBase, bits, mask_of, select, splat, three};
use crate::stage::{Stage, Watch};
use crate::tile::shadow::{ShadowTile, Source};
use crate::tile::visible::{EyeTile, Visible};
use crate::tile::{self, BLOCKS};
use facet::Facets;
use material::Materials;
use surface::Surfaces;

/// A light that adds less than this to every channel is left out, with its shadow ray: a thousand of them together
/// stay below a quarter of the darkest step of the 8-bit picture.
const LEAST_CONTRIBUTION: f32 = 1.0 / (1 << 24) as f32;

/// Linear RGB of each ray of a tile, indexed `[block][channel]`.
pub(crate) type Colors = [[Lanes; 3]; BLOCKS];

/// Room for the shading of a tile, kept from tile to tile.
pub(crate) struct Scratch {
    facets: Facets,
    surfaces: Surfaces,
    /// The picture so far.
    pub colors: Colors,
    /// What the light at hand adds where nothing is in its way.
    contributions: Colors,
    /// Where shadow rays start, indexed `[block][axis]`.
    lifted: [[Lanes; 3]; BLOCKS],
}

impl Scratch {
    pub(crate) fn new(frame: &PreparedFrame) -> Self {
        let nothing = [[Lanes::ZERO; 3]; BLOCKS];
        Self {
            facets: Facets::new(),
            surfaces: Surfaces::empty(frame),
            colors: nothing,
            contributions: nothing,
            lifted: nothing,
        }
    }
}

/// What the rays of a tile see, into `scratch.colors`.
#[inline(always)]
pub(crate) fn shade<S: Simd, W: Watch>(
    simd: S,
    tile: &EyeTile<'_>,
    visible: &Visible,
    scratch: &mut Scratch,
    tiles: &mut tile::Scratch,
    counts: &mut RayCounts,
    watch: &mut W,
) {
    let frame = tile.frame;
    watch.enter(Stage::Surfaces);
    scratch.surfaces.find(simd, tile, visible, &mut scratch.facets);
    watch.enter(Stage::Shading);
    for block in 0..BLOCKS {
        let hit = scratch.surfaces.hit[block];
        if tile.live[block] & !hit != 0 {
            background::background(simd, &frame.scene().background, tile, block)
                .store(&mut scratch.colors[block]);
        }
        if hit != 0 {
            let behind = Vec3x16::load(simd, &scratch.colors[block]);
            blend(simd, hit, ambient(simd, frame, &scratch.surfaces, block), behind)
                .store(&mut scratch.colors[block]);
            if frame.features.emissive || frame.features.unlit {
                glow::glow(frame, &mut scratch.surfaces, block, &mut scratch.colors[block]);
            }
        }
    }
    for light in &frame.lights {
        add_light(simd, tile, visible, light, scratch, tiles, counts, watch);
    }
}

/// c_d I_a of the points of a block.
#[inline(always)]
fn ambient<S: Simd>(simd: S, frame: &PreparedFrame, surfaces: &Surfaces, block: usize) -> Vec3x16<S> {
    let light = Vec3x16::splat(simd, frame.scene().ambient.to_array());
    Materials::gather(simd, frame.scene(), surfaces, block).diffuse.mul(light)
}

/// `a` where the bit is set, else `b`.
#[inline(always)]
fn blend<S: Simd>(simd: S, lanes: u32, a: Vec3x16<S>, b: Vec3x16<S>) -> Vec3x16<S> {
    let mask = mask_of(simd, lanes);
    Vec3x16(three!(i => select(mask, a.0[i], b.0[i])))
}

/// One light on all points of a tile: what it would add, then who is in its shadow.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "what a tile lends each of its lights")]
fn add_light<S: Simd, W: Watch>(
    simd: S,
    tile: &EyeTile<'_>,
    visible: &Visible,
    light: &EyeLight,
    scratch: &mut Scratch,
    tiles: &mut tile::Scratch,
    counts: &mut RayCounts,
    watch: &mut W,
) {
    let Scratch { surfaces, colors, contributions, lifted, .. } = scratch;
    let mut lit = [0_u32; BLOCKS];
    for block in 0..BLOCKS {
        if surfaces.lit[block] != 0 {
            let reached = unshadowed(
                simd,
                tile.frame,
                surfaces,
                light,
                block,
                &mut contributions[block],
                &mut lifted[block],
            );
            lit[block] = reached & surfaces.lit[block];
        }
    }
    if lit == [0; BLOCKS] {
        return;
    }
    if light.shadows {
        counts.shadow += lit.iter().map(|lanes| u64::from(lanes.count_ones())).sum::<u64>();
        watch.enter(Stage::Shadows);
        let dark = dark(simd, tile, visible, light, lifted, lit, tiles);
        watch.enter(Stage::Shading);
        for block in 0..BLOCKS {
            lit[block] &= !dark[block];
        }
    }
    for block in 0..BLOCKS {
        if lit[block] != 0 {
            let before = Vec3x16::load(simd, &colors[block]);
            let after = before.add(Vec3x16::load(simd, &contributions[block]));
            blend(simd, lit[block], after, before).store(&mut colors[block]);
        }
    }
}

/// What a light adds to the points of a block if nothing is in its way, and, if anything may be, the points, lifted off their
/// surfaces on the side that the light is on. Returns the bits of those that it adds something to.
#[inline(always)]
fn unshadowed<S: Simd>(
    simd: S,
    frame: &PreparedFrame,
    surfaces: &Surfaces,
    light: &EyeLight,
    block: usize,
    contributions: &mut [Lanes; 3],
    lifted: &mut [Lanes; 3],
) -> u32 {
    let points = Vec3x16::load(simd, &surfaces.point[block]);
    let geometric = Vec3x16::load(simd, &surfaces.ng[block]);
    let normals = if frame.features.smooth { Vec3x16::load(simd, &surfaces.ns[block]) } else { geometric };
    let zero = splat(simd, 0.0);
    let incidence = light.incidence(simd, points);
    let n_dot_l = normals.dot(incidence.direction);
    let facing = incidence.reached & bits(n_dot_l.simd_gt(zero));
    if facing & surfaces.lit[block] == 0 {
        return 0;
    }
    let materials = Materials::gather(simd, frame.scene(), surfaces, block);
    let mut reflectance = materials.diffuse.scale(n_dot_l);
    if frame.features.specular && materials.any_specular {
        let to_viewer = Vec3x16::load(simd, &surfaces.to_viewer[block]);
        let (to_light, exponents) = (incidence.direction, materials.exponent);
        let precision = frame.view().quality.exponent;
        let highlight = specular::highlight(simd, normals, to_light, to_viewer, exponents, precision);
        reflectance = reflectance.add(materials.specular.scale(highlight));
    }
    let contribution = incidence.radiance.mul(reflectance);
    contribution.store(contributions);
    let [r, g, b] = contribution.0;
    let enough = r.max(g).max(b).simd_ge(splat(simd, LEAST_CONTRIBUTION));
    if light.shadows {
        let lift = surfaces.lift[block].load(simd);
        let side = select(geometric.dot(incidence.direction).simd_lt(zero), -lift, lift);
        points.add(geometric.scale(side)).store(lifted);
    }
    facing & bits(enough)
}

/// Which of the lit points are in shadow.
#[inline(always)]
fn dark<S: Simd>(
    simd: S,
    tile: &EyeTile<'_>,
    visible: &Visible,
    light: &EyeLight,
    points: &[[Lanes; 3]; BLOCKS],
    lit: [u32; BLOCKS],
    tiles: &mut tile::Scratch,
) -> [u32; BLOCKS] {
    let (light, t_light) = match light.emitter {
        Emitter::Point { position } | Emitter::Spot { position, .. } => {
            (Source::Point(position), JUST_BEFORE)
        }
        Emitter::Directional { to_light } => (Source::Parallel(to_light), f64::INFINITY),
    };
    let (item, triangle) = (&visible.item, &visible.triangle);
    let shadow = ShadowTile { frame: tile.frame, light, t_light, grid: tile.rays, points, item, triangle };
    // Of a tile that sees the edge of a thing, the thing first and then what is behind it: all together would be far apart,
    // and the light would have to look at all that lies between.
    let Some(first) = lit.iter().position(|&lanes| lanes != 0) else { return [0; BLOCKS] };
    let item = visible.item[first].0[lit[first].trailing_zeros() as usize];
    let mut of_item = [0; BLOCKS];
    let mut of_others = [0; BLOCKS];
    for block in first..BLOCKS {
        of_item[block] = lit[block] & visible.item[block].equal(simd, item);
        of_others[block] = lit[block] & !of_item[block];
    }
    let mut dark = [0; BLOCKS];
    for asked in [of_item, of_others] {
        if asked != [0; BLOCKS] {
            let found = shadow.dark(simd, asked, tiles);
            for block in 0..BLOCKS {
                dark[block] |= found[block];
            }
        }
    }
    dark
}
