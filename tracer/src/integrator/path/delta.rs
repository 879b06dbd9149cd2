//! Light of all lights without extent at the first vertices of a tile: their shadow rays are tiles.

use std::f32::consts::PI;

use super::super::direct::shadow;
use super::super::stage::{Stage, Watch};
use super::group::Group;
use crate::bsdf::scattering::Scattering;
use crate::light::EyeLight;
use crate::rays::{BLOCKS, TileColors};
use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, SimdBase, bits, splat};

impl Group<'_> {
    /// Adds the light of all lights without extent to the samples of the current batch.
    #[inline(always)]
    pub(super) fn add_delta_lights<S: Simd, W: Watch>(&mut self, simd: S, watch: &mut W) {
        let frame = self.frame;
        // Shadow tiles leave out surfaces that light may pass. All occlude here: light through glass is found by hitting its source.
        self.batch.neighbours &= !frame.has_translucent_items();
        for light in frame.lights.iter().filter(|light| light.extent.is_none()) {
            self.add_delta_light(simd, light, watch);
        }
    }

    #[inline(always)]
    fn add_delta_light<S: Simd, W: Watch>(&mut self, simd: S, light: &EyeLight, watch: &mut W) {
        let mut lit = [0; BLOCKS];
        let mut contributions: TileColors = [[Lanes::ZERO; 3]; BLOCKS];
        let mut origins = [[Lanes::ZERO; 3]; BLOCKS];
        for block in 0..BLOCKS {
            let candidates = self.surfaces.blocks[block].lit;
            if candidates != 0 {
                let reached =
                    self.unoccluded(simd, light, block, &mut contributions[block], &mut origins[block]);
                lit[block] = reached & candidates;
            }
        }
        if lit == [0; BLOCKS] {
            return;
        }
        if light.shadows {
            self.counts.shadow += lit.iter().map(|lanes| u64::from(lanes.count_ones())).sum::<u64>();
            watch.enter(Stage::Shadows);
            let occluded =
                shadow::occluded(simd, &self.batch, &self.hits, light, &origins, lit, &mut self.scratch);
            watch.enter(Stage::Shading);
            for block in 0..BLOCKS {
                lit[block] &= !occluded[block];
            }
            if self.moving.is_some() {
                self.shade_by_moving(light, &origins, &mut lit);
            }
        }
        for block in 0..BLOCKS {
            self.add(simd, block, lit[block], 1, Vec3x16::load(simd, &contributions[block]));
        }
    }

    /// Computes the light that would arrive at the points of a block without anything in between, and the origins of their shadow rays.
    /// Returns the bits of the points with any.
    #[inline(always)]
    fn unoccluded<S: Simd>(
        &self,
        simd: S,
        light: &EyeLight,
        block: usize,
        contribution: &mut [Lanes; 3],
        origins: &mut [Lanes; 3],
    ) -> u32 {
        let surface = &self.surfaces.blocks[block];
        let incoming = self.incoming(simd, block, surface.hit);
        let setting = self.setting(simd, block, surface.hit, &incoming);
        let points = Vec3x16::load(simd, &surface.point);
        let incidence = light.incidence(simd, points);
        let scattering = Scattering::gather(simd, self.frame, &self.surfaces, block, &setting);
        let value = scattering.eval(simd, incidence.direction).value;
        let arriving = value.mul(incidence.radiance).scale(splat(simd, PI)).mul(incoming.weight);
        arriving.store(contribution);
        let along = setting.geometric.dot(incidence.direction);
        let side = self.surfaces.to_shadow_origins(simd, block, along);
        points.add(setting.geometric.scale(side)).store(origins);
        let zero = splat(simd, 0.0);
        let [r, g, b] = arriving.0;
        let any = bits(r.max(g).max(b).simd_gt(zero)) & bits(along.simd_gt(zero));
        any & incidence.reached
    }
}
