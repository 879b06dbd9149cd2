//! The oracle: the shading equations in `f64`, without SIMD or shortcuts. Every ray is tested against every
//! primitive, but for triangles whose boxes it misses clearly.
//!
//! Of a frame's quality it applies omitted terms (shadows, highlights) and the filter; it is exact where a setting trades
//! precision for speed. It shares with the fast path only the scene, the cleaned triangles, the sRGB encoding and on request the
//! points of lights; all else is computed from the equations of the model of light, to be compared with them.
//!
//! ```text
//!   flatten      the scene as a list of primitives
//!   motion       the scene at a time while the shutter is open
//!   shape        primitives, and their intersection
//!   cull         triangles that a ray may hit
//!   attributes   texture coordinates and vertex colours of points on shapes
//!   camera       rays of the camera
//!   visibility   closest hits, and the light that passes between two points
//!   surface      the point that a ray hits
//!   texture      texture lookups
//!   pyramid      textures in ever smaller sizes
//!   footprint    texture lookups over the part of a surface that a sample shows
//!   material     colours and tilted normals of a surface point
//!   terminator   where shadow rays start
//!   extent       the share of a light that arrives, also of one with a radius
//!   shading      the shading equation without bounces
//!   sky          the background
//!   optics       reflection, refraction, Fresnel's equations
//!   bodies       the transparent bodies around a ray
//!   bounce       reflected and transmitted rays
//!   path         single paths of the path integrator
//!   auxiliary    pictures without light: normals, depth, items, diffuse colours
//! ```

mod attributes;
mod auxiliary;
mod bodies;
mod bounce;
mod camera;
mod cull;
mod extent;
mod flatten;
mod footprint;
mod material;
mod motion;
mod optics;
mod path;
mod pyramid;
mod shading;
mod shape;
mod sky;
mod surface;
mod terminator;
#[cfg(test)]
mod tests;
mod texture;
mod visibility;

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use crate::image::RgbImage;
use crate::intersect::{RayHit, RaySegment};
use crate::light::extent::Sets;
use crate::mesh::CompiledMesh;
use crate::scene::{Filter, FrameView, Light, Scene, TextureMap};
use crate::srgb;
use crate::texture::Texture;
use cull::Boxes;
pub use path::PathOracle;
use pyramid::Level;
use shape::Primitive;
use visibility::Found;

/// Relative error of an `f64` after a handful of operations.
const F64_ERROR: f64 = 1.0 / (1_u64 << 50) as f64;

/// A scene, flattened to world space relative to the camera.
pub struct Oracle {
    scene: Scene,
    view: FrameView,
    textures: Vec<Arc<Texture>>,
    primitives: Vec<Primitive>,
    boxes: Boxes,
    /// Points on each light: see [`Oracle::with_light_points`].
    light_points: Vec<Vec<Vec<DVec3>>>,
    /// The levels of each texture; none if no texture is filtered by them.
    pyramids: Vec<Vec<Level>>,
    size: f64,
    /// Half of the diagonal of all finite objects, in world units.
    half_diagonal: Option<f64>,
}

impl Oracle {
    /// Flattens a scene. Meshes and textures that it names must be among the given ones; a model without its mesh is skipped, a
    /// missing texture is white.
    pub fn new(
        scene: &Scene,
        meshes: &[Arc<CompiledMesh>],
        textures: &[Arc<Texture>],
        view: &FrameView,
    ) -> Self {
        let primitives = flatten::flatten(scene, meshes, view);
        let boxes = Boxes::new(&primitives);
        let half_diagonal = path::half_diagonal(scene, meshes);
        let size = primitives.iter().map(|p| p.shape.size()).fold(0.0, f64::max);
        let filter_of = |map: &TextureMap| view.quality.filter.unwrap_or(map.filter);
        let trilinear = scene.textures.iter().any(|map| filter_of(map) == Filter::Trilinear);
        let pyramids =
            textures.iter().filter(|_| trilinear).map(|texture| pyramid::levels(texture)).collect();
        let shown = scene.shown_directly().filter(|_| view.shows_materials_directly());
        let (scene, textures) = (shown.unwrap_or_else(|| scene.clone()), textures.to_vec());
        Self {
            scene,
            view: *view,
            textures,
            primitives,
            boxes,
            light_points: Vec::new(),
            pyramids,
            size,
            half_diagonal,
        }
    }

    /// Replaces the dense sampling of lights with a radius. For each light of the scene, sets of the points that shadow rays go to,
    /// from its centre in units of its radius. Of n sets, a sample at the place (column % 2) + 2 (row % 2) of the picture's samples
    /// uses that with the index place % n. A light without sets keeps the dense sampling.
    #[must_use]
    pub fn with_light_points(self, light_points: Vec<Vec<Vec<DVec3>>>) -> Self {
        Self { light_points, ..self }
    }

    /// As [`Oracle::with_light_points`], with the points of the direct integrator: the noise of both pictures is then the same.
    #[must_use]
    pub fn with_points_of_integrator(self) -> Self {
        let sets_of = |light: &Light| {
            let full = &self.scene.render.quality;
            let sets = Sets::of(light.shadow_samples_at(full, &self.view.quality));
            (0..sets.count()).map(|set| sets.points(set).to_vec()).collect()
        };
        let light_points = self.scene.lights.iter().map(sets_of).collect();
        self.with_light_points(light_points)
    }

    /// Linear RGB of a pixel: the mean over its samples.
    pub fn pixel(&self, x: u32, y: u32) -> DVec3 {
        let n = self.view.samples.isqrt();
        let mut sum = DVec3::ZERO;
        for j in 0..n {
            for i in 0..n {
                let sx = f64::from(x) + (f64::from(i) + 0.5) / f64::from(n);
                let sy = f64::from(y) + (f64::from(j) + 0.5) / f64::from(n);
                sum += self.shown(&self.camera_ray(sx, sy));
            }
        }
        sum / f64::from(n * n)
    }

    /// A pixel in 8-bit sRGB.
    pub fn encoded_pixel(&self, x: u32, y: u32) -> [u8; 3] {
        srgb::encode(self.pixel(x, y).as_vec3())
    }

    /// Colour of one ray in 8-bit sRGB, through a point of the picture in pixels from its top left corner.
    pub fn encoded_at(&self, x: f64, y: f64) -> [u8; 3] {
        srgb::encode(self.shown(&self.camera_ray(x, y)).as_vec3())
    }

    /// The whole picture, rows in parallel.
    pub fn render(&self) -> RgbImage {
        let (width, height) = (self.view.width, self.view.height);
        let row = |y: u32| (0..width).flat_map(move |x| self.encoded_pixel(x, y));
        let pixels = (0..height).into_par_iter().flat_map_iter(row).collect();
        RgbImage { width, height, pixels }
    }

    /// The hit of a ray from the camera in any direction; the point is camera + t * direction.
    pub fn closest_hit(&self, direction: DVec3) -> Option<RayHit> {
        let found = self.closest(DVec3::ZERO, direction, f64::INFINITY, None)?;
        Some(self.named(&found))
    }

    /// The hit of any ray of world space.
    pub fn closest_hit_of(&self, ray: &RaySegment) -> Option<RayHit> {
        let origin = ray.origin - self.view.camera.position;
        let starts_on = ray
            .starts_on
            .and_then(|name| self.primitives.iter().position(|primitive| primitive.name == name));
        let found = self.closest(origin, ray.direction, ray.t_max, starts_on)?;
        Some(self.named(&found))
    }

    fn named(&self, found: &Found) -> RayHit {
        RayHit { t: found.crossing.t, primitive: self.primitives[found.primitive].name }
    }
}
