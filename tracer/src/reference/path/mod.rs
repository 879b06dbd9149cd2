//! Single paths in `f64`: the radiance of one sample of a pixel by the path integrator's estimator, from the same random numbers.
//!
//! Written from the rendering equation (Kajiya, "The rendering equation", 1986), to be compared path by path:
//!
//! ```text
//! L = L_e + integral f L cos
//! ```
//!
//! L_e at a hit has the weight of multiple importance sampling by the power heuristic (Veach 1997), and so has the light of one light that
//! is selected at each vertex. Besides the scene, four things are shared with the integrator: the random numbers, the piecewise constant
//! distribution of the light of a sky, the layout of the tree of many lights, and the table of the energy of rough reflection. All
//! directions, densities, values and weights are computed here.
//!
//! ```text
//!   numbers      random numbers of a sample
//!   start        the ray of the camera: place in the pixel, place on the lens
//!   hemisphere   directions around a normal
//!   size         size of the scene, which powers of lights depend on
//!   sources      the lights of paths, with their power
//!   light_tree   one of many lights, by its place
//!   sky_light    directions to the sky, by its light
//!   aim          directions to a source, and their densities
//!   parts        how a surface scatters light
//!   interface    the share of light that glass reflects
//!   lobe         rough reflection, and the light that it transmits to a diffuse surface
//!   facets       microfacets
//!   energy       energy of rough reflection
//!   arriving     light of lights that are aimed at
//!   step         a path from vertex to vertex
//! ```

mod aim;
mod arriving;
mod energy;
mod facets;
mod hemisphere;
mod interface;
mod light_tree;
mod lobe;
mod numbers;
mod parts;
mod size;
mod sky_light;
mod sources;
mod start;
mod step;

use super::Oracle;
use super::camera::CameraRay;
use crate::scene::PathSettings;
use numbers::Numbers;
pub(super) use size::half_diagonal;
use sources::Sources;
use step::{Path, Sum};

/// Paths of an oracle whose view has the path integrator.
pub struct PathOracle<'a> {
    oracle: &'a Oracle,
    settings: PathSettings,
    sources: Sources,
}

impl Oracle {
    /// The paths of the view; `None` unless it has the path integrator.
    pub fn paths(&self) -> Option<PathOracle<'_>> {
        let settings = *self.view.integrator.path()?;
        Some(PathOracle { oracle: self, settings, sources: Sources::of(self) })
    }
}

impl PathOracle<'_> {
    /// The time of sample `number` of pixel (x, y), from 0 to 1: see [`Oracle::at_time`].
    pub fn time(&self, x: u32, y: u32, number: u32) -> f64 {
        Numbers::new(&self.settings, [x, y], number).time()
    }

    /// Linear RGB of sample `number` of pixel (x, y), before it is bounded and rounded to the steps of [`crate::PixelSums`].
    pub fn radiance(&self, x: u32, y: u32, number: u32) -> [f64; 3] {
        let numbers = Numbers::new(&self.settings, [x, y], number);
        let CameraRay { ray, in_picture } = self.camera_ray([x, y], &numbers);
        if !in_picture {
            return self.oracle.background_of_camera(ray.direction).to_array();
        }
        let mut sum = Sum::new(f64::from(self.settings.clamp_indirect));
        let mut path = Some(Path::begin(ray));
        for bounce in 0..=u32::from(self.oracle.view.quality.max_depth) {
            let Some(current) = path else { break };
            path = self.advance(bounce, current, &numbers, &mut sum);
        }
        sum.total.to_array()
    }
}
