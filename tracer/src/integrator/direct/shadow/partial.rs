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
//! c_t is 1 for a surface that casts no shadow, `transmit` for a transparent one and 0 for all others. Tiles separate the points that
//! opaque items occlude from points with other items in their way; only rays of the latter are followed one by one.

use super::super::super::stage::{Stage, Watch};
use super::super::{TileContext, blend};
use super::{by_item, occluded_one_by_one, target_of};
use crate::frame::PreparedFrame;
use crate::intersect::Crossings;
use crate::intersect::tile::{self, Occlusion, Shaft};
use crate::light::extent::Extent;
use crate::light::{EyeLight, SHADOW_T_MAX};
use crate::rays::{
    BLOCKS, HitBlock, RaySource, ShadowTarget, ShadowTile, SurfaceSource, TileColors, TileRays,
};
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, SimdBase, bits, each_bit, mask_of, select, splat, three};

/// Error of the height of a point above a plane, relative to the largest coordinates: a dozen roundings of an `f32`.
const ROUNDING: f32 = 1.0 / (1 << 19) as f32;

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
        free: [Lanes::ZERO; BLOCKS],
        passed: [[Lanes::ZERO; 3]; BLOCKS],
        traced: 0,
        neighbours: rays.are_neighbours(),
        crossings: Crossings::default(),
        scratch: &mut context.tile,
    };
    let mut samples = 1;
    for group in by_item(simd, points.hits, lit) {
        if group == [0; BLOCKS] {
            continue;
        }
        if let Some(extent) = &light.extent {
            let normals = simd.vectorize(
                #[inline(always)]
                || normals_towards(simd, extent.center(), &context.surfaces, &group),
            );
            points.trace_extent(simd, extent, &normals, &by_set(rays, extent, group), &group);
            samples = extent.sets().points(0).len();
        } else {
            let (target, t_max) = target_of(light);
            points.trace(simd, target, t_max, &group);
        }
    }
    let Points { free, passed, traced, .. } = points;
    context.counts.shadow += traced;
    context.watch.enter(Stage::Shading);
    simd.vectorize(
        #[inline(always)]
        || {
            let colors = &mut context.direct.colors;
            add_shares(simd, (&free, &passed), samples, &context.direct.contributions, lit, colors);
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
    /// Numbers of rays that nothing occludes so far.
    free: [Lanes; BLOCKS],
    /// Sums of the light that passes surfaces along the other rays so far.
    passed: TileColors,
    /// Rays so far, with those that are known to be free without a search of their own.
    traced: u64,
    /// Whether the points are near each other: see [`SurfaceSource::are_neighbours`].
    neighbours: bool,
    crossings: Crossings,
    scratch: &'a mut tile::Scratch,
}

impl Points<'_> {
    /// Traces the rays from some lanes, divided by the sets of a light, to its points one after another.
    fn trace_extent<S: Simd>(
        &mut self,
        simd: S,
        extent: &Extent,
        normals: &[[Lanes; 3]; BLOCKS],
        sets: &[[u32; BLOCKS]],
        lanes: &[u32; BLOCKS],
    ) {
        let (center, radius) = (extent.center(), extent.radius());
        let shaft = Shaft::new(self.frame, self.origins, lanes, center, radius);
        let empty = shaft.is_some_and(|shaft| shaft.is_empty(simd));
        let mut whole = [0; BLOCKS];
        if empty {
            let ball = (center.as_vec3().to_array(), radius as f32);
            whole = simd.vectorize(
                #[inline(always)]
                || above_horizon(simd, ball, normals, self.origins, lanes),
            );
            self.arrive(simd, &whole, extent.sets().points(0).len() as f32);
        }
        for (set, lanes) in sets.iter().enumerate() {
            let lanes = std::array::from_fn(|block| lanes[block] & !whole[block]);
            if lanes == [0; BLOCKS] {
                continue;
            }
            for target in extent.points(set) {
                let above = simd.vectorize(
                    #[inline(always)]
                    || above_horizon(simd, (target.as_vec3().to_array(), 0.0), normals, self.origins, &lanes),
                );
                if empty {
                    self.arrive(simd, &above, 1.0);
                } else if above != [0; BLOCKS] {
                    self.trace(simd, ShadowTarget::Point(target), SHADOW_T_MAX, &above);
                }
            }
        }
    }

    /// Traces the rays from some lanes to one target, and adds the light that arrives.
    fn trace<S: Simd>(&mut self, simd: S, light: ShadowTarget, t_max: f64, lanes: &[u32; BLOCKS]) {
        let shadow = ShadowTile {
            frame: self.frame,
            light,
            t_max,
            grid: self.grid,
            points: self.origins,
            hits: self.hits,
            live: *lanes,
        };
        let Occlusion { occluded, undecided } = if self.neighbours {
            shadow.occlusion(simd, self.scratch)
        } else if self.frame.has_translucent_items() {
            Occlusion { occluded: [0; BLOCKS], undecided: occluded_one_by_one(&shadow) }
        } else {
            Occlusion { occluded: occluded_one_by_one(&shadow), undecided: [0; BLOCKS] }
        };
        self.traced += count(&occluded) + count(&undecided);
        let free = std::array::from_fn(|block| lanes[block] & !(occluded[block] | undecided[block]));
        self.arrive(simd, &free, 1.0);
        self.follow(&shadow, &undecided);
    }

    /// Adds a number of rays that nothing occludes in each of the lanes.
    fn arrive<S: Simd>(&mut self, simd: S, lanes: &[u32; BLOCKS], rays: f32) {
        self.traced += count(lanes) * rays as u64;
        simd.vectorize(
            #[inline(always)]
            || {
                for block in 0..BLOCKS {
                    let more = select(mask_of(simd, lanes[block]), splat(simd, rays), splat(simd, 0.0));
                    let sum = self.free[block].load(simd) + more;
                    self.free[block].store(sum);
                }
            },
        );
    }

    /// Adds the light that passes the surfaces in the way of the undecided lanes.
    fn follow(&mut self, shadow: &ShadowTile<'_>, undecided: &[u32; BLOCKS]) {
        for (block, &lanes) in undecided.iter().enumerate() {
            for lane in each_bit(lanes) {
                let (ray, starts_on) = (shadow.ray(block, lane), shadow.starts_on(block, lane));
                let share = self.frame.transmittance(&ray, shadow.t_max, starts_on, &mut self.crossings);
                let passed = &mut self.passed[block];
                (0..3).for_each(|channel| passed[channel].0[lane] += share[channel] as f32);
            }
        }
    }
}

/// Number of lanes.
fn count(lanes: &[u32; BLOCKS]) -> u64 {
    lanes.iter().map(|lanes| u64::from(lanes.count_ones())).sum()
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

/// Those of the lanes that have a ball above the tangent plane of their surface; a ball of radius 0 is a point. A ball counts
/// only if all points in it do, within the rounding of this function.
#[inline(always)]
fn above_horizon<S: Simd>(
    simd: S,
    (center, radius): ([f32; 3], f32),
    normals: &[[Lanes; 3]; BLOCKS],
    origins: &[[Lanes; 3]; BLOCKS],
    lanes: &[u32; BLOCKS],
) -> [u32; BLOCKS] {
    let center = Vec3x16::splat(simd, center);
    let mut above = [0; BLOCKS];
    for block in 0..BLOCKS {
        if lanes[block] == 0 {
            continue;
        }
        let origin = Vec3x16::load(simd, &origins[block]);
        let height = Vec3x16::load(simd, &normals[block]).dot(center.sub(origin));
        let mut least = splat(simd, 0.0);
        if radius > 0.0 {
            let error = (origin.size() + center.size() + splat(simd, radius)) * splat(simd, ROUNDING);
            least = splat(simd, radius) + error;
        }
        above[block] = lanes[block] & bits(height.simd_gt(least));
    }
    above
}

/// Adds the contributions of a light times the mean of what arrives from its points: by free rays, and through surfaces.
#[inline(always)]
fn add_shares<S: Simd>(
    simd: S,
    (free, passed): (&[Lanes; BLOCKS], &TileColors),
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
            let (free, full) = (free[block].load(simd), &contributions[block]);
            let before = Vec3x16::load(simd, &colors[block]);
            let share = Vec3x16(three!(i => (free + passed[block][i].load(simd)) / samples));
            let part = share.mul(Vec3x16(three!(i => full[i].load(simd).min(brightest))));
            blend(simd, lit[block], before.add(part), before).store(&mut colors[block]);
        }
    }
}
