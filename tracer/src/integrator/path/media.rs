//! Transparent bodies along paths: indices of refraction, and absorption inside.

use glam::DVec3;

use super::group::Group;
use super::vertex::Incoming;
use crate::bsdf::Media;
use crate::rays::RaySource;
use crate::scene::Material;
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, each_bit, three};

impl Group<'_> {
    /// The material that a path hits, its index, and whether the path hits its front.
    fn hit_side(&self, block: usize, lane: usize) -> (&Material, u32, bool) {
        let surface = &self.surfaces.blocks[block];
        let index = surface.material.0[lane];
        let point = DVec3::from_array(three!(axis => f64::from(surface.point[axis].0[lane])));
        let of_moving = if self.moving.is_some() { self.hits_moving_front(block, lane, point) } else { None };
        let front = of_moving.unwrap_or_else(|| {
            let outwards = self.frame.front_normal(self.hits[block].slot(lane), point);
            outwards.dot(self.batch.ray(block, lane).direction) < 0.0
        });
        (&self.frame.scene().materials[index as usize], index, front)
    }

    /// n_from / n_to for a path that enters the surface that it hits; 1 for all but bodies with Fresnel shares.
    pub(super) fn eta_at(&self, block: usize, lane: usize) -> f32 {
        let (material, index, front) = self.hit_side(block, lane);
        if !(material.is_transparent() || material.fresnel) || material.thin {
            return 1.0;
        }
        let media = &self.path(block, lane).media;
        media.interface(&self.frame.scene().materials, index, front).eta as f32
    }

    /// The bodies around a path behind the surface that it hits.
    pub(super) fn media_behind(&self, block: usize, lane: usize) -> Media {
        let (material, index, front) = self.hit_side(block, lane);
        let media = self.path(block, lane).media;
        if material.thin {
            media
        } else {
            media.interface(&self.frame.scene().materials, index, front).behind
        }
    }

    /// Where the refracted ray of a path starts: exactly on the surface, whose primitive it does not hit again, so that it hits bodies that
    /// touch the surface. Where surfaces coincide it starts in front of both of them, crosses the other one next, and then starts behind
    /// both.
    pub(super) fn refraction_origin(&self, block: usize, lane: usize) -> Option<DVec3> {
        let (hits, surface) = (&self.hits[block], &self.surfaces.blocks[block]);
        let ray = self.batch.ray(block, lane);
        let met = self.moving.as_ref().map_or(ray, |moving| moving.ray_at_rest(block, lane));
        let t = self.frame.t_of(&met, hits.primitive(lane)?, self.batch.starts_on(block, lane))?;
        let ng = DVec3::from_array(three!(axis => f64::from(surface.ng[axis].0[lane])));
        let apart = 4.0 * self.frame.coarsest;
        let before = if hits.coincident >> lane & 1 == 1 {
            apart
        } else if t * ng.dot(ray.direction).abs() <= 2.0 * apart {
            -apart
        } else {
            0.0
        };
        Some(ray.origin + ray.direction * t + ng * before)
    }

    /// Multiplies the weights of paths by the share of light that is left after their way inside of a body.
    #[inline(never)]
    pub(super) fn absorb<S: Simd>(&self, simd: S, block: usize, hit: u32, incoming: &mut Incoming<S>) {
        let materials = &self.frame.scene().materials;
        let mut left = [Lanes([1.0; LANES]); 3];
        let mut any = false;
        for lane in each_bit(hit) {
            let (material, index, front) = self.hit_side(block, lane);
            let media = &self.path(block, lane).media;
            if !media.may_absorb(materials, material) {
                continue;
            }
            let surface = &self.surfaces.blocks[block];
            let point = DVec3::from_array(three!(axis => f64::from(surface.point[axis].0[lane])));
            let way = (point - self.batch.ray(block, lane).origin).length() / self.frame.per_unit;
            if let Some(share) = media.transmittance(materials, (index, front), way) {
                any = true;
                for channel in 0..3 {
                    left[channel].0[lane] = share[channel] as f32;
                }
            }
        }
        if any {
            incoming.weight = incoming.weight.mul(Vec3x16::load(simd, &left));
        }
    }

    /// Light from ahead of paths, or of their hits, times the share that is left after ways that end at no surface; `ways` in eye units.
    #[inline(never)]
    pub(super) fn absorbed_ahead<S: Simd>(
        &self,
        simd: S,
        (block, lanes): (usize, u32),
        ways: &[f64; LANES],
        light: &Vec3x16<S>,
    ) -> Vec3x16<S> {
        let mut left = [Lanes([1.0; LANES]); 3];
        for lane in each_bit(lanes) {
            let way = ways[lane] / self.frame.per_unit;
            let media = &self.path(block, lane).media;
            if let Some(share) = media.transmittance_ahead(&self.frame.scene().materials, way) {
                for channel in 0..3 {
                    left[channel].0[lane] = share[channel] as f32;
                }
            }
        }
        light.mul(Vec3x16::load(simd, &left))
    }
}
