//! The primitives of a scene that has only few of them, for blocks of rays: see `intersect::block`.

use glam::DVec3;

use super::{EyeTriangle, PreparedFrame};
use crate::compile::Item;

/// Largest distance of the fourth corner of a parallelogram from its place, relative to the edges.
const FLAT: f64 = 1.0 / (1_u64 << 40) as f64;

/// Most primitives: more are searched by their tree.
const MOST: u32 = 40;

/// The primitives of a scene without models and planes, in `f32`.
#[derive(Clone, Debug)]
pub(crate) struct Few {
    /// Triangles, with both halves of a parallelogram as one.
    pub triangles: Vec<FewTriangle>,
    pub spheres: Vec<FewSphere>,
    /// Largest difference of coincident surfaces.
    pub drift: f32,
}

/// A triangle, or the parallelogram of two.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FewTriangle {
    pub item: u32,
    /// The half of the parallelogram that is across the edge between the ends of `edges`.
    pub other_half: Option<u32>,
    pub corner: [f32; 3],
    pub edges: [[f32; 3]; 2],
    /// Largest coordinate of the corners.
    pub reach: f32,
    /// Largest coordinate of the edges.
    pub size: f32,
    /// Twice the area.
    pub area: f32,
    /// Whether alpha may cut it out.
    pub cut: bool,
}

/// A sphere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FewSphere {
    pub item: u32,
    pub center: [f32; 3],
    pub radius: f32,
    pub reach: f32,
}

impl Few {
    /// The primitives of a frame, if these are few and have no model and no plane among them.
    pub(super) fn of(frame: &PreparedFrame) -> Option<Self> {
        let scene = frame.scene();
        let items = frame.items.range();
        if !scene.models.is_empty() || !scene.planes.is_empty() || items.is_empty() || items.end > MOST {
            return None;
        }
        let mut few =
            Self { triangles: Vec::new(), spheres: Vec::new(), drift: (4.0 * frame.coarsest) as f32 };
        let mut previous = [DVec3::ZERO; 3];
        for item in items {
            if frame.motions.as_ref().is_some_and(|motions| motions.of(item).is_some()) {
                continue;
            }
            match frame.items.get(item) {
                Item::Sphere(index) => {
                    let sphere = &frame.spheres[index];
                    few.spheres.push(FewSphere {
                        item,
                        center: sphere.center.as_vec3().to_array(),
                        radius: sphere.radius as f32,
                        reach: (sphere.center.abs().max_element() + sphere.radius) as f32,
                    });
                }
                Item::Triangle(index) => {
                    let EyeTriangle { corners, cut, .. } = frame.triangles[index];
                    let half = few.triangles.last_mut().filter(|last| last.item + 1 == item && !cut);
                    if !half.is_some_and(|last| last.add_half(item, &previous, &corners)) {
                        few.triangles.push(FewTriangle::new(item, &corners, cut));
                    }
                    previous = corners;
                }
                Item::Disk(_) | Item::Model(_) => return None,
            }
        }
        Some(few)
    }
}

impl FewTriangle {
    fn new(item: u32, &[a, b, c]: &[DVec3; 3], cut: bool) -> Self {
        let (ab, ac) = (b - a, c - a);
        Self {
            item,
            other_half: None,
            corner: a.as_vec3().to_array(),
            edges: [ab.as_vec3().to_array(), ac.as_vec3().to_array()],
            reach: a.abs().max(b.abs()).max(c.abs()).max_element() as f32,
            size: ab.abs().max(ac.abs()).max_element() as f32,
            area: ab.cross(ac).length() as f32,
            cut,
        }
    }

    /// Adds the next item as the other half of a parallelogram, if that is what it is; `own` are the corners of this one. Both halves
    /// are in one plane, but for a small part of the coincidence of surfaces.
    fn add_half(&mut self, item: u32, own: &[DVec3; 3], other: &[DVec3; 3]) -> bool {
        if self.other_half.is_some() || self.cut {
            return false;
        }
        let Some(apex) = own.iter().position(|corner| !other.contains(corner)) else { return false };
        let Some(far) = other.iter().find(|corner| !own.contains(corner)) else { return false };
        let [corner, b, c] = [0, 1, 2].map(|step| own[(apex + step) % 3]);
        let size = (b - corner).abs().max((c - corner).abs()).max_element();
        if ((b + c - corner) - *far).abs().max_element() > size * FLAT {
            return false;
        }
        *self = Self { other_half: Some(item), ..Self::new(self.item, &[corner, b, c], false) };
        self.reach = self.reach.max(far.abs().max_element() as f32);
        true
    }
}
