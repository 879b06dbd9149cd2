//! Reflection and transmission: Hall's terms c_r I(R) + c_t I(T) (Whitted, "An Improved Illumination Model for Shaded Display",
//! 1980).
//!
//! The secondary rays of a tile are traced generation by generation: all rays after one bounce, then all after two. Each
//! generation is cut into batches of 256 rays, which are shaded as a tile is. A sample sums the contributions of its rays in the
//! order of their generations, and within a generation in the order of its own rays, so the sum does not depend on other samples.
//!
//! ```text
//!   secondary   rays that a surface reflects or transmits
//!   mirrors     rays that one plane reflects: traced as a tile
//! ```

mod mirrors;
mod secondary;
#[cfg(test)]
mod tests;

use glam::DVec3;

use crate::bsdf::Media;
use crate::cancel::Cancelled;
use crate::frame::PreparedFrame;
use crate::intersect::tile::Scratch;
use crate::rays::{
    BATCH, BLOCKS, HitBlock, PrimitiveId, Ray, RayBatch, RayCounts, SurfaceSource, TileColors, TileRays,
};
use crate::scene::Material;
use crate::simd::{LANES, Lanes, Simd, each_bit};
use crate::surface::{SurfaceBlock, Surfaces};
use mirrors::Mirrors;
use secondary::{Interaction, Secondary};

/// Most secondary rays of one sample. Materials that both reflect and transmit double the rays with each bounce, without a limit if
/// `min_contribution` is 0.
const MOST_OF_SAMPLE: u16 = RayCounts::MAX_SECONDARY;

/// Traces and shades batches of rays, in the memory of the current tile.
pub(super) trait BatchShader<'a> {
    /// The frame.
    fn frame(&self) -> &'a PreparedFrame;

    /// What the last tile or batch hits.
    fn shaded(&mut self) -> Shaded<'_>;

    /// Memory of intersections.
    fn scratch(&mut self) -> &mut Scratch;

    /// Traces and shades a batch of secondary rays. The hits already have those of the rays in `known`, and none of the others.
    ///
    /// # Errors
    /// [`Cancelled`], polled before the batch is traced.
    fn shade<S: Simd>(
        &mut self,
        simd: S,
        batch: &RayBatch<'_>,
        known: [u32; BLOCKS],
    ) -> Result<(), Cancelled>;
}

/// Hits, surface points and colours of a tile or batch that is shaded.
pub(super) struct Shaded<'b> {
    pub hits: &'b mut [HitBlock; BLOCKS],
    pub surfaces: &'b Surfaces,
    pub colors: &'b mut TileColors,
}

/// Queues and memory of the secondary rays of a tile, kept from tile to tile.
pub(super) struct Bounces<'a> {
    /// Colours of the tile's samples so far.
    sums: TileColors,
    /// The current generation, and the reflected and the transmitted rays of the next one.
    queue: Vec<Secondary>,
    reflected: Vec<Secondary>,
    transmitted: Vec<Secondary>,
    /// Places of the tile's samples in the pattern of soft shadows. Only set in scenes with such shadows.
    patterns: [[u8; LANES]; BLOCKS],
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
                patterns: [[0; LANES]; BLOCKS],
                counts: [0; BATCH],
                batch: RayBatch::new(frame),
                mirrors: Mirrors::new(),
            })
        })
    }
}

impl<'a> Bounces<'a> {
    /// Adds what the surfaces of a shaded tile reflect and transmit to its colours.
    ///
    /// # Errors
    /// [`Cancelled`], polled before each batch.
    #[inline(never)]
    pub(super) fn add<S: Simd, R: SurfaceSource>(
        &mut self,
        simd: S,
        tile: &R,
        shader: &mut impl BatchShader<'a>,
    ) -> Result<(), Cancelled> {
        self.begin(tile, shader);
        if self.reflected.is_empty() && self.transmitted.is_empty() {
            return Ok(());
        }
        match tile.eye() {
            Some(eye) => self.mirrors.find(simd, eye, &self.reflected, shader.scratch()),
            None => self.mirrors.clear(),
        }
        self.trace(simd, tile.places(), shader)
    }

    fn trace<S: Simd>(
        &mut self,
        simd: S,
        places: &TileRays,
        shader: &mut impl BatchShader<'a>,
    ) -> Result<(), Cancelled> {
        self.sums = *shader.shaded().colors;
        let max_depth = shader.frame().view().quality.max_depth;
        for depth in 1..=max_depth {
            self.queue.clear();
            self.queue.append(&mut self.reflected);
            self.queue.append(&mut self.transmitted);
            let queue = std::mem::take(&mut self.queue);
            for rays in queue.chunks(BATCH) {
                self.trace_batch(simd, places, rays, depth, shader)?;
                self.collect(rays, depth < max_depth, shader.frame(), &shader.shaded());
            }
            self.queue = queue;
        }
        *shader.shaded().colors = self.sums;
        Ok(())
    }

    /// Starts the first generation from the hits of a tile.
    fn begin<R: SurfaceSource>(&mut self, tile: &R, shader: &mut impl BatchShader<'a>) {
        self.reflected.clear();
        self.transmitted.clear();
        self.counts = [0; BATCH];
        let frame = shader.frame();
        if frame.features.soft_shadows {
            self.patterns = std::array::from_fn(|block| tile.pattern(block));
        }
        let materials = &frame.scene().materials;
        let goes_on = frame.view().quality.max_depth > 0;
        let Shaded { hits, surfaces, colors } = shader.shaded();
        for block in 0..BLOCKS {
            let surface = &surfaces.blocks[block];
            for lane in each_bit(bouncing(surface, materials)) {
                let ray = tile.ray(block, lane);
                let primitive = hits[block].slot(lane);
                let hit = Hit { ray: &ray, surface, hits: &hits[block], lane };
                let incoming = Incoming {
                    starts_on: tile.starts_on(block, lane),
                    weight: DVec3::ONE,
                    way: 0.0,
                    media: Media::default(),
                    sample: (block * LANES + lane) as u16,
                };
                let Some((interaction, left)) = hit.interaction(frame, primitive, &incoming) else {
                    continue;
                };
                if let Some(left) = left {
                    absorb(&mut colors[block], lane, left);
                }
                if goes_on {
                    self.enqueue(&interaction, frame);
                }
            }
        }
    }

    /// Appends the scattered rays of an interaction to the next generation.
    fn enqueue(&mut self, interaction: &Interaction<'_>, frame: &PreparedFrame) {
        let scattered = interaction.scatter(frame);
        let count = &mut self.counts[usize::from(interaction.sample)];
        for (secondary, generation) in
            [(scattered.reflected, &mut self.reflected), (scattered.transmitted, &mut self.transmitted)]
        {
            if let Some(secondary) = secondary.filter(|_| *count < MOST_OF_SAMPLE) {
                *count += 1;
                generation.push(secondary);
            }
        }
    }

    /// Traces and shades a batch.
    fn trace_batch<S: Simd>(
        &mut self,
        simd: S,
        places: &TileRays,
        rays: &[Secondary],
        depth: u8,
        shader: &mut impl BatchShader<'a>,
    ) -> Result<(), Cancelled> {
        let soft_shadows = shader.frame().features.soft_shadows;
        let mut known = [0; BLOCKS];
        let batch = &mut self.batch;
        batch.clear();
        for (index, secondary) in rays.iter().enumerate() {
            batch.set(index, secondary.ray, f64::INFINITY, Some(secondary.starts_on));
            let (block, lane) = place_of(usize::from(secondary.sample));
            let (to_block, to_lane) = place_of(index);
            batch.ways[to_block][to_lane] = secondary.way;
            batch.places.x[to_block].0[to_lane] = places.x[block].0[lane];
            batch.places.y[to_block].0[to_lane] = places.y[block].0[lane];
            if soft_shadows {
                batch.patterns[to_block][to_lane] = self.patterns[block][lane];
            }
        }
        for (block, hits) in shader.shaded().hits.iter_mut().enumerate() {
            *hits = HitBlock::NONE;
            let start = (block * LANES).min(rays.len());
            let of_block = &rays[start..rays.len().min(start + LANES)];
            // Only the first generation starts on the hits of a tile of the camera.
            known[block] = if depth == 1 { self.mirrors.put(of_block, hits) } else { 0 };
        }
        let together: u32 = known.iter().map(|lanes| lanes.count_ones()).sum();
        batch.neighbours = 2 * together as usize >= rays.len();
        shader.shade(simd, batch, known)
    }

    /// Adds the colours of a batch to the samples, and enqueues the rays that its surfaces scatter.
    fn collect(&mut self, rays: &[Secondary], goes_on: bool, frame: &PreparedFrame, shaded: &Shaded<'_>) {
        let materials = &frame.scene().materials;
        for (index, secondary) in rays.iter().enumerate() {
            let (block, lane) = place_of(index);
            let surface = &shaded.surfaces.blocks[block];
            let mut weight = secondary.weight;
            if let Some(primitive) = shaded.hits[block].primitive(lane) {
                let hit = Hit { ray: &secondary.ray, surface, hits: &shaded.hits[block], lane };
                let incoming = Incoming {
                    starts_on: Some(secondary.starts_on),
                    weight,
                    way: secondary.way,
                    media: secondary.media,
                    sample: secondary.sample,
                };
                let material = hit.material(materials);
                let goes_on = goes_on && material.bounces();
                if goes_on || secondary.media.may_absorb(materials, material) {
                    let Some((interaction, _)) = hit.interaction(frame, primitive, &incoming) else {
                        continue;
                    };
                    weight = interaction.weight;
                    if goes_on {
                        self.enqueue(&interaction, frame);
                    }
                }
            } else if let Some(left) = secondary.media.transmittance_to_infinity(materials) {
                weight *= left;
            }
            let (of_block, of_lane) = place_of(usize::from(secondary.sample));
            for channel in 0..3 {
                let color = f64::from(shaded.colors[block][channel].0[lane]);
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
fn bouncing(surface: &SurfaceBlock, materials: &[Material]) -> u32 {
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
    /// Length of the way between it and the camera, in eye units.
    way: f64,
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
    fn material<'m>(&self, materials: &'m [Material]) -> &'m Material {
        &materials[self.surface.material.0[self.lane] as usize]
    }

    /// The interaction of a ray with the surface, and the transmittance of its way inside a transparent body.
    fn interaction<'m>(
        &self,
        frame: &'m PreparedFrame,
        primitive: PrimitiveId,
        incoming: &Incoming,
    ) -> Option<(Interaction<'m>, Option<DVec3>)> {
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
            incoming.media.transmittance(materials, (index, front), t * length / frame.per_unit)
        } else {
            None
        };
        let coincides = self.hits.coincident >> lane & 1 == 1;
        let interaction = Interaction {
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
            way: incoming.way + t * length,
            media: incoming.media,
            sample: incoming.sample,
        };
        Some((interaction, left))
    }
}
