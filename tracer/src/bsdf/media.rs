//! The transparent bodies that a ray is inside of.

use glam::{DVec3, Vec3};

use crate::scene::Material;

/// Most bodies that are noted: of bodies inside more others the outermost are forgotten.
const DEEPEST: usize = 4;

/// The materials of the transparent bodies around a point, the innermost last. A ray of the camera starts in none, so a camera in
/// glass is noticed where a ray leaves a body that it never entered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Media {
    materials: [u32; DEEPEST],
    count: u8,
}

/// What a ray crosses at a surface of a transparent body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interface {
    /// n_from / n_to.
    pub eta: f64,
    /// The bodies around the far side.
    pub behind: Media,
}

impl Media {
    /// The innermost body.
    fn innermost(&self) -> Option<u32> {
        self.materials[..usize::from(self.count)].last().copied()
    }

    fn with(mut self, material: u32) -> Self {
        if usize::from(self.count) == DEEPEST {
            self.materials.rotate_left(1);
            self.count -= 1;
        }
        self.materials[usize::from(self.count)] = material;
        self.count += 1;
        self
    }

    /// The place of the innermost body of a material.
    fn place_of(&self, material: u32) -> Option<usize> {
        self.materials[..usize::from(self.count)].iter().rposition(|&inside| inside == material)
    }

    fn without(mut self, material: u32) -> Self {
        if let Some(place) = self.place_of(material) {
            self.materials[place..].rotate_left(1);
            self.count -= 1;
            self.materials[usize::from(self.count)..].fill(0);
        }
        self
    }

    /// The surface of a body of a material: a ray enters through the front, and leaves through the back.
    pub(crate) fn interface(&self, materials: &[Material], material: u32, front: bool) -> Interface {
        let index_in =
            |media: &Self| media.innermost().map_or(1.0, |inside| f64::from(materials[inside as usize].ior));
        let own = &materials[material as usize];
        let (from, behind) = match (front, self.place_of(material)) {
            (true, _) => (index_in(self), self.with(material)),
            (false, Some(_)) => (index_in(self), self.without(material)),
            (false, None) => (f64::from(own.ior), *self),
        };
        Interface { eta: from / index_in(&behind), behind }
    }

    /// Whether light may be absorbed on a way that ends at a surface of a material.
    pub(crate) fn may_absorb(&self, materials: &[Material], end: &Material) -> bool {
        end.absorbs() || self.innermost().is_some_and(|inside| materials[inside as usize].absorbs())
    }

    /// Share of light that is left after a way inside, which ends at a surface of a material; `way` in world units.
    pub(crate) fn transmittance(&self, materials: &[Material], end: (u32, bool), way: f64) -> Option<DVec3> {
        let absorption = self.absorbing(materials, end)?;
        Some(DVec3::from_array(absorption.to_array().map(|share| libm::pow(f64::from(share), way))))
    }

    /// Share of light that is left after a way inside that ends at no surface; `way` in world units, which may be infinite. `None` if the
    /// innermost body absorbs nothing.
    pub(crate) fn transmittance_ahead(&self, materials: &[Material], way: f64) -> Option<DVec3> {
        let body = &materials[self.innermost()? as usize];
        let left = || body.absorption.to_array().map(|share| libm::pow(f64::from(share), way));
        body.absorbs().then(|| DVec3::from_array(left()))
    }

    /// The absorption of the body that a ray is inside of, if it absorbs.
    fn absorbing(&self, materials: &[Material], (material, front): (u32, bool)) -> Option<Vec3> {
        // The back of a body that the ray never entered: it started inside.
        let started_inside = !front && self.place_of(material).is_none();
        let body = if started_inside { Some(material) } else { self.innermost() };
        let body = &materials[body? as usize];
        body.absorbs().then_some(body.absorption)
    }

    /// Share of light of the background that reaches the start of the ray: a body without end leaves none of a channel that it absorbs.
    pub(crate) fn transmittance_to_infinity(&self, materials: &[Material]) -> Option<DVec3> {
        let body = &materials[self.innermost()? as usize];
        let left = body.absorption.to_array().map(|share| if share < 1.0 { 0.0 } else { 1.0 });
        Some(DVec3::from_array(left))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn materials() -> Vec<Material> {
        let body = |ior| Material { transmit: Vec3::ONE, ior, ..Material::NEUTRAL };
        vec![body(1.5), body(1.33), body(2.0)]
    }

    #[test]
    fn bodies_in_bodies_have_the_index_of_what_is_around_them() {
        let materials = materials();
        let into_glass = Media::default().interface(&materials, 0, true);
        assert_eq!(into_glass.eta, 1.0 / 1.5);
        let into_water = into_glass.behind.interface(&materials, 1, true);
        assert!((into_water.eta - 1.5 / f64::from(1.33_f32)).abs() < 1e-12);
        let back_in_glass = into_water.behind.interface(&materials, 1, false);
        assert_eq!(back_in_glass.behind, into_glass.behind);
        let outside = back_in_glass.behind.interface(&materials, 0, false);
        assert_eq!((outside.eta, outside.behind), (1.5, Media::default()));
    }

    #[test]
    fn of_overlapping_bodies_the_last_entered_one_decides() {
        let materials = materials();
        let glass = Media::default().interface(&materials, 0, true).behind;
        let both = glass.interface(&materials, 2, true).behind;
        let left_glass = both.interface(&materials, 0, false);
        assert_eq!(left_glass.eta, 1.0, "the ray is still inside of the other");
        assert_eq!(left_glass.behind.interface(&materials, 2, false).eta, 2.0);
    }

    #[test]
    fn a_ray_that_starts_inside_leaves_what_it_never_entered() {
        let leaving = Media::default().interface(&materials(), 0, false);
        assert_eq!((leaving.eta, leaving.behind), (1.5, Media::default()));
    }

    #[test]
    fn of_too_many_bodies_the_outermost_is_forgotten() {
        let materials = vec![Material { transmit: Vec3::ONE, ior: 1.5, ..Material::NEUTRAL }; 6];
        let enter = |media: Media, material| media.interface(&materials, material, true).behind;
        let deep = (0..6).fold(Media::default(), enter);
        assert_eq!(deep.place_of(0), None);
        assert_eq!(deep.innermost(), Some(5));
    }

    #[test]
    fn absorption_is_a_power_of_the_way() {
        let mut materials = materials();
        materials[0].absorption = Vec3::new(0.5, 1.0, 0.25);
        let inside = Media::default().interface(&materials, 0, true).behind;
        let left = inside.transmittance(&materials, (0, false), 2.0).unwrap();
        assert!((left - DVec3::new(0.25, 1.0, 0.0625)).length() < 1e-12);
        assert_eq!(Media::default().transmittance(&materials, (0, true), 2.0), None);
        let started = Media::default().transmittance(&materials, (0, false), 1.0).unwrap();
        assert!((started - DVec3::new(0.5, 1.0, 0.25)).length() < 1e-12);
        assert_eq!(inside.transmittance_to_infinity(&materials), Some(DVec3::new(0.0, 1.0, 0.0)));
        assert_eq!(inside.transmittance_ahead(&materials, f64::INFINITY), Some(DVec3::new(0.0, 1.0, 0.0)));
        assert_eq!(
            inside.transmittance_ahead(&materials, 2.0),
            inside.transmittance(&materials, (0, false), 2.0)
        );
        assert_eq!(Media::default().transmittance_ahead(&materials, 2.0), None);
    }
}
