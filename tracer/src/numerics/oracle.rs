//! Comparison of pixels with the oracle's.

use std::fmt;

use glam::DVec2;
use rayon::prelude::*;

use super::{Effort, Subject};
use crate::reference::Oracle;
use crate::scene::{FrameView, Light, SceneFeatures};

/// Distance in pixels within which a pixel counts as being at an edge: the oracle's colours there bracket the
/// compared colour. The fast path shades points that are rounded to `f32`, to 2^-24 of their distance: in a picture
/// of 16384 pixels that is 2^-10 of one.
const NEXT_TO: f64 = 1.0 / 1024.0;

/// The same distance where curved mirrors or glass magnify the rounding.
const NEXT_TO_BENT: f64 = 1.0 / 128.0;

/// The same distance at the edge of a shadow, where grazing light magnifies the rounding of the point.
const NEXT_TO_SHADOW: f64 = 1.0 / 16.0;

/// Wrong pixels that are described, per case.
const NAMED: usize = 8;

/// A pixel that differs from the oracle's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct WrongPixel {
    /// Column and row.
    at: [u32; 2],
    found: [u8; 3],
    expected: [u8; 3],
}

impl fmt::Display for WrongPixel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { at: [x, y], found, expected } = self;
        write!(f, "pixel ({x}, {y}) is {found:?}, and {expected:?} by the oracle")
    }
}

/// Result of comparing some pixels with the oracle's.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Comparison {
    pub(super) tested: u64,
    pub(super) at_edges: u64,
    pub(super) wrong: u64,
    /// The first wrong pixels.
    pub(super) failures: Vec<WrongPixel>,
}

/// Compares pixels of a scene's picture with the oracle's. A channel may differ by one step of the encoding.
pub(super) fn compare(subject: &Subject, view: &FrameView, picture: &[u8], pixels: &[usize]) -> Comparison {
    let oracle =
        Oracle::new(&subject.scene, &subject.meshes, &subject.textures, view).with_points_of_integrator();
    let compared = |&pixel: &usize| {
        let found = [0, 1, 2].map(|channel| picture[pixel * 3 + channel]);
        let (x, y) = (pixel as u32 % view.width, pixel as u32 / view.width);
        let center = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let seen = |at: DVec2| oracle.encoded_at(at.x, at.y);
        let expected = seen(center);
        let right = is_near(found, expected);
        let at_edge = !right && around(center).any(|ring| is_between(found, ring.map(seen), expected));
        let wrong = !right && !at_edge;
        let failures = Vec::from_iter(wrong.then_some(WrongPixel { at: [x, y], found, expected }));
        Comparison { tested: 1, at_edges: at_edge.into(), wrong: wrong.into(), failures }
    };
    pixels.par_iter().map(compared).reduce(Comparison::default, Comparison::and)
}

impl Comparison {
    /// The sums of both results.
    fn and(mut self, other: Self) -> Self {
        self.failures.extend(other.failures);
        self.failures.truncate(NAMED);
        Self {
            tested: self.tested + other.tested,
            at_edges: self.at_edges + other.at_edges,
            wrong: self.wrong + other.wrong,
            ..self
        }
    }
}

/// Number of pixels that the oracle may compute.
pub(super) fn affordable(subject: &Subject, effort: &Effort) -> usize {
    if let Some(pixels) = effort.pixels {
        return pixels as usize;
    }
    let scene = &subject.scene;
    let triangles_of =
        |id| subject.meshes.iter().find(|mesh| mesh.id() == id).map_or(0, |mesh| mesh.triangle_count());
    let in_models: usize = scene.models.iter().map(|model| triangles_of(model.mesh)).sum();
    let primitives =
        in_models + scene.spheres.len() + scene.disks.len() + scene.planes.len() + scene.triangles.len();
    let quality = scene.render.quality;
    let points = |light: &Light| match light.shadow_samples {
        _ if light.radius == 0.0 => 1,
        Some(samples) => usize::from(samples),
        None => usize::from(quality.shadow_samples),
    };
    let of_surface = 1 + scene.lights.iter().map(points).sum::<usize>();
    // Few samples have more surfaces along their ways, unless nearly all materials bounce.
    let surfaces = if SceneFeatures::of(scene).bounces { 1 + usize::from(quality.max_depth) } else { 1 };
    let rays = of_surface * surfaces;
    (effort.oracle_work / (primitives.max(1) * rays) as u64).clamp(16, 4096) as usize
}

/// `count` of `pixels` indices: up to half of them from `first`, the others from all, both evenly spread.
pub(super) fn chosen(first: &[usize], pixels: usize, count: usize) -> Vec<usize> {
    let step = first.len().div_ceil(count.div_ceil(2)).max(1);
    let mut chosen: Vec<usize> = first.iter().copied().step_by(step).collect();
    let rest = count.saturating_sub(chosen.len()).max(1);
    // The middle of each share, so that the first index is not a corner.
    chosen.extend((0..rest).map(|i| (2 * i + 1) * pixels / (2 * rest)));
    chosen.sort_unstable();
    chosen.dedup();
    chosen
}

fn is_near(found: [u8; 3], expected: [u8; 3]) -> bool {
    found.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 1)
}

/// Whether each channel equals one of the surrounding colours, or is between these: near an edge colours may vary.
pub(super) fn is_between(found: [u8; 3], around: [[u8; 3]; 8], center: [u8; 3]) -> bool {
    (0..3).all(|channel| {
        let seen = || around.iter().chain([&center]).map(|color| color[channel]);
        let (least, greatest) = (seen().min().unwrap_or(0), seen().max().unwrap_or(255));
        (least.saturating_sub(1)..=greatest.saturating_add(1)).contains(&found[channel])
    })
}

/// Rings of positions around one.
fn around(center: DVec2) -> impl Iterator<Item = [DVec2; 8]> {
    let steps = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)];
    let ring = move |away: f64| steps.map(|(x, y)| center + DVec2::new(f64::from(x), f64::from(y)) * away);
    [NEXT_TO, NEXT_TO_BENT, NEXT_TO_SHADOW].into_iter().map(ring)
}
