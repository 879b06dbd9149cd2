//! Guides of the denoiser: what the centre of each pixel shows.

use crate::image::{ImageError, LinearImage};
use crate::scene::Shading;

/// The pictures of [`Guides`], in the order of its arguments.
pub const GUIDES: [Shading; 3] = [Shading::Albedo, Shading::Normals, Shading::Depth];

/// Least albedo that light is divided by: darker surfaces have highlights rather than a texture.
const LEAST_ALBEDO: f32 = 1.0 / 32.0;

/// Properties of the surface in each pixel of a picture, rows from top to bottom.
#[derive(Clone, Debug, PartialEq)]
pub struct Guides {
    width: usize,
    pixels: Vec<Guide>,
}

/// The surface in a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Guide {
    /// Divisor of the light: the diffuse colour, at least [`LEAST_ALBEDO`].
    pub albedo: [f32; 3],
    /// Shading normal; 0 without a hit.
    pub normal: [f32; 3],
    /// Distance from the camera; infinite without a hit.
    pub depth: f32,
    /// Change of the depth from column to column and from row to row; 0 next to an edge on both sides.
    pub slope: [f32; 2],
}

impl Guides {
    /// The guides of a picture: numbers of the auxiliary pictures [`Shading::Albedo`], [`Shading::Normals`] and [`Shading::Depth`] of its
    /// view, in [`PixelFormat::Linear`](crate::PixelFormat::Linear).
    ///
    /// # Errors
    /// Pictures of different sizes, or with another number of numbers than their size says.
    pub fn new(albedo: &LinearImage, normals: &LinearImage, depth: &LinearImage) -> Result<Self, ImageError> {
        [normals, depth].into_iter().try_for_each(|other| albedo.check_against(other))?;
        let width = albedo.width as usize;
        let [albedo, normals, depth] =
            [albedo, normals, depth].map(|picture| picture.pixels.as_chunks::<3>().0);
        let pixel = |((albedo, normal), depth): ((&[f32; 3], &[f32; 3]), &[f32; 3])| Guide {
            albedo: albedo.map(divisor),
            normal: normal.map(|value| if value.is_finite() { value } else { 0.0 }),
            depth: if depth[0] >= 0.0 { depth[0] } else { f32::INFINITY },
            slope: [0.0; 2],
        };
        let mut pixels: Vec<Guide> = albedo.iter().zip(normals).zip(depth).map(pixel).collect();
        for index in 0..pixels.len() {
            pixels[index].slope = slope(&pixels, width, index);
        }
        Ok(Self { width, pixels })
    }

    /// Refuses another number of sums than there are pixels.
    pub(super) fn check(&self, sums: usize) -> Result<(), ImageError> {
        let (width, expected) = (self.width as u32, self.pixels.len());
        let height = (expected / self.width.max(1)) as u32;
        if sums == expected {
            Ok(())
        } else {
            Err(ImageError::WrongBuffer { width, height, expected, actual: sums })
        }
    }

    /// Pixels of a row.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    /// All pixels, rows from top to bottom.
    pub(super) fn pixels(&self) -> &[Guide] {
        &self.pixels
    }
}

/// A divisor of light from an albedo. Not a number counts as none.
fn divisor(albedo: f32) -> f32 {
    if albedo > LEAST_ALBEDO { albedo.min(1.0) } else { LEAST_ALBEDO }
}

/// The smaller of the changes of the depth to the pixels on both sides, along both axes: the change within the surface of the pixel.
fn slope(pixels: &[Guide], width: usize, index: usize) -> [f32; 2] {
    let own = pixels[index].depth;
    let column = index % width;
    let before = [(column > 0).then(|| index - 1), index.checked_sub(width)];
    let after =
        [(column + 1 < width).then(|| index + 1), Some(index + width).filter(|at| *at < pixels.len())];
    let change = |from: f32, to: f32| Some(to - from).filter(|change| change.is_finite());
    [0, 1].map(|axis| {
        let backward = before[axis].and_then(|at| change(pixels[at].depth, own));
        let forward = after[axis].and_then(|at| change(own, pixels[at].depth));
        match (backward, forward) {
            (Some(one), Some(other)) if one.abs() <= other.abs() => one,
            (Some(one), None) => one,
            (_, other) => other.unwrap_or(0.0),
        }
    })
}
