//! The ways of one ray inside of volumes, as sections of constant density.
//!
//! Of a ray o + t d, the optical depth of a section is its length times the sum of the densities there. A path scatters where the depth
//! from its start is -ln(1 - u), with u uniform in [0, 1): the free path of Beer's law.

#[cfg(test)]
mod tests;

use std::ops::ControlFlow::{self, Break, Continue};
use std::ops::Range;

use glam::DVec3;

use super::single::SolidCrossing;
use crate::frame::{EyeBoundary, EyeVolume, PreparedFrame};
use crate::rays::Ray;
use crate::scene::MAX_VOLUMES;
use crate::shape::EyeSphere;

/// Volumes, a bit each.
type Inside = u64;
const _: () = assert!(MAX_VOLUMES <= Inside::BITS as usize);

/// The sections of a ray that are inside of volumes. Kept from ray to ray.
#[derive(Default)]
pub(crate) struct VolumeSections {
    ends: Vec<End>,
    crossings: Vec<SolidCrossing>,
}

/// The start or the end of the way through a volume.
#[derive(Clone, Copy)]
struct End {
    t: f64,
    volume: usize,
    enters: bool,
}

/// A point where volumes scatter a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scattered {
    /// Distance in lengths of the ray's direction.
    pub t: f64,
    /// Albedo of all volumes there: the mean of theirs by density.
    pub color: DVec3,
}

impl PreparedFrame {
    /// Optical depth of all volumes along a ray within 0 < t < `t_max`.
    pub(crate) fn optical_depth(&self, ray: &Ray, t_max: f64, sections: &mut VolumeSections) -> f64 {
        self.find_sections(ray, t_max, sections);
        let length = ray.direction.length();
        let mut depth = 0.0;
        let _ = sections.visit(|section, inside| {
            depth += (section.end - section.start) * length * self.density(inside);
            Continue(())
        });
        depth
    }

    /// Where a ray has an optical depth from its start; `None` if that is not within 0 <= t < `t_max`.
    pub(crate) fn scattered_at(
        &self,
        ray: &Ray,
        t_max: f64,
        depth: f64,
        sections: &mut VolumeSections,
    ) -> Option<Scattered> {
        self.find_sections(ray, t_max, sections);
        let length = ray.direction.length();
        let mut rest = depth;
        let mut found = None;
        let _ = sections.visit(|section, inside| {
            let per_t = length * self.density(inside);
            let own = (section.end - section.start) * per_t;
            if rest < own {
                found = Some(Scattered { t: section.start + rest / per_t, color: self.albedo(inside) });
                return Break(());
            }
            rest -= own;
            Continue(())
        });
        found
    }

    /// Sum of the densities of some volumes.
    fn density(&self, inside: Inside) -> f64 {
        members(&self.volumes, inside).map(|volume| volume.density).sum()
    }

    /// Mean albedo of some volumes by their densities.
    fn albedo(&self, inside: Inside) -> DVec3 {
        let weighted: DVec3 =
            members(&self.volumes, inside).map(|volume| volume.color * volume.density).sum();
        weighted / self.density(inside)
    }

    fn find_sections(&self, ray: &Ray, t_max: f64, sections: &mut VolumeSections) {
        sections.ends.clear();
        for (index, volume) in self.volumes.iter().enumerate() {
            match &volume.boundary {
                EyeBoundary::Sphere(sphere) => sections.add(index, in_sphere(sphere, ray), t_max),
                EyeBoundary::Box(lower, upper) => sections.add(index, in_box(*lower, *upper, ray), t_max),
                EyeBoundary::Solid { instance, faces_inside } => {
                    instance.find_crossings(self.level, ray, &mut sections.crossings);
                    sections.add_solid(index, *faces_inside, t_max);
                }
            }
        }
        // Of a volume that is left where it is entered again, first the end.
        let order = |end: &End| (end.volume, end.enters);
        sections.ends.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then(order(a).cmp(&order(b))));
    }
}

impl VolumeSections {
    /// Adds a way through a volume, as far as it is within 0 < t < `t_max`.
    fn add(&mut self, volume: usize, way: Option<Range<f64>>, t_max: f64) {
        let Some(Range { start, end }) = way else { return };
        let (start, end) = (start.max(0.0), end.min(t_max));
        if start < end && end < f64::INFINITY {
            let at = |t, enters| End { t, volume, enters };
            self.ends.extend([at(start, true), at(end, false)]);
        }
    }

    /// Adds the ways through a volume with the surface that is crossed: from each crossing inwards to the next outwards. A ray whose first
    /// crossing is outwards starts inside. A way without an end is none: the mesh is not closed.
    fn add_solid(&mut self, volume: usize, faces_inside: bool, t_max: f64) {
        let inwards = |crossing: &SolidCrossing| crossing.front != faces_inside;
        let mut entered = self.crossings.first().filter(|first| !inwards(first)).map(|_| 0.0);
        for i in 0..self.crossings.len() {
            let crossing = self.crossings[i];
            if inwards(&crossing) {
                entered = entered.or(Some(crossing.t));
            } else if let Some(start) = entered.take() {
                self.add(volume, Some(start..crossing.t), t_max);
            }
        }
    }

    /// Visits the sections in ascending order, with the volumes that each is inside of.
    fn visit(&self, mut section: impl FnMut(Range<f64>, Inside) -> ControlFlow<()>) -> ControlFlow<()> {
        let (mut inside, mut start): (Inside, f64) = (0, 0.0);
        for end in &self.ends {
            if inside != 0 && start < end.t {
                section(start..end.t, inside)?;
            }
            start = end.t;
            let bit = 1 << end.volume;
            inside = if end.enters { inside | bit } else { inside & !bit };
        }
        Continue(())
    }
}

/// The volumes of a set, in ascending order.
fn members(volumes: &[EyeVolume], inside: Inside) -> impl Iterator<Item = &EyeVolume> {
    volumes.iter().enumerate().filter(move |(index, _)| inside >> index & 1 == 1).map(|(_, volume)| volume)
}

/// The t of a ray inside of a sphere.
fn in_sphere(sphere: &EyeSphere, ray: &Ray) -> Option<Range<f64>> {
    let to_center = sphere.center - ray.origin;
    let square = ray.direction.length_squared();
    let middle = to_center.dot(ray.direction) / square;
    let across = to_center - ray.direction * middle;
    let half = ((sphere.radius * sphere.radius - across.length_squared()) / square).sqrt();
    // NaN where the ray passes by.
    (half > 0.0).then_some(middle - half..middle + half)
}

/// The t of a ray inside of a box.
fn in_box(lower: DVec3, upper: DVec3, ray: &Ray) -> Option<Range<f64>> {
    let (mut start, mut end) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        let (from, along) = (ray.origin[axis], ray.direction[axis]);
        if along == 0.0 {
            if from < lower[axis] || from >= upper[axis] {
                return None;
            }
            continue;
        }
        let [a, b] = [lower, upper].map(|side| (side[axis] - from) / along);
        (start, end) = (start.max(a.min(b)), end.min(a.max(b)));
    }
    (start < end).then_some(start..end)
}
