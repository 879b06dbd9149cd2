//! The primitives of a scene that has only few of them, for blocks of rays: see `intersect::block`.

use super::PreparedFrame;
use crate::compile::Item;

/// Most primitives: more are searched by their tree.
const MOST: u32 = 40;

/// The primitives of a scene without models and planes, in `f32`.
#[derive(Clone, Debug)]
pub(crate) struct Few {
    pub triangles: Vec<FewTriangle>,
    pub spheres: Vec<FewSphere>,
    /// Largest difference of coincident surfaces.
    pub drift: f32,
}

/// A triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FewTriangle {
    pub item: u32,
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
        for item in items {
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
                    let [a, b, c] = frame.triangles[index].corners;
                    let (ab, ac) = (b - a, c - a);
                    few.triangles.push(FewTriangle {
                        item,
                        corner: a.as_vec3().to_array(),
                        edges: [ab.as_vec3().to_array(), ac.as_vec3().to_array()],
                        reach: a.abs().max(b.abs()).max(c.abs()).max_element() as f32,
                        size: ab.abs().max(ac.abs()).max_element() as f32,
                        area: ab.cross(ac).length() as f32,
                        cut: frame.triangles[index].cut,
                    });
                }
                Item::Disk(_) | Item::Model(_) => return None,
            }
        }
        Some(few)
    }
}
