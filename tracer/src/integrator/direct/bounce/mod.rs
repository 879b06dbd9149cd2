//! Reflection and transmission: Hall's terms c_r I(R) + c_t I(T) (Whitted, "An Improved Illumination Model for Shaded Display",
//! 1980).
//!
//! The secondary rays of a tile are traced generation by generation: all rays after one bounce, then all after two. Each
//! generation is cut into batches of 256 rays, which are shaded as a tile is. A sample sums the contributions of its rays in the
//! order of their generations, and within a generation in the order of its own rays, so the sum does not depend on other samples.
//!
//! ```text
//!   secondary   rays that leave a surface
//!   media       the transparent bodies around a ray
//!   mirrors     rays that one plane reflects: traced as a tile
//! ```

mod media;
mod mirrors;
mod secondary;
#[cfg(test)]
mod tests;

use glam::DVec3;

use super::super::stage::{Stage, Watch};
use super::TileContext;
use crate::cancel::Cancelled;
use crate::frame::PreparedFrame;
use crate::rays::{BATCH, BLOCKS, HitBlock, PrimitiveId, Ray, RayBatch, SurfaceSource, TileColors, TileRays};
use crate::simd::{LANES, Lanes, Simd, each_bit};
use crate::surface::SurfaceBlock;
use media::Media;
use mirrors::Mirrors;
use secondary::{Arrival, Secondary};

/// Most secondary rays of one sample: what two mirrors of glass in each other would send on for ever ends here. Rays with less than
/// 0.004 of the light, the default of `min_contribution`, end before.
const MOST_OF_SAMPLE: u16 = crate::rays::RayCounts::MAX_SECONDARY;

/// Queues and memory of the secondary rays of a tile, kept from tile to tile.
pub(super) struct Bounces<'a> {
    /// Colours of the tile's samples so far.
    sums: TileColors,
    /// The current generation, and the reflected and the transmitted rays of the next one.
    queue: Vec<Secondary>,
    reflected: Vec<Secondary>,
    transmitted: Vec<Secondary>,
    /// Rays of each sample so far.
    counts: [u16; BATCH],
    batch: RayBatch<'a>,
    mirrors: Mirrors,
}

impl<'a> Bounces<'a> {
    /// Memory for the tiles of a frame whose scene bounces.
    pub(super) fn for_frame(frame: &'a PreparedFrame) -> Option<Box<Self>> {
        frame.features.bounces.then(|| {
            Box::new(Self {
                sums: [[Lanes::ZERO; 3]; BLOCKS],
                queue: Vec::new(),
                reflected: Vec::new(),
                transmitted: Vec::new(),
                counts: [0; BATCH],
                batch: RayBatch::new(frame),
                mirrors: Mirrors::new(),
            })
        })
    }
}

/// Adds what the surfaces of a traced and shaded tile reflect and transmit to its colours.
///
/// # Errors
/// [`Cancelled`], polled before each batch.
#[inline(never)]
pub(super) fn add<S: Simd, R: SurfaceSource, W: Watch>(
    simd: S,
    tile: &R,
    context: &mut TileContext<'_, W>,
) -> Result<(), Cancelled> {
    let Some(mut bounces) = context.bounces.take() else { return Ok(()) };
    bounces.begin(tile, context);
    if let Some(eye) = tile.eye() {
        bounces.mirrors.find(simd, eye, &bounces.reflected, &mut context.tile);
    } else {
        bounces.mirrors.clear();
    }
    let result = bounces.trace(simd, tile.places(), context);
    context.bounces = Some(bounces);
    result
}

impl<'a> Bounces<'a> {
    fn trace<S: Simd, W: Watch>(
        &mut self,
        simd: S,
        places: &TileRays,
        context: &mut TileContext<'a, W>,
    ) -> Result<(), Cancelled> {
        if self.reflected.is_empty() && self.transmitted.is_empty() {
            return Ok(());
        }
        self.sums = context.direct.colors;
        let max_depth = context.frame.view().quality.max_depth;
        for depth in 1..=max_depth {
            self.queue.clear();
            self.queue.append(&mut self.reflected);
            self.queue.append(&mut self.transmitted);
            let queue = std::mem::take(&mut self.queue);
            for rays in queue.chunks(BATCH) {
                self.trace_batch(simd, places, rays, depth, context)?;
                self.collect(rays, depth < max_depth, context);
            }
            self.queue = queue;
        }
        context.direct.colors = self.sums;
        Ok(())
    }

    /// Starts the first generation from the hits of a tile.
    fn begin<R: SurfaceSource, W>(&mut self, tile: &R, context: &mut TileContext<'_, W>) {
        self.reflected.clear();
        self.transmitted.clear();
        self.counts = [0; BATCH];
        let materials = &context.frame.scene().materials;
        for block in 0..BLOCKS {
            let surface = &context.surfaces.blocks[block];
            for lane in each_bit(bouncing(surface, materials)) {
                let ray = tile.ray(block, lane);
                let primitive = context.hits[block].slot(lane);
                let hit = Hit { ray: &ray, surface, hits: &context.hits[block], lane };
                let incoming = Incoming {
                    starts_on: tile.starts_on(block, lane),
                    weight: DVec3::ONE,
                    media: Media::default(),
                    sample: (block * LANES + lane) as u16,
                };
                let Some((arrival, left)) = hit.arrival(context.frame, primitive, &incoming) else {
                    continue;
                };
                if let Some(left) = left {
                    absorb(&mut context.direct.colors[block], lane, left);
                }
                self.leave(&arrival, context.frame);
            }
        }
    }

    /// Appends the rays that leave a surface to the next generation.
    fn leave(&mut self, arrival: &Arrival<'_>, frame: &PreparedFrame) {
        let departures = arrival.departures(frame);
        let count = &mut self.counts[usize::from(arrival.sample)];
        for (secondary, generation) in
            [(departures.reflected, &mut self.reflected), (departures.transmitted, &mut self.transmitted)]
        {
            if let Some(secondary) = secondary.filter(|_| *count < MOST_OF_SAMPLE) {
                *count += 1;
                generation.push(secondary);
            }
        }
    }

    /// Traces and shades a batch, into `context.direct.colors`.
    fn trace_batch<S: Simd, W: Watch>(
        &mut self,
        simd: S,
        places: &TileRays,
        rays: &[Secondary],
        depth: u8,
        context: &mut TileContext<'a, W>,
    ) -> Result<(), Cancelled> {
        if context.is_cancelled() {
            return Err(Cancelled);
        }
        context.watch.enter(Stage::Secondary);
        context.counts.secondary += rays.len() as u64;
        context.hits.iter_mut().for_each(|hits| *hits = HitBlock::NONE);
        let mut known = [0; BLOCKS];
        let batch = &mut self.batch;
        batch.clear();
        for (index, secondary) in rays.iter().enumerate() {
            batch.set(index, secondary.ray, f64::INFINITY, Some(secondary.starts_on));
            let (block, lane) = place_of(usize::from(secondary.sample));
            let (to_block, to_lane) = place_of(index);
            batch.places.x[to_block].0[to_lane] = places.x[block].0[lane];
            batch.places.y[to_block].0[to_lane] = places.y[block].0[lane];
        }
        for (block, hits) in context.hits.iter_mut().enumerate() {
            let start = (block * LANES).min(rays.len());
            let of_block = &rays[start..rays.len().min(start + LANES)];
            // Only the first generation leaves a tile of the camera.
            known[block] = if depth == 1 { self.mirrors.put(of_block, hits) } else { 0 };
        }
        context.trace_batch(simd, batch, known);
        Ok(())
    }

    /// Adds the colours of a batch to the samples, and collects the rays that leave its surfaces.
    fn collect<W>(&mut self, rays: &[Secondary], goes_on: bool, context: &TileContext<'_, W>) {
        let frame = context.frame;
        let materials = &frame.scene().materials;
        for (index, secondary) in rays.iter().enumerate() {
            let (block, lane) = place_of(index);
            let surface = &context.surfaces.blocks[block];
            let mut weight = secondary.weight;
            if let Some(primitive) = context.hits[block].primitive(lane) {
                let hit = Hit { ray: &secondary.ray, surface, hits: &context.hits[block], lane };
                let incoming = Incoming {
                    starts_on: Some(secondary.starts_on),
                    weight,
                    media: secondary.media,
                    sample: secondary.sample,
                };
                let material = hit.material(materials);
                let goes_on = goes_on && material.bounces();
                if goes_on || secondary.media.may_absorb(materials, material) {
                    let Some((arrival, _)) = hit.arrival(frame, primitive, &incoming) else { continue };
                    weight = arrival.weight;
                    if goes_on {
                        self.leave(&arrival, frame);
                    }
                }
            } else if let Some(left) = secondary.media.left_without_end(materials) {
                weight *= left;
            }
            let (of_block, of_lane) = place_of(usize::from(secondary.sample));
            for channel in 0..3 {
                let color = f64::from(context.direct.colors[block][channel].0[lane]);
                let sum = &mut self.sums[of_block][channel].0[of_lane];
                *sum += (weight[channel] * color) as f32;
            }
        }
    }
}

/// Block and lane of a ray of a batch, or of a sample of a tile.
fn place_of(index: usize) -> (usize, usize) {
    (index / LANES, index % LANES)
}

/// Bits of the points whose material reflects or transmits.
fn bouncing(surface: &SurfaceBlock, materials: &[crate::scene::Material]) -> u32 {
    let of = |lane: &usize| materials[surface.material.0[*lane] as usize].bounces();
    each_bit(surface.hit).filter(of).fold(0, |lanes, lane| lanes | 1 << lane)
}

/// Multiplies the colour of a sample.
fn absorb(colors: &mut [Lanes; 3], lane: usize, left: DVec3) {
    for channel in 0..3 {
        let color = &mut colors[channel].0[lane];
        *color = (f64::from(*color) * left[channel]) as f32;
    }
}

/// A ray as it comes to a surface.
struct Incoming {
    starts_on: Option<PrimitiveId>,
    /// Its weight where it starts.
    weight: DVec3,
    media: Media,
    sample: u16,
}

/// A surface point that a ray hits.
struct Hit<'a> {
    ray: &'a Ray,
    surface: &'a SurfaceBlock,
    hits: &'a HitBlock,
    lane: usize,
}

impl Hit<'_> {
    fn material<'m>(&self, materials: &'m [crate::scene::Material]) -> &'m crate::scene::Material {
        &materials[self.surface.material.0[self.lane] as usize]
    }

    /// The arrival of a ray, and the share of light that its way inside a transparent body leaves.
    fn arrival<'m>(
        &self,
        frame: &'m PreparedFrame,
        primitive: PrimitiveId,
        incoming: &Incoming,
    ) -> Option<(Arrival<'m>, Option<DVec3>)> {
        let (surface, lane) = (self.surface, self.lane);
        let t = frame.t_of(self.ray, primitive, incoming.starts_on)?;
        let length = self.ray.direction.length();
        let point = self.ray.origin + self.ray.direction * t;
        let outwards = frame.front_normal(primitive, point);
        let front = outwards.dot(self.ray.direction) < 0.0;
        let ng = if front { outwards } else { -outwards };
        let index = surface.material.0[lane];
        let materials = &frame.scene().materials;
        let material = &materials[index as usize];
        let flat = frame.is_flat(primitive) && material.normal_map.is_none();
        let ns = if flat {
            ng
        } else {
            DVec3::from_array([0, 1, 2].map(|axis| f64::from(surface.ns[axis].0[lane]))).normalize()
        };
        let left = if frame.features.transparent {
            incoming.media.left_after(materials, (index, front), t * length / frame.per_unit)
        } else {
            None
        };
        let coincides = self.hits.coincident >> lane & 1 == 1;
        let arrival = Arrival {
            direction: self.ray.direction / length,
            point,
            t,
            primitive,
            ng,
            ns,
            on_plane: flat && frame.is_planar(primitive),
            front,
            index,
            material,
            coincidence: if coincides { 4.0 * frame.coarsest } else { 0.0 },
            weight: left.map_or(incoming.weight, |left| incoming.weight * left),
            media: incoming.media,
            sample: incoming.sample,
        };
        Some((arrival, left))
    }
}
