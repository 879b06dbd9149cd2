//! A path from vertex to vertex.

use glam::DVec3;

use super::super::bodies::Bodies;
use super::super::camera::Ray;
use super::super::surface::SurfacePoint;
use super::PathOracle;
use super::light_tree::Receiver;
use super::numbers::Numbers;
use super::parts::Scattered;
use crate::sampler::Vertex;

/// Bounces after which roulette begins: from the fourth vertex on.
const BOUNCES_BEFORE_ROULETTE: u32 = 3;

/// Distance between surfaces that coincide, relative to the scene's size and the distance from the camera: more than rounding moves them.
const NEAR: f64 = 1e-12;

/// A path between two vertices.
pub(super) struct Path {
    pub ray: Ray,
    /// The primitive that the ray starts on.
    pub starts_on: Option<usize>,
    /// T: the factor of the light that the path finds.
    pub weight: DVec3,
    /// Density of the ray's direction over solid angle; infinite where no other direction was possible.
    pub density: f64,
    /// The transparent bodies around the ray.
    pub bodies: Bodies,
    /// The last vertex.
    pub from: Receiver,
}

/// The light of a sample.
pub(super) struct Sum {
    /// Largest channel of light that was scattered more than once; 0 is no limit.
    limit: f64,
    pub total: DVec3,
}

impl Sum {
    /// No light.
    pub(super) fn new(limit: f64) -> Self {
        Self { limit, total: DVec3::ZERO }
    }

    /// Adds light that was scattered a number of times.
    pub(super) fn add(&mut self, scattered: u32, light: DVec3) {
        let most = light.max_element();
        let limited = self.limit > 0.0 && scattered > 1 && most > self.limit;
        self.total += if limited { light * (self.limit / most) } else { light };
    }
}

impl Path {
    /// A path that begins with a ray of the camera.
    pub(super) fn begin(ray: Ray) -> Self {
        let bodies = Bodies::default();
        let from = Receiver { position: ray.origin, normal: DVec3::ZERO };
        Self { ray, starts_on: None, weight: DVec3::ONE, density: f64::INFINITY, bodies, from }
    }
}

/// Weight of a direction that one strategy finds with a density, and another one with `other`: p^2 / (p^2 + q^2).
pub(super) fn power_heuristic(density: f64, other: f64) -> f64 {
    if density.is_infinite() {
        return 1.0;
    }
    density * density / (density * density + other * other)
}

impl PathOracle<'_> {
    /// Follows a path to its next vertex, and adds the light that arrives there. Returns the path that goes on.
    pub(super) fn advance(
        &self,
        bounce: u32,
        mut path: Path,
        numbers: &Numbers,
        sum: &mut Sum,
    ) -> Option<Path> {
        let oracle = self.oracle;
        let materials = &oracle.scene.materials;
        let Some(surface) = oracle.surface(path.ray, path.starts_on) else {
            sum.add(bounce, self.seen_background(bounce, &path));
            return None;
        };
        path.weight *= path.bodies.remaining(materials, (surface.material_index, surface.front), surface.way);
        sum.add(bounce, self.emitted(bounce, &path, &surface));
        if oracle.material(&surface).unlit {
            sum.add(bounce, path.weight * oracle.diffuse(&surface));
            return None;
        }
        if bounce == u32::from(oracle.view.quality.max_depth) {
            return None;
        }
        let parts = self.parts(&path, &surface);
        self.add_arriving(bounce, &path, (&surface, &parts), numbers, sum);
        parts.scatter(bounce, numbers).and_then(|next| self.go_on(bounce, path, &surface, next, numbers))
    }

    /// The background along a path that hits nothing.
    fn seen_background(&self, bounce: u32, path: &Path) -> DVec3 {
        let direction = path.ray.direction;
        if bounce == 0 {
            return self.oracle.background_of_camera(direction);
        }
        let other = self.density_of_sky((self.sources.among(bounce - 1), &path.from), direction);
        let left = path.bodies.remaining_at_infinity(&self.oracle.scene.materials);
        path.weight * left * self.oracle.background(direction) * power_heuristic(path.density, other)
    }

    /// The emission of a surface along a path.
    fn emitted(&self, bounce: u32, path: &Path, surface: &SurfacePoint) -> DVec3 {
        let emission = self.oracle.emission(surface);
        if bounce == 0 || emission == DVec3::ZERO {
            return path.weight * emission;
        }
        let among = self.sources.among(bounce - 1);
        let way = (path.ray.origin, path.ray.direction, surface.way);
        let other = self.density_of_hit((among, &path.from), surface.primitive, way);
        path.weight * emission * power_heuristic(path.density, other)
    }

    /// The path in a scattered direction, unless roulette ends it: it survives with the probability min(1, sqrt(T)) of the largest channel.
    fn go_on(
        &self,
        bounce: u32,
        path: Path,
        surface: &SurfacePoint,
        scattered: Scattered,
        numbers: &Numbers,
    ) -> Option<Path> {
        let Scattered { direction, weight, density, through } = scattered;
        // Shading normals send light to the wrong side of the surface.
        let side = if through { -surface.ng } else { surface.ng };
        let mut weight = path.weight * weight;
        let most = weight.max_element();
        if !(side.dot(direction) > 0.0 && most > 0.0) {
            return None;
        }
        if self.settings.roulette && bounce >= BOUNCES_BEFORE_ROULETTE {
            let survival = most.sqrt().min(1.0);
            if numbers.at_vertex(bounce, Vertex::Lobe).y >= survival {
                return None;
            }
            weight /= survival;
        }
        let materials = &self.oracle.scene.materials;
        let thin = self.oracle.material(surface).thin;
        let bodies = if through && !thin {
            path.bodies.sides(materials, surface.material_index, surface.front).beyond
        } else {
            path.bodies
        };
        let near = NEAR * (self.oracle.size + surface.position.length());
        let origin = if through { surface.refraction_origin(near) } else { surface.clear_origin() };
        let ray = Ray { origin, direction, ..path.ray };
        let from = Receiver { position: surface.position, normal: surface.ng };
        Some(Path { ray, starts_on: Some(surface.primitive), weight, density, bodies, from })
    }
}
