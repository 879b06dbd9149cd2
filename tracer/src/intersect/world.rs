//! Closest hit and any hit of rays in world space: the public interface.

use glam::DVec3;

use super::{Hit, TimedRay};
use crate::compile::Item;
use crate::frame::PreparedFrame;
use crate::rays::{HitBlock, PrimitiveId, RayBatch, RayBlock, RaySource};
use crate::simd::{LANES, each_bit};

/// The hit of a ray with the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// The point is origin + `t` * direction.
    pub t: f64,
    /// The primitive that is hit.
    pub primitive: Primitive,
}

/// A primitive of a scene, by its place in [`crate::scene::Scene`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Primitive {
    /// A triangle of a model's mesh.
    Model {
        /// Index of the model in the scene.
        model: usize,
        /// Index of the triangle in the model's [`crate::mesh::CompiledMesh`].
        triangle: u32,
    },
    /// Index of a sphere.
    Sphere(usize),
    /// Index of a triangle of the scene file.
    Triangle(usize),
    /// Index of a disk.
    Disk(usize),
    /// Index of a plane.
    Plane(usize),
}

/// A ray of world space, with the primitive that it starts on: see [`PreparedFrame::closest_hits`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RaySegment {
    /// Start of the ray.
    pub origin: DVec3,
    /// Direction, of any length; t is in its lengths.
    pub direction: DVec3,
    /// Hits count within 0 < t < `t_max`.
    pub t_max: f64,
    /// The primitive that the ray starts on, which it does not hit again. Of a sphere the far side is hit.
    pub starts_on: Option<Primitive>,
}

impl PreparedFrame {
    /// The closest hit with 0 < t < `t_max` of the ray origin + t * direction, in world space, from either side of a
    /// surface.
    ///
    /// `direction` need not be a unit vector; t is in its lengths. The hit is that of an exact test (in `f64`) of all
    /// primitives in turn, to the bit and on every machine. No ray passes between two triangles that share an edge (Woop,
    /// Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT 2013). Rays pass where alpha cuts a triangle out.
    /// Of surfaces that coincide within the rounding of their corners, the same one is hit everywhere: one of an item
    /// before one of an infinite plane, then one that faces the ray before one seen from behind, then the first in the
    /// scene: models before spheres before triangles before disks before planes, and in a mesh the first triangle of its file.
    /// Objects that move are where they are when the shutter opens.
    ///
    /// Returns `None` also for an origin or a direction that is not finite, or a direction whose largest component is not
    /// within 1e-100 to 1e100.
    pub fn closest_hit(&self, origin: DVec3, direction: DVec3, t_max: f64) -> Option<RayHit> {
        let ray = self.to_eye(origin, direction)?;
        let still = self.closest(&ray, t_max, None);
        let moving = self.closest_at_opening(TimedRay { ray, t_max, starts_on: None, time: 0.0 }, || still);
        Some(self.in_scene(&moving.or(still)?))
    }

    /// Whether there is a hit with 0 < t < `t_max`. The same as [`PreparedFrame::closest_hit`], in less time.
    pub fn any_hit(&self, origin: DVec3, direction: DVec3, t_max: f64) -> bool {
        self.to_eye(origin, direction).is_some_and(|ray| {
            self.hits_anything(&ray, t_max, None)
                || self.hits_moving(&TimedRay { ray, t_max, starts_on: None, time: 0.0 }, false)
        })
    }

    /// The closest hits of up to sixteen rays of any origins and directions, each that of [`PreparedFrame::closest_hit`],
    /// to the bit. Rays behind the sixteenth are ignored.
    pub fn closest_hits(&self, rays: &[RaySegment]) -> [Option<RayHit>; LANES] {
        let block = self.block_of(rays);
        let mut hits = HitBlock::NONE;
        self.closest_hits_of(&block, u32::MAX, &mut hits);
        std::array::from_fn(|lane| {
            let still = self.hit_in(&block, &hits, lane);
            let moving = self.closest_at_opening(at_opening(&block, lane)?, || still);
            Some(self.in_scene(&moving.or(still)?))
        })
    }

    /// Bits of those of up to sixteen rays that hit anything: [`PreparedFrame::any_hit`] of each.
    pub fn any_hits(&self, rays: &[RaySegment]) -> u32 {
        let block = self.block_of(rays);
        let of_moving = (0..LANES)
            .filter(|&lane| at_opening(&block, lane).is_some_and(|ray| self.hits_moving(&ray, false)));
        of_moving.fold(self.any_hits_of(&block), |hits, lane| hits | 1 << lane)
    }

    /// The closest hit of an item that moves, as it is when the shutter opens, if it is before a still one.
    fn closest_at_opening(&self, ray: TimedRay, still: impl FnOnce() -> Option<Hit>) -> Option<Hit> {
        self.closest_moving(&ray, still).map(|moving| moving.hit)
    }

    fn block_of(&self, rays: &[RaySegment]) -> RayBlock<'_> {
        let mut block = RayBlock::new(self);
        for (lane, segment) in rays.iter().take(LANES).enumerate() {
            if let Some(ray) = self.to_eye(segment.origin, segment.direction) {
                block.set(lane, ray, segment.t_max, segment.starts_on.map(|primitive| self.id_of(primitive)));
            }
        }
        block
    }

    /// The live rays of a batch in world space, in its order.
    pub(crate) fn segments_of<'b>(&'b self, batch: &'b RayBatch<'_>) -> impl Iterator<Item = RaySegment> {
        let segment = move |block: &'b RayBlock<'_>, lane: usize| {
            let (ray, t_max) = (block.ray(0, lane), block.t_max(lane));
            let origin = self.view().camera.position + ray.origin / self.per_unit;
            let starts_on = block.starts_on(0, lane).map(|primitive| self.named(primitive));
            RaySegment { origin, direction: ray.direction / self.per_unit, t_max, starts_on }
        };
        batch
            .blocks
            .iter()
            .flat_map(move |block| each_bit(block.live(0)).map(move |lane| segment(block, lane)))
    }

    /// The name of a hit's primitive in the scene.
    fn in_scene(&self, hit: &Hit) -> RayHit {
        RayHit { t: hit.t, primitive: self.named(hit.primitive) }
    }

    fn named(&self, PrimitiveId { item, triangle }: PrimitiveId) -> Primitive {
        if item >= self.items.first_plane() {
            return Primitive::Plane((item - self.items.first_plane()) as usize);
        }
        match self.items.get(item) {
            Item::Model(model) => Primitive::Model { model, triangle },
            Item::Sphere(index) => Primitive::Sphere(index),
            Item::Triangle(index) => Primitive::Triangle(index),
            Item::Disk(index) => Primitive::Disk(index),
        }
    }

    /// The index of a primitive of the scene; one that the scene does not have equals no primitive of a hit.
    pub(super) fn id_of(&self, primitive: Primitive) -> PrimitiveId {
        let item = match primitive {
            Primitive::Model { model, triangle } => {
                return PrimitiveId { item: self.items.index_of(Item::Model(model)), triangle };
            }
            Primitive::Sphere(index) => self.items.index_of(Item::Sphere(index)),
            Primitive::Triangle(index) => self.items.index_of(Item::Triangle(index)),
            Primitive::Disk(index) => self.items.index_of(Item::Disk(index)),
            Primitive::Plane(index) => self.items.first_plane().saturating_add(index as u32),
        };
        PrimitiveId { item, triangle: 0 }
    }
}

/// A live ray of a block when the shutter opens.
fn at_opening(block: &RayBlock<'_>, lane: usize) -> Option<TimedRay> {
    let (ray, t_max, starts_on) = (block.ray(0, lane), block.t_max(lane), block.starts_on(0, lane));
    (block.live(0) >> lane & 1 == 1).then_some(TimedRay { ray, t_max, starts_on, time: 0.0 })
}
