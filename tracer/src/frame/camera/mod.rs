//! Cameras: pixels to rays in eye space.
//!
//! A place of the picture is in pixels from its top left corner. With n x n samples a pixel, sample i along a side of its pixel
//! is at (i + 0.5) / n, so that the samples are a regular grid over the picture.
//!
//! ```text
//!   basis      the axes of a camera
//!   pinhole    all rays start in a point, through the places of a view plane
//!   parallel   an orthographic camera: all rays have one direction, and start on a plane
//!   fisheye    all rays start in a point, at an angle that grows with the distance from the picture's centre
//! ```

mod basis;
mod fisheye;
mod parallel;
mod pinhole;

use super::affine::Affine;
use crate::scene::{CameraKind, FrameView};
pub use basis::Basis;
pub(crate) use fisheye::{FisheyeRay, FisheyeRays};
pub(crate) use parallel::ParallelRays;
pub(crate) use pinhole::PinholeRays;

/// Rays of a camera, by its kind.
#[derive(Clone, Copy, Debug)]
pub(crate) enum CameraRays {
    Pinhole(PinholeRays),
    Parallel(ParallelRays),
    Fisheye(FisheyeRays),
}

impl CameraRays {
    /// The rays of a view, in eye space with `per_unit` eye units per world unit.
    pub(crate) fn new(view: &FrameView, per_unit: f64) -> Self {
        match view.camera.kind {
            CameraKind::Pinhole { fov_axis } => Self::Pinhole(PinholeRays::new(view, fov_axis)),
            CameraKind::Orthographic { view_height } => {
                Self::Parallel(ParallelRays::new(view, view_height * per_unit))
            }
            CameraKind::Fisheye => Self::Fisheye(FisheyeRays::new(view)),
        }
    }

    /// Samples along a side of a pixel.
    pub(crate) fn grid(&self) -> u32 {
        match self {
            Self::Pinhole(rays) => rays.grid(),
            Self::Parallel(rays) => rays.grid(),
            Self::Fisheye(rays) => rays.grid(),
        }
    }

    /// Map from eye space to (a, b, g) of the camera's picture: see `rays::Projection`. The picture of a fisheye camera is not
    /// an image under an affine map: no tile is projected there, and this is the identity.
    pub(crate) fn picture_map(&self) -> Affine {
        match self {
            Self::Pinhole(rays) => rays.picture_map(),
            Self::Parallel(rays) => rays.picture_map(),
            Self::Fisheye(_) => Affine::IDENTITY,
        }
    }
}
