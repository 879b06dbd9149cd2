//! Random numbers of a sample.

use glam::DVec2;

use crate::sampler::{Dimension, Vertex, pair_of, pixel_seed};
use crate::scene::{PathSettings, Sampler};

/// The random numbers of one sample of a pixel.
pub(super) struct Numbers {
    sampler: Sampler,
    seed: u32,
    number: u32,
}

impl Numbers {
    /// Those of sample `number` of a pixel.
    pub(super) fn new(settings: &PathSettings, [x, y]: [u32; 2], number: u32) -> Self {
        Self { sampler: settings.sampler, seed: pixel_seed(x, y, settings.seed), number }
    }

    /// The place in the pixel, from its top left corner.
    pub(super) fn in_pixel(&self) -> DVec2 {
        self.pair(Dimension::PIXEL)
    }

    /// A pair for the place on the lens.
    pub(super) fn on_lens(&self) -> DVec2 {
        self.pair(Dimension::LENS)
    }

    /// The time between the opening and the closing of the shutter.
    pub(super) fn time(&self) -> f64 {
        self.pair(Dimension::TIME).x
    }

    /// A pair for one use at the vertex after a number of bounces.
    pub(super) fn at_vertex(&self, bounce: u32, vertex: Vertex) -> DVec2 {
        self.pair(Dimension::of(bounce, vertex))
    }

    fn pair(&self, dimension: Dimension) -> DVec2 {
        let [x, y] = pair_of(self.sampler, self.seed, self.number, dimension);
        DVec2::new(f64::from(x), f64::from(y))
    }
}
