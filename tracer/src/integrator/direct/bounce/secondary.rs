//! Secondary rays: rays that a surface reflects or transmits.

use glam::DVec3;

use crate::bsdf::{Media, fresnel, fresnel_of_sheet, on_side_of, reflected, refracted};
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
    /// The t at which the ray before it previous_t.
    pub previous_t: f64,
    /// Whether it is reflected by the plane of the primitive that it starts on.
    pub by_plane: bool,
}

/// A hit of a ray with a surface that reflects or transmits.
pub(super) struct Interaction<'a> {
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
    /// Weight of the ray at the hit.
    pub weight: DVec3,
    /// Length of the way to the camera, in eye units.
    pub way: f64,
    pub media: Media,
    pub sample: u16,
}

/// The reflected and the transmitted ray of an interaction, as far as they can contribute.
pub(super) struct ScatteredRays {
    pub reflected: Option<Secondary>,
    pub transmitted: Option<Secondary>,
}

impl Interaction<'_> {
    /// The scattered rays. Hall's terms c_r I(R) + c_t I(T): total internal reflection sends the transmitted share into R.
    pub(super) fn scatter(&self, frame: &PreparedFrame) -> ScatteredRays {
        let materials = &frame.scene().materials;
        let (mut reflect, mut transmit) =
            (self.material.reflect.as_dvec3(), self.material.transmit.as_dvec3());
        let mut through = None;
        if self.material.is_transparent() || self.material.fresnel {
            let interface = self.media.interface(materials, self.index, self.front);
            let eta = if self.material.thin { 1.0 } else { interface.eta };
            let refracted = refracted(self.direction, self.ns, eta);
            if self.material.fresnel {
                let cosine = -self.direction.dot(self.ns);
                let share = if self.material.thin {
                    fresnel_of_sheet(cosine, f64::from(self.material.ior))
                } else {
                    fresnel(cosine, eta)
                };
                reflect *= share;
                transmit *= 1.0 - share;
            } else if refracted.is_none() {
                reflect += transmit;
            }
            let behind = if self.material.thin { self.media } else { interface.behind };
            through = refracted.map(|direction| (on_side_of(direction, -self.ng), behind));
        }
        let least = f64::from(frame.view().quality.min_contribution);
        let ray_along = |direction: DVec3, share: DVec3, media: Media, by_plane: bool| {
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
                previous_t: self.t,
                by_plane,
            };
            (enough && secondary.ray.direction.is_finite() && origin.is_finite()).then_some(secondary)
        };
        let mirrored = on_side_of(reflected(self.direction, self.ns), self.ng);
        ScatteredRays {
            reflected: ray_along(mirrored, reflect, self.media, self.on_plane && self.coincidence == 0.0),
            transmitted: through
                .and_then(|(direction, behind)| ray_along(direction, transmit, behind, false)),
        }
    }
}
