//! A tile in the space of a mesh: geometry stays where it is, the rays come to it.

use glam::DVec3;

use crate::frame::Instance;
use crate::simd::vector::Vec3x16;
use crate::simd::{Simd, three};
use crate::tile::visible::EyeTile;

/// The rays of a tile in the space of a mesh.
pub(super) struct Space {
    /// Where they start.
    pub origin: [f32; 3],
    /// Through the tile's centre, and what a step right and a step down add.
    directions: [[f32; 3]; 3],
    /// Columns of the matrix that takes normals to eye space, divided by `normals_scale`.
    pub normals: [[f32; 3]; 3],
    pub normals_scale: f32,
    /// Largest coordinate that placed the mesh.
    pub reach: f32,
}

/// The space of an item: the one that is kept, if it is this item's.
pub(super) fn space_of(kept: &mut Option<(u32, Space)>, item: u32, make: impl FnOnce() -> Space) -> &Space {
    if kept.as_ref().is_none_or(|(of, _)| *of != item) {
        *kept = None;
    }
    &kept.get_or_insert_with(|| (item, make())).1
}

impl Space {
    pub(super) fn of_eye(tile: &EyeTile<'_>) -> Self {
        let directions = three!(i => tile.steps[i].as_vec3().to_array());
        let normals = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Self { origin: [0.0; 3], directions, normals, normals_scale: 1.0, reach: 0.0 }
    }

    /// Of the rays of a block.
    #[inline(always)]
    pub(super) fn direction<S: Simd>(&self, simd: S, tile: &EyeTile<'_>, block: usize) -> Vec3x16<S> {
        let (x, y) = (tile.rays.x[block].load(simd), tile.rays.y[block].load(simd));
        let [center, right, down] = three!(i => Vec3x16::splat(simd, self.directions[i]));
        center.add(right.scale(x)).add(down.scale(y))
    }

    pub(super) fn of_instance(tile: &EyeTile<'_>, instance: &Instance) -> Self {
        let single = |v: DVec3| v.as_vec3().to_array();
        // Normals are normalised afterwards: their scale is free, and kept near one.
        let [x, y, z] = three!(i => instance.normals.col(i).abs());
        let size = x.max(y).max(z).max_element();
        Self {
            origin: single(instance.inverse * -instance.translation),
            directions: three!(i => single(instance.inverse * tile.steps[i])),
            normals: three!(i => single(instance.normals.col(i) / size)),
            normals_scale: (1.0 / size) as f32,
            reach: instance.translation.abs().max_element() as f32,
        }
    }
}
