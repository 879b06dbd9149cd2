//! Phong in Hall's form, sixteen points at a time, a file a term:
//!
//! ```text
//! I = c_d I_a + sum_j S_j A_j B_j I_j ( c_d max(0, N.L_j) + c_s max(0, N.H_j)^p_r )
//! ```
//!
//! [`surface`] finds the point, N and the material of each ray's hit, [`background`] stands where nothing is hit,
//! [`specular`] is the second term in the brackets; A_j B_j I_j come from [`crate::light`], S_j from
//! [`crate::tile::shadow`].

mod background;
mod material;
mod specular;
mod surface;

use crate::frame::PreparedFrame;
use crate::light::{Emitter, EyeLight, JUST_BEFORE};
use crate::render::RayCounts;
use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, SimdBase, bits, mask_of, select, splat, three};
use crate::tile::BLOCKS;
use crate::tile::shadow::{ShadowTile, Source};
use crate::tile::visible::{EyeTile, Visible};
use material::Materials;
use surface::Surfaces;

/// A light that adds less than this to every channel is left out, with its shadow ray: a thousand of them together
/// stay below a quarter of the darkest step of the 8-bit picture.
const LEAST_CONTRIBUTION: f32 = 1.0 / (1 << 24) as f32;

/// Linear RGB of each ray of a tile, indexed `[block][channel]`.
pub(crate) type Colors = [[Lanes; 3]; BLOCKS];

/// What the rays of a tile see.
#[inline(always)]
pub(crate) fn shade<S: Simd>(
    simd: S,
    tile: &EyeTile<'_>,
    visible: &Visible,
    counts: &mut RayCounts,
) -> Colors {
    let frame = tile.frame;
    let surfaces = Surfaces::of(simd, tile, visible);
    let ambient = Vec3x16::splat(simd, frame.scene().ambient.to_array());
    let mut colors = [[Lanes::ZERO; 3]; BLOCKS];
    for block in 0..BLOCKS {
        let missed = tile.live[block] & !surfaces.hit[block];
        if missed != 0 {
            background::background(simd, &frame.scene().background, tile, block).store(&mut colors[block]);
        }
        if surfaces.hit[block] != 0 {
            let base = Materials::gather(simd, frame.scene(), &surfaces, block).diffuse.mul(ambient);
            let before = Vec3x16::load(simd, &colors[block]);
            blend(simd, surfaces.hit[block], base, before).store(&mut colors[block]);
        }
    }
    for light in &frame.lights {
        add_light(simd, tile, visible, &surfaces, light, &mut colors, counts);
    }
    colors
}

/// `a` where the bit is set, else `b`.
#[inline(always)]
fn blend<S: Simd>(simd: S, lanes: u32, a: Vec3x16<S>, b: Vec3x16<S>) -> Vec3x16<S> {
    let mask = mask_of(simd, lanes);
    Vec3x16(three!(i => select(mask, a.0[i], b.0[i])))
}

/// One light on all points of a tile: what it would add, then who is in its shadow.
#[inline(always)]
fn add_light<S: Simd>(
    simd: S,
    tile: &EyeTile<'_>,
    visible: &Visible,
    surfaces: &Surfaces,
    light: &EyeLight,
    colors: &mut Colors,
    counts: &mut RayCounts,
) {
    let mut contributions = [[Lanes::ZERO; 3]; BLOCKS];
    let mut lifted = [[Lanes::ZERO; BLOCKS]; 3];
    let mut lit = [0_u32; BLOCKS];
    for block in 0..BLOCKS {
        if surfaces.hit[block] != 0 {
            let (contribution, reached, points) = unshadowed(simd, tile.frame, surfaces, light, block);
            contribution.store(&mut contributions[block]);
            lit[block] = reached & surfaces.hit[block];
            for axis in 0..3 {
                lifted[axis][block].store(points.0[axis]);
            }
        }
    }
    if lit == [0; BLOCKS] {
        return;
    }
    if light.shadows {
        counts.shadow += lit.iter().map(|lanes| u64::from(lanes.count_ones())).sum::<u64>();
        let dark = dark(simd, tile.frame, visible, light, &lifted, lit);
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

/// What a light adds to the points of a block if nothing is in its way; bits of those it adds something to; and the
/// points, lifted off their surfaces on the side that the light is on.
#[inline(always)]
fn unshadowed<S: Simd>(
    simd: S,
    frame: &PreparedFrame,
    surfaces: &Surfaces,
    light: &EyeLight,
    block: usize,
) -> (Vec3x16<S>, u32, Vec3x16<S>) {
    let points = Vec3x16::load(simd, &surfaces.point[block]);
    let normals = Vec3x16::load(simd, &surfaces.ns[block]);
    let geometric = Vec3x16::load(simd, &surfaces.ng[block]);
    let zero = splat(simd, 0.0);
    let incidence = light.incidence(simd, points);
    let n_dot_l = normals.dot(incidence.direction);
    let facing = n_dot_l.simd_gt(zero);
    let materials = Materials::gather(simd, frame.scene(), surfaces, block);
    let mut reflectance = materials.diffuse.scale(n_dot_l);
    if materials.any_specular {
        let to_viewer = Vec3x16::load(simd, &surfaces.to_viewer[block]);
        let highlight =
            specular::highlight(simd, normals, incidence.direction, to_viewer, &materials.exponent);
        reflectance = reflectance.add(materials.specular.scale(highlight));
    }
    let contribution = incidence.radiance.mul(reflectance);
    let [r, g, b] = contribution.0;
    let enough = r.max(g).max(b).simd_ge(splat(simd, LEAST_CONTRIBUTION));
    let lift = surfaces.lift[block].load(simd);
    let side = select(geometric.dot(incidence.direction).simd_lt(zero), -lift, lift);
    (contribution, incidence.reached & bits(facing & enough), points.add(geometric.scale(side)))
}

/// Which of the lit points are in shadow.
#[inline(always)]
fn dark<S: Simd>(
    simd: S,
    frame: &PreparedFrame,
    visible: &Visible,
    light: &EyeLight,
    points: &[[Lanes; BLOCKS]; 3],
    lit: [u32; BLOCKS],
) -> [u32; BLOCKS] {
    let (light, t_light) = match light.emitter {
        Emitter::Point { position } | Emitter::Spot { position, .. } => {
            (Source::Point(position), JUST_BEFORE)
        }
        Emitter::Directional { to_light } => (Source::Parallel(to_light), f64::INFINITY),
    };
    let (item, triangle) = (&visible.item, &visible.triangle);
    ShadowTile { frame, light, t_light, points, item, triangle }.dark(simd, lit)
}
