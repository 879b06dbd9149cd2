//! Surface points in `f64`, ray by ray: on spheres and planes, and on triangles too thin for `f32`.

use glam::DVec3;

use super::group::Group;
use super::{SHADOW_BIAS, SurfaceBlock};
use crate::compile::Item;
use crate::rays::{PrimitiveId, Ray, SurfaceSource};
use crate::simd::{Simd, each_bit};

impl SurfaceBlock {
    /// Sets the point of a ray on a triangle too thin for `f32`.
    #[inline(never)]
    pub(super) fn repair<R: SurfaceSource>(
        &mut self,
        rays: &R,
        block: usize,
        lane: usize,
        item: u32,
        triangle: u32,
    ) {
        let frame = rays.frame();
        let ([a, b, c], mirrored) = match frame.items.get(item) {
            Item::Model(index) => {
                let instance = &frame.instances[index];
                let corners = instance.mesh.corners(triangle);
                let placed = corners.map(|corner| instance.linear * corner.as_dvec3() + instance.translation);
                (placed, instance.linear.determinant() < 0.0)
            }
            Item::Triangle(index) => (frame.triangles[index].corners, false),
            // Never too thin.
            Item::Sphere(_) | Item::Disk(_) => return,
        };
        let ray = rays.ray(block, lane);
        let ng = (b - a).cross(c - a).normalize_or(-ray.direction.normalize());
        let behind = ng.dot(ray.direction) > 0.0;
        let ng = if behind { -ng } else { ng };
        self.set_front(1 << lane, u32::from(behind == mirrored) << lane);
        // Without a usable plane, the distance is that of the first corner.
        let t = (a - ray.origin).length() / ray.direction.length();
        self.set(lane, &ray, t, ng);
    }

    /// Sets the points of rays on a sphere, a disk or a plane. The front is on the side of the normal, unless `inverted`.
    pub(super) fn put_analytic<S: Simd, R: SurfaceSource>(
        &mut self,
        group: &Group<'_, R, S>,
        item: u32,
        (material, inverted): (u32, bool),
        normal: impl Fn(DVec3) -> DVec3,
    ) {
        let &Group { rays, block, lanes, .. } = group;
        for lane in each_bit(lanes) {
            let ray = rays.ray(block, lane);
            let primitive = PrimitiveId { item, triangle: 0 };
            let t = rays.frame().t_of(&ray, primitive, rays.starts_on(block, lane)).unwrap_or(0.0);
            let ng = normal(ray.origin + ray.direction * t);
            let behind = ng.dot(ray.direction) > 0.0;
            let ng = if behind { -ng } else { ng };
            self.set_front(1 << lane, u32::from(behind == inverted) << lane);
            self.set(lane, &ray, t, ng);
            self.material.0[lane] = material;
        }
    }

    fn set(&mut self, lane: usize, ray: &Ray, t: f64, ng: DVec3) {
        let point = ray.origin + ray.direction * t;
        for axis in 0..3 {
            self.point[axis].0[lane] = point[axis] as f32;
            self.ng[axis].0[lane] = ng[axis] as f32;
            self.ns[axis].0[lane] = ng[axis] as f32;
        }
        self.bias.0[lane] = point.abs().max_element() as f32 * SHADOW_BIAS;
    }
}
