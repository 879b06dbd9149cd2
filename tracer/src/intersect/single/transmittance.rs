//! Share of light that passes the surfaces along a shadow ray.

use std::ops::ControlFlow::{self, Break, Continue};

use glam::{DVec3, Vec3};

use super::query::{Candidate, RayQuery};
use crate::compile::Item;
use crate::frame::PreparedFrame;
use crate::rays::{PrimitiveId, Ray};
use crate::scene::Material;

/// Most transparent surfaces that light passes: behind more of them it is dark.
const MOST_CROSSINGS: usize = 256;

/// The transparent surfaces along a ray. Kept from ray to ray.
#[derive(Default)]
pub(crate) struct Crossings(Vec<Crossing>);

/// The crossing of a transparent surface.
struct Crossing {
    t: f64,
    /// Whether the ray hits its front.
    front: bool,
    /// Largest distance in t to a surface that coincides with it.
    slack: f64,
    /// Order among surfaces at the same distance: see [`PreparedFrame::rank`].
    rank: (u32, u32),
    /// c_t.
    transmit: DVec3,
}

impl PreparedFrame {
    /// Share of light, linear RGB, that passes all surfaces within 0 < t < `t_max`: the product of their c_t, in the order of
    /// their distances. Surfaces that cast no shadow or whose c_t is 1 let all light pass, opaque ones none, and more than 256
    /// other ones none. Of a sphere both sides count. Light is neither bent nor absorbed on its way inside. Of surfaces that
    /// coincide (see `coincide`) and are hit from the same side one counts: two triangles at the edge that they share are one
    /// surface.
    pub(crate) fn transmittance(
        &self,
        ray: &Ray,
        t_max: f64,
        starts_on: Option<PrimitiveId>,
        crossings: &mut Crossings,
    ) -> DVec3 {
        crossings.0.clear();
        let mut query = Transmitted { frame: self, ray, t_max, starts_on, crossings, blocked: false };
        self.search_all(ray, &mut query);
        if query.blocked {
            return DVec3::ZERO;
        }
        // The search finds the surfaces in any order, and a product of rounded numbers depends on its order.
        crossings.0.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then(a.rank.cmp(&b.rank)));
        let mut latest: [Option<&Crossing>; 2] = [None; 2];
        crossings.0.iter().fold(DVec3::ONE, |share, crossing| {
            let before = &mut latest[usize::from(crossing.front)];
            if before.is_some_and(|before| crossing.t - before.t <= before.slack) {
                return share;
            }
            *before = Some(crossing);
            share * crossing.transmit
        })
    }

    fn material_of(&self, PrimitiveId { item, triangle }: PrimitiveId) -> &Material {
        let scene = self.scene();
        let index = if item >= self.items.first_plane() {
            scene.planes[(item - self.items.first_plane()) as usize].material
        } else {
            match self.items.get(item) {
                Item::Model(index) => {
                    let slot = self.instances[index].mesh.slot(triangle);
                    scene.models[index].materials[usize::from(slot)]
                }
                Item::Sphere(index) => scene.spheres[index].material,
                Item::Triangle(index) => scene.triangles[index].material,
                Item::Disk(index) => scene.disks[index].material,
            }
        };
        &scene.materials[index as usize]
    }

    /// Where a ray that enters a sphere at `t` leaves it; `None` for other primitives, and where it leaves at `t`.
    fn exit_of(&self, ray: &Ray, item: u32, t: f64) -> Option<f64> {
        if item >= self.items.first_plane() {
            return None;
        }
        let Item::Sphere(index) = self.items.get(item) else { return None };
        let entry = ray.origin + ray.direction * t;
        Some(t + self.spheres[index].intersect(entry, ray.direction, true)?)
    }
}

/// Query for all surfaces of a ray within (0, `t_max`) that cast a shadow. Ends at the first one that is opaque.
struct Transmitted<'a> {
    frame: &'a PreparedFrame,
    ray: &'a Ray,
    t_max: f64,
    starts_on: Option<PrimitiveId>,
    crossings: &'a mut Crossings,
    /// Whether no light passes.
    blocked: bool,
}

impl Transmitted<'_> {
    /// Adds the crossing of a transparent surface. Breaks if there are too many.
    fn cross(&mut self, t: f64, primitive: PrimitiveId, material: &Material) -> ControlFlow<()> {
        if self.crossings.0.len() == MOST_CROSSINGS {
            return self.block();
        }
        let (front, slack) = self.frame.side_and_slack(self.ray, primitive, t);
        self.crossings.0.push(Crossing {
            t,
            front,
            slack,
            rank: self.frame.rank(primitive),
            transmit: material.transmit.as_dvec3(),
        });
        Continue(())
    }

    fn block(&mut self) -> ControlFlow<()> {
        self.blocked = true;
        Break(())
    }
}

impl RayQuery for Transmitted<'_> {
    fn limit(&self) -> f64 {
        self.t_max
    }

    fn starts_on(&self, primitive: PrimitiveId) -> bool {
        self.starts_on == Some(primitive)
    }

    #[inline(always)]
    fn skips(&self, item: u32) -> bool {
        self.frame.is_clear(item)
    }

    fn consider(&mut self, Candidate { primitive, .. }: Candidate) -> ControlFlow<()> {
        let frame = self.frame;
        let material = frame.material_of(primitive);
        if !material.casts_shadow || material.transmit == Vec3::ONE {
            return Continue(());
        }
        let t = frame.t_of(self.ray, primitive, self.starts_on).filter(|&t| t < self.t_max);
        let Some(t) = t else { return Continue(()) };
        if !material.is_transparent() {
            return self.block();
        }
        self.cross(t, primitive, material)?;
        match frame.exit_of(self.ray, primitive.item, t).filter(|&exit| exit < self.t_max) {
            Some(exit) => self.cross(exit, primitive, material),
            None => Continue(()),
        }
    }
}
