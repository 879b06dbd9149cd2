//! The path integrator: Monte-Carlo estimates of the rendering equation (Kajiya, "The rendering equation", 1986).
//!
//! ```text
//! T = 1, L = 0
//! for each vertex:
//!     no hit: L += T background w, end
//!     L += T emission w, on the front side
//!     L += T f(to light) cos / p(light) w, if nothing is in between
//!     direction by the material: T *= f cos / p(direction); roulette from the fourth vertex on
//! ```
//!
//! w are the weights of multiple importance sampling by the power heuristic (Veach 1997): light that two strategies find counts once. The
//! first vertex gets the light of all lights without extent, by tiles of shadow rays, and a sample of the others; later ones, and all in scenes with volumes, get a sample
//! of one light.
//!
//! All random numbers are functions of pixel, sample and dimension (`sampler`), and the radiance of a sample is rounded to whole steps
//! (`film`): a pixel is the same in any segment, pass and thread.
//!
//! ```text
//!   camera        first rays of a sample of each pixel of a tile
//!   queue         paths that go on, generation by generation
//!   group         some samples of all pixels of a tile, from their rays to their radiance
//!   media         transparent bodies: indices of refraction, absorption
//!   medium        volumes: free paths, scattering, transmittance
//!   moving        objects that move while the shutter is open
//!   vertex        sixteen paths at the surfaces that they hit
//!   selected      light of one light that is selected at random, at sixteen vertices
//!   delta         light of all lights without extent at the first vertices of a tile
//!   noise_limit   adaptive sampling: cells of pixels that have enough samples
//! ```

mod camera;
mod delta;
mod group;
mod media;
mod medium;
mod moving;
mod noise_limit;
mod queue;
mod selected;
#[cfg(test)]
mod tests;
mod vertex;

use std::ops::Range;

use super::stage::{Stage, Watch};
use crate::cancel::Cancelled;
use crate::film::{PixelSums, TilePixels, write_counted_sums, write_sums};
use crate::frame::PreparedFrame;
use crate::rays::{BLOCKS, RayCounts, SIDE};
use crate::scene::PathSettings;
use crate::simd::Simd;
use group::Group;
use noise_limit::{FIRST_CHECKPOINT, NoiseLimit, rows_of_cells};

// Groups of samples end at every checkpoint.
const _: () = assert!(FIRST_CHECKPOINT.is_multiple_of(Group::SAMPLES));

/// Renders the tiles of a band of rows.
#[inline(always)]
pub(super) fn render_band<S: Simd, W: Watch>(
    simd: S,
    frame: &PreparedFrame,
    settings: &PathSettings,
    rows: Range<u32>,
    out: &mut [u8],
    cancelled: &dyn Fn() -> bool,
    watch: &mut W,
) -> Result<RayCounts, Cancelled> {
    let view = frame.view();
    let side = SIDE as u32;
    let width = frame.width() as usize;
    let traced = if settings.max_noise > 0.0 { rows_of_cells(&rows, frame.height()) } else { rows.clone() };
    let mut sums = vec![PixelSums::default(); width * traced.len()];
    let mut limit = NoiseLimit::of(view, settings, &traced);
    let mut group = Group::new(frame, settings, cancelled);
    for left in (0..frame.width()).step_by(SIDE) {
        let pixels = TilePixels {
            left,
            right: (left + side).min(frame.width()),
            top: rows.start / side * side,
            rows: traced.clone(),
        };
        watch.enter(Stage::Visible);
        group.begin(&pixels);
        let end = view.first_sample + view.samples;
        for first in (view.first_sample..end).step_by(Group::SAMPLES as usize) {
            let numbers = first..end.min(first + Group::SAMPLES);
            group.trace(simd, numbers.clone(), watch)?;
            group.add_to(&pixels, width, &mut sums);
            if let Some(limit) = &mut limit {
                limit.end_cells(numbers.end, &pixels, &sums, &mut group.live);
                if group.live == [0; BLOCKS] {
                    break;
                }
            }
        }
    }
    watch.enter(Stage::Encoding);
    match &limit {
        None => write_sums(frame, &rows, &sums, out),
        Some(limit) => {
            let requested = width * (rows.start - traced.start) as usize..;
            write_counted_sums(frame, &rows, &sums[requested.clone()], &limit.counts[requested], out);
        }
    }
    Ok(group.counts())
}
