//! Shafts: whether anything may be between the points of a tile and the ball of a light.
//!
//! Most tiles are fully lit by a light with an extent, and to find that once for the whole ball takes less than one query for each
//! of its points. The shaft is the hull of a box around the points and a box around the ball: for s from 0 to 1 a box whose
//! corners go from those of the one to those of the other (Haines and Wallace, "Shaft Culling for Efficient Ray-Cast Radiosity",
//! 1991). A surface in the shaft does no harm if a plane separates it from the points and the ball, as the surface that the
//! points are on does.
//!
//! A result "empty" is certain. Whatever else is found, the rays are traced.
//!
//! ```text
//!   slabs   boxes against the shaft, sixteen at a time
//!   sides   surfaces that are apart from the points and the ball
//! ```

mod sides;
mod slabs;
#[cfg(test)]
mod tests;

use glam::{DVec3, Vec3};

use crate::bvh::{MAX_WIDE_DEPTH, WIDTH, WideChild, WideNode};
use crate::compile::Item;
use crate::frame::{Instance, PreparedFrame};
use crate::mesh::TriangleBlock;
use crate::rays::BLOCKS;
use crate::simd::{Lanes, Simd, SimdBase, bits, each_bit, splat, three};
use sides::Sides;
use slabs::Slabs;

/// All segments from some points to a ball, in eye space.
pub(crate) struct Shaft<'a> {
    frame: &'a PreparedFrame,
    slabs: Slabs,
    sides: Sides<'a>,
}

impl<'a> Shaft<'a> {
    /// The shaft from points, indexed `[block][axis]`, to a ball; `None` without points, or if numbers are not finite.
    pub(crate) fn new(
        frame: &'a PreparedFrame,
        points: &'a [[Lanes; 3]; BLOCKS],
        lanes: &'a [u32; BLOCKS],
        center: DVec3,
        radius: f64,
    ) -> Option<Self> {
        let sides = Sides::new(points, lanes, center, radius)?;
        let slabs = Slabs::new(sides.bounds(), [center - radius, center + radius])?;
        Some(Self { frame, slabs, sides })
    }

    /// Whether it is certain that no surface is hit by any of the segments.
    #[inline(never)]
    pub(crate) fn is_empty<S: Simd>(&self, simd: S) -> bool {
        simd.vectorize(
            #[inline(always)]
            || {
                let planes = &self.frame.planes;
                planes
                    .iter()
                    .all(|plane| self.sides.are_apart_from(plane.normal, plane.normal * plane.offset))
                    && !any_leaf(simd, &self.frame.nodes, &self.slabs, |leaf| {
                        self.frame
                            .items_of(leaf)
                            .iter()
                            .any(|&item| self.may_hit(simd, self.frame.items.get(item)))
                    })
            },
        )
    }

    /// Whether a segment may hit an item.
    #[inline(always)]
    fn may_hit<S: Simd>(&self, simd: S, item: Item) -> bool {
        let (lo, hi) = self.frame.item_bounds(item);
        let [lo, hi] = [lo, hi].map(|corner| three!(axis => splat(simd, corner[axis])));
        if self.slabs.meet(simd, lo, hi) == 0 {
            return false;
        }
        match item {
            Item::Model(index) => self.may_hit_model(simd, &self.frame.instances[index]),
            Item::Sphere(index) => !self.sides.turn_from(&self.frame.spheres[index]),
            Item::Triangle(index) => !self.sides.are_apart_from_triangle(self.frame.triangles[index].corners),
            Item::Disk(index) => {
                let disk = &self.frame.disks[index];
                !self.sides.are_apart_from(disk.plane.normal, disk.center)
            }
        }
    }

    #[inline(always)]
    fn may_hit_model<S: Simd>(&self, simd: S, instance: &Instance) -> bool {
        let [points, ball] = self.sides.in_mesh(instance);
        let Some(slabs) = Slabs::new(points, ball) else { return true };
        let blocks = instance.mesh.blocks();
        any_leaf(simd, instance.mesh.nodes(), &slabs, |leaf| {
            let block = &blocks[leaf as usize];
            each_bit(triangles_in(simd, &slabs, block)).any(|lane| {
                let in_eye = |corner: Vec3| instance.linear * corner.as_dvec3() + instance.translation;
                !self.sides.are_apart_from_triangle(block.corners(lane).map(in_eye))
            })
        })
    }
}

/// Bits of the triangles of a leaf whose boxes meet a shaft.
#[inline(always)]
fn triangles_in<S: Simd>(simd: S, slabs: &Slabs, TriangleBlock([a, b, c]): &TriangleBlock) -> u32 {
    let corner = |corner: &[Lanes; 3], axis: usize| corner[axis].load(simd);
    let lo = three!(axis => corner(a, axis).min(corner(b, axis)).min(corner(c, axis)));
    let hi = three!(axis => corner(a, axis).max(corner(b, axis)).max(corner(c, axis)));
    // Lanes without a triangle are NaN.
    let first = corner(a, 0);
    bits(first.simd_eq(first)) & slabs.meet(simd, lo, hi)
}

/// Whether any leaf whose box meets a shaft is `occupied`.
#[inline(always)]
fn any_leaf<S: Simd>(
    simd: S,
    nodes: &[WideNode],
    slabs: &Slabs,
    mut occupied: impl FnMut(u32) -> bool,
) -> bool {
    let mut stack = [0; MAX_WIDE_DEPTH * (WIDTH - 1) + 1];
    let mut height = 1;
    while height > 0 {
        height -= 1;
        match WideChild::of(stack[height]) {
            WideChild::Block(leaf) => {
                if occupied(leaf) {
                    return true;
                }
            }
            WideChild::Inner(index) => {
                let node = &nodes[index as usize];
                let (lo, hi) =
                    (three!(axis => node.lo[axis].load(simd)), three!(axis => node.hi[axis].load(simd)));
                for lane in each_bit(node.present() & slabs.meet(simd, lo, hi)) {
                    stack[height] = node.link(lane);
                    height += 1;
                }
            }
        }
    }
    false
}
