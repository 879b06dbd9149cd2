//! Where a ray crosses the surface of a closed mesh.

use std::ops::ControlFlow::{self, Continue};

use super::query::{Candidate, RayQuery};
use super::traversal::with_stack;
use crate::frame::Instance;
use crate::rays::{PrimitiveId, Ray};
use crate::shape::ShearedRay;
use crate::simd::{Level, dispatch, three};

/// A crossing of the surface of a closed mesh.
#[derive(Clone, Copy, Debug)]
pub(in crate::intersect) struct SolidCrossing {
    /// Distance above 0, in lengths of the ray's direction.
    pub t: f64,
    /// Whether the ray hits the front of the triangle.
    pub front: bool,
}

impl Instance {
    /// Replaces a list by the crossings of a ray with all triangles of this model, in ascending order. Two triangles that the ray hits at the
    /// edge they share are both listed.
    pub(in crate::intersect) fn find_crossings(
        &self,
        level: Level,
        ray: &Ray,
        crossings: &mut Vec<SolidCrossing>,
    ) {
        crossings.clear();
        let local = self.to_mesh(ray);
        let sheared = ShearedRay::new(local.origin, local.direction);
        let mut query = AllCrossings { instance: self, local, sheared, crossings: &mut *crossings };
        let _ = with_stack(|stack| dispatch!(level, simd => self.search(simd, ray, 0, stack, &mut query)));
        // The search finds them in any order.
        crossings.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then(b.front.cmp(&a.front)));
    }
}

/// Query for all triangles that a ray hits.
struct AllCrossings<'a> {
    instance: &'a Instance,
    /// The ray in the space of the mesh.
    local: Ray,
    sheared: ShearedRay,
    crossings: &'a mut Vec<SolidCrossing>,
}

impl RayQuery for AllCrossings<'_> {
    fn limit(&self) -> f64 {
        f64::INFINITY
    }

    fn starts_on(&self, _: PrimitiveId) -> bool {
        false
    }

    fn consider(&mut self, Candidate { primitive, .. }: Candidate) -> ControlFlow<()> {
        let corners = self.instance.mesh.corners(primitive.triangle);
        let corners @ [a, b, c] = three!(k => corners[k].as_dvec3());
        if let Some(t) = self.sheared.intersect(&corners) {
            let front = (b - a).cross(c - a).dot(self.local.direction) < 0.0;
            self.crossings.push(SolidCrossing { t, front });
        }
        Continue(())
    }
}
