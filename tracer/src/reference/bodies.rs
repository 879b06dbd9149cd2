//! The transparent bodies that a ray is inside of.

use glam::{DVec3, Vec3};

use crate::scene::Material;

/// Bodies that are remembered: the last entered ones.
const REMEMBERED: usize = 4;

/// Materials of the bodies that a ray has entered and not left, the last entered one last. Rays of the camera have entered none.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Bodies(Vec<u32>);

/// The two sides of a surface of a body.
pub(super) struct Sides {
    /// Indices of refraction on the near and the far side.
    pub indices: [f64; 2],
    /// The bodies around the far side.
    pub beyond: Bodies,
}

impl Bodies {
    /// Position of the last entered body of a material.
    fn last(&self, material: u32) -> Option<usize> {
        self.0.iter().rposition(|&inside| inside == material)
    }

    /// Index of refraction around the ray.
    fn index(&self, materials: &[Material]) -> f64 {
        self.0.last().map_or(1.0, |&inside| f64::from(materials[inside as usize].ior))
    }

    /// The sides of a surface of a material: the front is entered, the back is left. The back of a body that was not entered
    /// belongs to one that the ray started in.
    pub(super) fn sides(&self, materials: &[Material], material: u32, front: bool) -> Sides {
        let mut beyond = self.clone();
        let mut near = self.index(materials);
        if front {
            beyond.0.push(material);
            let forgotten = beyond.0.len().saturating_sub(REMEMBERED);
            beyond.0.drain(..forgotten);
        } else if let Some(position) = beyond.last(material) {
            beyond.0.remove(position);
        } else {
            near = f64::from(materials[material as usize].ior);
        }
        Sides { indices: [near, beyond.index(materials)], beyond }
    }

    /// a^d: the share of light that remains after a way of d world units, which ends at a surface of a material.
    pub(super) fn remaining(
        &self,
        materials: &[Material],
        (material, front): (u32, bool),
        way: f64,
    ) -> DVec3 {
        let body =
            if front || self.last(material).is_some() { self.0.last().copied() } else { Some(material) };
        let Some(body) = body.map(|body| &materials[body as usize]) else { return DVec3::ONE };
        if body.transmit == Vec3::ZERO || body.thin {
            return DVec3::ONE;
        }
        DVec3::from_array(body.absorption.to_array().map(|share| libm::pow(f64::from(share), way)))
    }

    /// Share of light that remains after a way of d world units that ends at no surface.
    pub(super) fn remaining_in_innermost(&self, materials: &[Material], way: f64) -> DVec3 {
        let Some(&body) = self.0.last() else { return DVec3::ONE };
        let absorption = materials[body as usize].absorption.to_array();
        DVec3::from_array(absorption.map(|share| libm::pow(f64::from(share), way)))
    }

    /// The same after an infinite way.
    pub(super) fn remaining_at_infinity(&self, materials: &[Material]) -> DVec3 {
        let Some(&body) = self.0.last() else { return DVec3::ONE };
        let absorption = materials[body as usize].absorption.to_array();
        DVec3::from_array(absorption.map(|share| if share < 1.0 { 0.0 } else { 1.0 }))
    }
}
