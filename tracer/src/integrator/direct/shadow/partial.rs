//! Shadows that are not all or nothing: S_j is a colour.
//!
//! ```text
//! S_j = 1/n sum over the points p_i of the light of  prod over the surfaces between the point x and p_i of  c_t
//! ```
//!
//! A light without extent has one point, its centre. Of a light with an extent, the points of the set of the sample's place in the
//! picture (`light::extent`): they count only above the horizon of x, N_g.(p_i - x) > 0 for the geometric normal N_g on the side of
//! the light's centre, because x would be occluded by its own surface. N.L, H, A_j and B_j are those of the centre. Where x is
//! inside of the ball, or surfaces are, those of the points count that nothing occludes.
//!
//! c_t is 1 for a surface that casts no shadow, `transmit` for a transparent one and 0 for all others. First all surfaces count as
//! opaque, in tiles; only the rays that are occluded then are followed one by one.

use super::super::super::stage::{Stage, Watch};
use super::super::{TileContext, blend};
use super::{by_item, target_of};
use crate::frame::PreparedFrame;
use crate::intersect::{Crossings, tile};
use crate::light::extent::Extent;
use crate::light::{EyeLight, SHADOW_T_MAX};
use crate::rays::{
    BLOCKS, HitBlock, RaySource, ShadowTarget, ShadowTile, SurfaceSource, TileColors, TileRays,
};
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, SimdBase, bits, each_bit, select, splat, three};

/// Adds a light to the colours of a tile, where its shadows are not all or nothing: S_j times its unoccluded contribution, for the
/// points in `lit`.
#[inline(never)]
pub(in super::super) fn add<S: Simd, R: SurfaceSource, W: Watch>(
    simd: S,
    rays: &R,
    light: &EyeLight,
    lit: [u32; BLOCKS],
    context: &mut TileContext<'_, W>,
) {
    context.watch.enter(Stage::Shadows);
    let mut points = Points {
        frame: context.frame,
        grid: rays.places(),
        hits: &context.hits,
        origins: &context.direct.shadow_origins,
        arrived: [[Lanes::ZERO; 3]; BLOCKS],
        traced: 0,
        crossings: Crossings::default(),
        scratch: &mut context.tile,
    };
    let samples = match &light.extent {
        None => {
            let (target, t_max) = target_of(light);
            points.trace(simd, target, t_max, lit);
            1
        }
        Some(extent) => {
            let normals = simd.vectorize(
                #[inline(always)]
                || normals_towards(simd, extent.center(), &context.surfaces, &lit),
            );
            for (set, lanes) in by_set(rays, extent, lit).into_iter().enumerate() {
                points.trace_set(simd, extent.points(set), &normals, lanes);
            }
            extent.sets().points(0).len()
        }
    };
    let Points { arrived, traced, .. } = points;
    context.counts.shadow += traced;
    context.watch.enter(Stage::Shading);
    simd.vectorize(
        #[inline(always)]
        || {
            let colors = &mut context.direct.colors;
            add_shares(simd, &arrived, samples, &context.direct.contributions, lit, colors);
        },
    );
}

/// The points of a tile while rays from them to a light are traced.
struct Points<'a> {
    frame: &'a PreparedFrame,
    /// Places of the points in the camera's picture.
    grid: &'a TileRays,
    hits: &'a [HitBlock; BLOCKS],
    /// Origins of shadow rays, indexed `[block][axis]`.
    origins: &'a [[Lanes; 3]; BLOCKS],
    /// Light that arrives, summed over the points of the light so far.
    arrived: TileColors,
    /// Rays so far.
    traced: u64,
    crossings: Crossings,
    scratch: &'a mut tile::Scratch,
}

impl Points<'_> {
    /// Traces the rays from some lanes to the points of a set, one after another.
    fn trace_set<S: Simd>(
        &mut self,
        simd: S,
        targets: impl Iterator<Item = glam::DVec3>,
        normals: &[[Lanes; 3]; BLOCKS],
        lanes: [u32; BLOCKS],
    ) {
        if lanes == [0; BLOCKS] {
            return;
        }
        for target in targets {
            let above = simd.vectorize(
                #[inline(always)]
                || above_horizon(simd, target.as_vec3().to_array(), normals, self.origins, &lanes),
            );
            if above != [0; BLOCKS] {
                self.trace(simd, ShadowTarget::Point(target), SHADOW_T_MAX, above);
            }
        }
    }

    /// Traces the rays from some lanes to one target, and adds the light that arrives.
    fn trace<S: Simd>(&mut self, simd: S, light: ShadowTarget, t_max: f64, lanes: [u32; BLOCKS]) {
        self.traced += lanes.iter().map(|lanes| u64::from(lanes.count_ones())).sum::<u64>();
        let mut shadow = ShadowTile {
            frame: self.frame,
            light,
            t_max,
            grid: self.grid,
            points: self.origins,
            hits: self.hits,
            live: [0; BLOCKS],
        };
        let mut occluded = [0; BLOCKS];
        for live in by_item(simd, self.hits, lanes) {
            if live != [0; BLOCKS] {
                shadow.live = live;
                let found = occluded_in(simd, &shadow, self.scratch);
                (0..BLOCKS).for_each(|block| occluded[block] |= found[block]);
            }
        }
        for block in 0..BLOCKS {
            for lane in each_bit(lanes[block] & !occluded[block]) {
                self.arrived[block].iter_mut().for_each(|channel| channel.0[lane] += 1.0);
            }
        }
        if self.frame.features.transparent || self.frame.features.shadowless {
            self.follow(&shadow, occluded);
        }
    }

    /// Adds the light that passes the surfaces in the way of the occluded lanes.
    fn follow(&mut self, shadow: &ShadowTile<'_>, occluded: [u32; BLOCKS]) {
        for (block, lanes) in occluded.into_iter().enumerate() {
            for lane in each_bit(lanes) {
                let (ray, starts_on) = (shadow.ray(block, lane), shadow.starts_on(block, lane));
                let share = self.frame.transmittance(&ray, shadow.t_max, starts_on, &mut self.crossings);
                let arrived = &mut self.arrived[block];
                (0..3).for_each(|channel| arrived[channel].0[lane] += share[channel] as f32);
            }
        }
    }
}

/// [`ShadowTile::occluded`] as a function of its own on each level.
#[inline(never)]
fn occluded_in<S: Simd>(simd: S, shadow: &ShadowTile<'_>, scratch: &mut tile::Scratch) -> [u32; BLOCKS] {
    simd.vectorize(
        #[inline(always)]
        || shadow.occluded(simd, scratch),
    )
}

/// The lanes of each set of a light.
fn by_set<R: SurfaceSource>(rays: &R, extent: &Extent, lit: [u32; BLOCKS]) -> Vec<[u32; BLOCKS]> {
    let mut sets = vec![[0; BLOCKS]; extent.sets().count()];
    for (block, lanes) in lit.into_iter().enumerate() {
        if lanes != 0 {
            let pattern: [u8; LANES] = rays.pattern(block);
            for lane in each_bit(lanes) {
                sets[extent.sets().at(pattern[lane])][block] |= 1 << lane;
            }
        }
    }
    sets
}

/// Geometric normals on the side of a place, as the origins of shadow rays are.
#[inline(always)]
fn normals_towards<S: Simd>(
    simd: S,
    place: glam::DVec3,
    surfaces: &crate::surface::Surfaces,
    lit: &[u32; BLOCKS],
) -> [[Lanes; 3]; BLOCKS] {
    let place = Vec3x16::splat(simd, place.as_vec3().to_array());
    let mut normals = [[Lanes::ZERO; 3]; BLOCKS];
    for block in 0..BLOCKS {
        if lit[block] != 0 {
            let surface = &surfaces.blocks[block];
            let (normal, point) = (Vec3x16::load(simd, &surface.ng), Vec3x16::load(simd, &surface.point));
            let behind = normal.dot(place.sub(point)).simd_lt(splat(simd, 0.0));
            let towards = Vec3x16(three!(i => select(behind, -normal.0[i], normal.0[i])));
            towards.store(&mut normals[block]);
        }
    }
    normals
}

/// Those of the lanes that have a place above the tangent plane of their surface.
#[inline(always)]
fn above_horizon<S: Simd>(
    simd: S,
    place: [f32; 3],
    normals: &[[Lanes; 3]; BLOCKS],
    origins: &[[Lanes; 3]; BLOCKS],
    lanes: &[u32; BLOCKS],
) -> [u32; BLOCKS] {
    let place = Vec3x16::splat(simd, place);
    let mut above = [0; BLOCKS];
    for block in 0..BLOCKS {
        if lanes[block] != 0 {
            let to_place = place.sub(Vec3x16::load(simd, &origins[block]));
            let height = Vec3x16::load(simd, &normals[block]).dot(to_place);
            above[block] = lanes[block] & bits(height.simd_gt(splat(simd, 0.0)));
        }
    }
    above
}

/// Adds the contributions of a light times the mean of what arrives from its points.
#[inline(always)]
fn add_shares<S: Simd>(
    simd: S,
    arrived: &TileColors,
    samples: usize,
    contributions: &TileColors,
    lit: [u32; BLOCKS],
    colors: &mut TileColors,
) {
    // Clamped: infinity times a share of zero is NaN.
    let brightest = splat(simd, f32::MAX);
    let samples = splat(simd, samples as f32);
    for block in 0..BLOCKS {
        if lit[block] != 0 {
            let (sum, full) = (&arrived[block], &contributions[block]);
            let before = Vec3x16::load(simd, &colors[block]);
            let share = Vec3x16(three!(i => sum[i].load(simd) / samples));
            let part = share.mul(Vec3x16(three!(i => full[i].load(simd).min(brightest))));
            blend(simd, lit[block], before.add(part), before).store(&mut colors[block]);
        }
    }
}
