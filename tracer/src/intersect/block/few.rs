//! Blocks of rays in scenes of few primitives: all sixteen rays against one primitive at a time.
//!
//! A tree of some ten triangles is no help to rays of bounces. Every primitive is tested in lanes instead, in `f32` with error bounds:
//! a ray hits it for certain, misses it for certain, or may hit it, at a distance between two bounds. Where the nearest certain hit is
//! before all others, by more than coincident hits may be apart (see `coincide`), it is the result. All other rays are searched one by
//! one, exactly.
//!
//! Triangles are tested as by Möller and Trumbore ("Fast, Minimum Storage Ray/Triangle Intersection", 1997), spheres by the distance of
//! their centre from the ray.

use crate::frame::{Few, FewSphere, FewTriangle};
use crate::rays::{HitBlock, NO_ITEM, PrimitiveId, RayBlock, RaySource};
use crate::simd::vector::Vec3x16;
use crate::simd::{
    Indices, LANES, Lanes, Simd, SimdBase, SimdFloat, bits, each_bit, f32x16, fma, mask_of, mask32x16,
    select, select_indices, splat, u32x16,
};

/// Error bound of a product of two lengths, relative to the largest coordinate times the largest edge: 16 times that of a dozen
/// operations.
const ERROR: f32 = 1.0 / (1 << 17) as f32;

/// A primitive that rays may hit, lane by lane.
struct Candidates<S: Simd> {
    /// Rays that may hit it, and those that do for certain.
    possible: mask32x16<S>,
    certain: mask32x16<S>,
    /// Bounds of the distance.
    low: f32x16<S>,
    high: f32x16<S>,
}

/// Sixteen rays with directions of unit length.
struct Rays<S: Simd> {
    origin: Vec3x16<S>,
    direction: Vec3x16<S>,
    /// Largest coordinate of the origins.
    reach: f32x16<S>,
    /// Upper ends.
    end: f32x16<S>,
    /// The items that the rays start on.
    starts_on: u32x16<S>,
}

impl Few {
    /// Finds the closest hits of some live rays of a block. Returns the bits of the rays that are left undecided.
    #[inline(always)]
    pub(super) fn find_closest<S: Simd>(
        &self,
        simd: S,
        block: &RayBlock<'_>,
        lanes: u32,
        hits: &mut HitBlock,
    ) -> u32 {
        let rays = Rays::of(simd, block);
        let infinite = splat(simd, f32::INFINITY);
        let mut best = (infinite, infinite, u32x16::splat(simd, NO_ITEM));
        // The least distance of any other hit.
        let mut other = infinite;
        let mut consider = Nearest { best: &mut best, other: &mut other };
        for triangle in &self.triangles {
            let (found, items) = triangle.candidates(simd, &rays, self.drift);
            consider.add(simd, items, found);
        }
        for sphere in &self.spheres {
            let items = u32x16::splat(simd, sphere.item);
            consider.add(simd, items, sphere.candidates(simd, &rays, self.drift));
        }
        let decided = bits(best.1.simd_lt(other)) | bits(other.simd_eq(infinite));
        let decided = decided & lanes;
        let found = decided & bits(best.1.simd_lt(infinite));
        let mut items = Indices::ZERO;
        items.store(best.2);
        for lane in each_bit(found) {
            hits.set(lane, PrimitiveId { item: items.0[lane], triangle: 0 });
        }
        lanes & !decided
    }

    /// Bits of the live rays that hit anything for certain, and of those that are left undecided.
    #[inline(always)]
    pub(super) fn find_any<S: Simd>(&self, simd: S, block: &RayBlock<'_>) -> [u32; 2] {
        let rays = Rays::of(simd, block);
        let live = block.live(0);
        let (mut occluded, mut possible) = (0, 0);
        for triangle in &self.triangles {
            let found = triangle.candidates(simd, &rays, self.drift).0;
            occluded |= bits(found.certain);
            possible |= bits(found.possible);
        }
        for sphere in &self.spheres {
            let found = sphere.candidates(simd, &rays, self.drift);
            occluded |= bits(found.certain);
            possible |= bits(found.possible);
        }
        [occluded & live, possible & !occluded & live]
    }
}

/// The nearest certain hits so far.
struct Nearest<'a, S: Simd> {
    /// Bounds of their distances, and their items.
    best: &'a mut (f32x16<S>, f32x16<S>, u32x16<S>),
    other: &'a mut f32x16<S>,
}

impl<S: Simd> Nearest<'_, S> {
    #[inline(always)]
    fn add(&mut self, simd: S, items: u32x16<S>, found: Candidates<S>) {
        let (low, high, best) = *self.best;
        let infinite = splat(simd, f32::INFINITY);
        let wins = found.certain & found.high.simd_lt(high);
        // What does not win may still be before the end of the best one.
        let beaten = select(wins, low, select(found.possible, found.low, infinite));
        *self.other = self.other.min(beaten);
        *self.best =
            (select(wins, found.low, low), select(wins, found.high, high), select_indices(wins, items, best));
    }
}

impl<S: Simd> Rays<S> {
    #[inline(always)]
    fn of(simd: S, block: &RayBlock<'_>) -> Self {
        let direction = block.directions(simd);
        let length = direction.dot(direction).sqrt();
        let per_length = splat(simd, 1.0) / length;
        let mut end = Lanes([f32::INFINITY; LANES]);
        let mut starts_on = Indices([NO_ITEM; LANES]);
        for lane in each_bit(block.live(0)) {
            end.0[lane] = block.t_max(lane) as f32;
            starts_on.0[lane] = block.starts_on(0, lane).map_or(NO_ITEM, |start| start.item);
        }
        let origin = block.origins(simd);
        Self {
            origin,
            direction: direction.scale(per_length),
            reach: origin.size(),
            end: end.load(simd) * length,
            starts_on: starts_on.load(simd),
        }
    }

    /// Candidates at distances between bounds, of rays that may and that do cross the primitive.
    #[inline(always)]
    fn within(
        &self,
        simd: S,
        [possible, certain]: [mask32x16<S>; 2],
        t: f32x16<S>,
        error: f32x16<S>,
    ) -> Candidates<S> {
        let zero = splat(simd, 0.0);
        // The end of a ray is rounded as well.
        let error = error + t.abs() * splat(simd, ERROR);
        let (low, high) = (t - error, t + error);
        // All that is not outside for certain, even if a number is NaN.
        let outside = high.simd_lt(zero) | low.simd_gt(self.end);
        let inside = low.simd_gt(zero) & high.simd_lt(self.end);
        Candidates { possible: possible & !outside, certain: certain & inside, low, high }
    }
}

impl FewTriangle {
    #[inline(always)]
    fn candidates<S: Simd>(&self, simd: S, rays: &Rays<S>, drift: f32) -> (Candidates<S>, u32x16<S>) {
        let zero = splat(simd, 0.0);
        let one = splat(simd, 1.0);
        let [first, second] = splat_both(simd, &self.edges);
        let from = rays.origin.sub(Vec3x16::splat(simd, self.corner));
        let p = cross(rays.direction, second);
        let q = cross(from, first);
        let determinant = dot(first, p);
        let sign = select(determinant.simd_lt(zero), -one, one);
        let determinant = determinant * sign;
        let u = dot(from, p) * sign;
        let v = dot(rays.direction, q) * sign;
        let (reach, size) = (rays.reach + splat(simd, self.reach), splat(simd, self.size));
        let error = reach * size * splat(simd, ERROR);
        let flat = size * size * splat(simd, ERROR);
        let sum = u + v - determinant;
        let wide = error + error + flat;
        let (outside, inside) = match self.other_half {
            None => (
                u.simd_lt(-error) | v.simd_lt(-error) | sum.simd_gt(wide),
                u.simd_gt(error) & v.simd_gt(error) & sum.simd_lt(-wide),
            ),
            Some(_) => {
                let (low, high) = (u.min(v), u.max(v));
                let beyond = high - determinant;
                // On the edge between the halves it is not known which of them is hit.
                let clear = sum.abs().simd_gt(wide);
                (
                    low.simd_lt(-error) | beyond.simd_gt(wide),
                    low.simd_gt(error) & beyond.simd_lt(-wide) & clear,
                )
            }
        };
        let steep = determinant.simd_gt(flat * splat(simd, 8.0));
        let per = one / select(steep, determinant, flat);
        let t = dot(second, q) * sign * per;
        let error = (error * size + splat(simd, drift * self.area)) * per + t.abs() * flat * per;
        // Along the plane nothing is known of the distance.
        let error = select(steep, error, splat(simd, f32::INFINITY));
        let (item, other) = (u32x16::splat(simd, self.item), self.other_half.unwrap_or(self.item));
        let other = u32x16::splat(simd, other);
        let own = rays.starts_on.simd_eq(item) | rays.starts_on.simd_eq(other);
        let possible = !outside & !own;
        let certain = inside & steep & possible & mask_of(simd, if self.cut { 0 } else { 0xffff });
        let items = select_indices(sum.simd_gt(zero), other, item);
        (rays.within(simd, [possible, certain], t, error), items)
    }
}

impl FewSphere {
    #[inline(always)]
    fn candidates<S: Simd>(&self, simd: S, rays: &Rays<S>, drift: f32) -> Candidates<S> {
        let zero = splat(simd, 0.0);
        let radius = splat(simd, self.radius);
        let from = rays.origin.sub(Vec3x16::splat(simd, self.center));
        let along = zero - dot(from, rays.direction);
        let closest = from.add(rays.direction.scale(along));
        let reach = rays.reach + splat(simd, self.reach);
        let square = radius * radius - dot(closest, closest);
        let error = reach * reach * splat(simd, ERROR);
        let outside = square.simd_lt(-error);
        let inside = square.simd_gt(error);
        let root = select(inside, square, error).sqrt();
        let own = rays.starts_on.simd_eq(u32x16::splat(simd, self.item));
        // Of the sphere that a ray starts on only the far side counts.
        let (near, far) = (along - root, along + root);
        let first = !own & (near.simd_gt(zero));
        let t = select(first, near, far);
        let error = error / root + splat(simd, drift) * (radius / root) + reach * splat(simd, ERROR);
        // At a silhouette, or near the start, nothing is known.
        let clear = inside & near.abs().simd_gt(error) & far.abs().simd_gt(error);
        let clear = clear | (own & inside & far.abs().simd_gt(error));
        let error = select(clear, error, splat(simd, f32::INFINITY));
        rays.within(simd, [!outside, clear], t, error)
    }
}

#[inline(always)]
fn splat_both<S: Simd>(simd: S, edges: &[[f32; 3]; 2]) -> [Vec3x16<S>; 2] {
    [Vec3x16::splat(simd, edges[0]), Vec3x16::splat(simd, edges[1])]
}

/// The cross product, rounded in any way.
#[inline(always)]
fn cross<S: Simd>(a: Vec3x16<S>, b: Vec3x16<S>) -> Vec3x16<S> {
    let ([ax, ay, az], [bx, by, bz]) = (a.0, b.0);
    Vec3x16([fma(ay, bz, -(az * by)), fma(az, bx, -(ax * bz)), fma(ax, by, -(ay * bx))])
}

/// The scalar product, rounded in any way.
#[inline(always)]
fn dot<S: Simd>(a: Vec3x16<S>, b: Vec3x16<S>) -> f32x16<S> {
    let ([ax, ay, az], [bx, by, bz]) = (a.0, b.0);
    fma(az, bz, fma(ay, by, ax * bx))
}
