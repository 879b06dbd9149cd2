//! Secondary rays: what leaves a surface that reflects or transmits.

use glam::DVec3;

use super::media::Media;
use crate::bsdf::{fresnel, on_side_of, reflected, refracted};
use crate::frame::PreparedFrame;
use crate::rays::{PrimitiveId, Ray};
use crate::scene::Material;

/// A reflected or transmitted ray.
#[derive(Clone, Copy)]
pub(super) struct Secondary {
    /// Direction of unit length.
    pub ray: Ray,
    pub starts_on: PrimitiveId,
    /// Factor of what it sees, in the colour of its sample.
    pub weight: DVec3,
    /// Length of the way between it and the camera, in eye units.
    pub way: f64,
    /// The bodies that it is inside of.
    pub media: Media,
    /// The sample of the tile that it contributes to.
    pub sample: u16,
    /// The t at which the ray before it arrived.
    pub arrived: f64,
    /// Whether it is reflected by the plane of the primitive that it starts on.
    pub by_plane: bool,
}

/// A hit of a ray with a surface that reflects or transmits.
pub(super) struct Arrival<'a> {
    /// Unit direction of the ray.
    pub direction: DVec3,
    pub point: DVec3,
    /// The t of the hit.
    pub t: f64,
    pub primitive: PrimitiveId,
    /// Geometric and shading unit normals on the side of the ray.
    pub ng: DVec3,
    pub ns: DVec3,
    /// Whether all points of the primitive have these normals.
    pub on_plane: bool,
    /// Whether the ray hits the front side.
    pub front: bool,
    /// Index of the material, and the material.
    pub index: u32,
    pub material: &'a Material,
    /// Distance from the point within which other surfaces may coincide with this one, or 0.
    pub coincidence: f64,
    /// Weight of the ray where it arrives.
    pub weight: DVec3,
    /// Length of the way to the camera, in eye units.
    pub way: f64,
    pub media: Media,
    pub sample: u16,
}

/// The rays that leave a surface: a reflected and a transmitted one, as far as they can contribute.
pub(super) struct Departures {
    pub reflected: Option<Secondary>,
    pub transmitted: Option<Secondary>,
}

impl Arrival<'_> {
    /// The rays that leave. Hall's terms c_r I(R) + c_t I(T): total internal reflection sends the transmitted share into R.
    pub(super) fn departures(&self, frame: &PreparedFrame) -> Departures {
        let materials = &frame.scene().materials;
        let (mut reflect, mut transmit) =
            (self.material.reflect.as_dvec3(), self.material.transmit.as_dvec3());
        let mut through = None;
        if self.material.is_transparent() || self.material.fresnel {
            let interface = self.media.interface(materials, self.index, self.front);
            let eta = if self.material.thin { 1.0 } else { interface.eta };
            let refracted = refracted(self.direction, self.ns, eta);
            if self.material.fresnel {
                let share = fresnel(-self.direction.dot(self.ns), eta);
                reflect *= share;
                transmit *= 1.0 - share;
            } else if refracted.is_none() {
                reflect += transmit;
            }
            let behind = if self.material.thin { self.media } else { interface.behind };
            through = refracted.map(|direction| (on_side_of(direction, -self.ng), behind));
        }
        let least = f64::from(frame.view().quality.min_contribution);
        let leave = |direction: DVec3, share: DVec3, media: Media, by_plane: bool| {
            let weight = self.weight * share;
            let origin = self.point + self.ng * self.coincidence;
            let enough = weight.max_element() >= least && weight.max_element() > 0.0;
            let secondary = Secondary {
                ray: Ray { origin, direction: direction.normalize() },
                starts_on: self.primitive,
                weight,
                way: self.way,
                media,
                sample: self.sample,
                arrived: self.t,
                by_plane,
            };
            (enough && secondary.ray.direction.is_finite() && origin.is_finite()).then_some(secondary)
        };
        let mirrored = on_side_of(reflected(self.direction, self.ns), self.ng);
        Departures {
            reflected: leave(mirrored, reflect, self.media, self.on_plane && self.coincidence == 0.0),
            transmitted: through.and_then(|(direction, behind)| leave(direction, transmit, behind, false)),
        }
    }
}
