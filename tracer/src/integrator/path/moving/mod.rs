//! Objects that move while the shutter is open. A path has one time, and all its rays meet the objects in their poses at that time.
//!
//! Still objects are hit first, in tiles or blocks; then each ray is tested against the objects that move. What a ray hits there is a
//! surface of the object at rest, hit by the ray that the inverse of the pose maps there; the surface point is taken back to the pose.

#[cfg(test)]
mod tests;

use glam::DVec3;

use super::super::direct::shadow;
use super::group::Group;
use crate::frame::{Motions, Pose, PreparedFrame};
use crate::intersect::TimedRay;
use crate::light::EyeLight;
use crate::rays::{BATCH, BLOCKS, HitBlock, Ray, RayBatch, RaySource};
use crate::sampler::{Dimension, pair_of};
use crate::scene::Sampler;
use crate::simd::{LANES, Lanes, Simd, each_bit};
use crate::surface::Surfaces;

/// The times of the rays of a batch, and their hits of objects that move.
pub(super) struct MovingHits<'a> {
    frame: &'a PreparedFrame,
    motions: &'a Motions,
    /// Times from 0, when the shutter opens, to 1, when it closes.
    times: [[f64; LANES]; BLOCKS],
    /// The rays as the objects that they hit meet them at rest; those that hit still ones or nothing are as they are.
    at_rest: RayBatch<'a>,
    /// Bits of the rays that hit objects that move.
    moved: [u32; BLOCKS],
}

impl<'a> MovingHits<'a> {
    /// For the rays of a frame; `None` if nothing moves.
    pub(super) fn of(frame: &'a PreparedFrame) -> Option<Box<Self>> {
        let motions = frame.motions.as_deref()?;
        let at_rest = RayBatch::new(frame);
        Some(Box::new(Self { frame, motions, times: [[0.0; LANES]; BLOCKS], at_rest, moved: [0; BLOCKS] }))
    }

    /// Sets the time of a ray from the seed of its pixel and the number of its sample.
    pub(super) fn set_time(&mut self, index: usize, sampler: Sampler, (seed, number): (u32, u32)) {
        let [time, _] = pair_of(sampler, seed, number, Dimension::TIME);
        self.times[index / LANES][index % LANES] = f64::from(time);
    }

    /// The pose of the object that a ray hits, if it moves.
    fn pose_of(&self, hits: &HitBlock, block: usize, lane: usize) -> Option<Pose> {
        if self.moved[block] >> lane & 1 == 0 {
            return None;
        }
        Some(self.motions.of(hits.item.0[lane])?.pose(self.times[block][lane]))
    }

    /// A ray of a batch at its time.
    fn timed(&self, batch: &RayBatch<'_>, block: usize, lane: usize) -> TimedRay {
        TimedRay {
            ray: batch.ray(block, lane),
            t_max: batch.blocks[block].t_max(lane),
            starts_on: batch.starts_on(block, lane),
            time: self.times[block][lane],
        }
    }

    /// A ray of the current batch as the object that it hits meets it at rest; t is the same.
    pub(super) fn ray_at_rest(&self, block: usize, lane: usize) -> Ray {
        self.at_rest.ray(block, lane)
    }

    /// Replaces the hits of rays that hit an object that moves before.
    fn find_hits(&mut self, batch: &RayBatch<'_>, hits: &mut [HitBlock; BLOCKS]) {
        self.at_rest.clear();
        self.at_rest.of_camera = batch.of_camera;
        self.at_rest.neighbours = batch.neighbours;
        for (block, hits) in hits.iter_mut().enumerate() {
            self.moved[block] = 0;
            let rays = &batch.blocks[block];
            for lane in each_bit(batch.live(block)) {
                let timed = self.timed(batch, block, lane);
                let mut ray = timed.ray;
                let found = self.frame.closest_moving(&timed, || self.frame.hit_in(rays, hits, lane));
                if let Some(found) = found {
                    ray = found.at_rest;
                    hits.set(lane, found.hit.primitive);
                    hits.coincident = hits.coincident & !(1 << lane) | u32::from(found.coincident) << lane;
                    self.moved[block] |= 1 << lane;
                }
                self.at_rest.set(block * LANES + lane, ray, timed.t_max, timed.starts_on);
            }
        }
    }

    /// Takes the surface points of objects that move to their poses.
    fn take_to_poses(&self, hits: &[HitBlock; BLOCKS], surfaces: &mut Surfaces) {
        for (block, hits) in hits.iter().enumerate() {
            for lane in each_bit(self.moved[block]) {
                if let Some(pose) = self.pose_of(hits, block, lane) {
                    surfaces.take_to(block, lane, &pose);
                }
            }
        }
    }
}

impl Group<'_> {
    /// Sets the times of the first rays of the samples with a number.
    #[inline(never)]
    pub(super) fn set_first_times(&mut self, number: u32) {
        let Some(moving) = &mut self.moving else { return };
        for index in 0..BATCH {
            let seed = self.seeds[index / LANES].0[index % LANES];
            moving.set_time(index, self.settings.sampler, (seed, number));
        }
    }

    /// Sets the times of the paths of the current batch.
    #[inline(never)]
    pub(super) fn set_times(&mut self) {
        let Some(mut moving) = self.moving.take() else { return };
        for (index, path) in self.current[self.base..].iter().take(BATCH).enumerate() {
            moving.set_time(index, self.settings.sampler, self.seed_and_number(path.sample));
        }
        self.moving = Some(moving);
    }

    /// Finds the surface points of the current batch, whose hits are those of still objects.
    #[inline(never)]
    pub(super) fn find_moving_surfaces<S: Simd>(&mut self, simd: S) {
        let Some(moving) = &mut self.moving else { return };
        moving.find_hits(&self.batch, &mut self.hits);
        self.surfaces.find_of_batch(simd, &moving.at_rest, &self.hits);
        moving.take_to_poses(&self.hits, &mut self.surfaces);
    }

    /// Whether a path hits the front of an object that moves; `None` of others.
    #[inline(never)]
    pub(super) fn hits_moving_front(&self, block: usize, lane: usize, point: DVec3) -> Option<bool> {
        let moving = self.moving.as_ref()?;
        let pose = moving.pose_of(&self.hits[block], block, lane)?;
        let outwards = self.frame.front_normal(self.hits[block].slot(lane), pose.point_to_rest(point));
        Some(outwards.dot(moving.ray_at_rest(block, lane).direction) < 0.0)
    }

    /// Bits of some of the current shadow rays that hit an object that moves. With `of_light`, those do not count that let all light pass.
    #[inline(never)]
    pub(super) fn behind_moving(&self, block: usize, lanes: u32, of_light: bool) -> u32 {
        let Some(moving) = &self.moving else { return 0 };
        let rays = &self.shadow_rays;
        let mut hidden = 0;
        for lane in each_bit(lanes & rays.live(0)) {
            let (ray, t_max) = (rays.ray(0, lane), rays.t_max(lane));
            let (starts_on, time) = (rays.starts_on(0, lane), moving.times[block][lane]);
            let hit = self.frame.hits_moving(&TimedRay { ray, t_max, starts_on, time }, of_light);
            hidden |= u32::from(hit) << lane;
        }
        hidden
    }

    /// Removes the points of the current batch that objects that move hide from a light without extent.
    #[inline(never)]
    pub(super) fn shade_by_moving(
        &self,
        light: &EyeLight,
        points: &[[Lanes; 3]; BLOCKS],
        lit: &mut [u32; BLOCKS],
    ) {
        let Some(moving) = &self.moving else { return };
        let tile = shadow::tile_of(&self.batch, &self.hits, light, points, *lit);
        for (block, lit) in lit.iter_mut().enumerate() {
            for lane in each_bit(*lit) {
                let (ray, starts_on) = (tile.ray(block, lane), tile.starts_on(block, lane));
                let time = moving.times[block][lane];
                let timed = TimedRay { ray, t_max: tile.t_max, starts_on, time };
                *lit &= !(u32::from(self.frame.hits_moving(&timed, true)) << lane);
            }
        }
    }
}
