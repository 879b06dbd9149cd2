//! Rays in the space of a mesh: corners are used as they are stored, and rays are transformed.

use crate::frame::Instance;
use crate::rays::SurfaceSource;
use crate::simd::three;

/// The rays of a source in the space of a mesh, and the map of normals back to eye space.
pub(super) struct Space<R: SurfaceSource> {
    /// The rays in the space of the mesh.
    pub rays: R::Local,
    /// Columns of the matrix that maps normals to eye space, divided by `normals_scale`.
    pub normals: [[f32; 3]; 3],
    pub normals_scale: f32,
    /// Largest coordinate that placed the mesh.
    pub reach: f32,
}

/// The space of an item: the kept one if it is that of the item, else a new one.
pub(super) fn space_of<R: SurfaceSource>(
    kept: &mut Option<(u32, Space<R>)>,
    item: u32,
    make: impl FnOnce() -> Space<R>,
) -> &Space<R> {
    if kept.as_ref().is_none_or(|(of, _)| *of != item) {
        *kept = None;
    }
    &kept.get_or_insert_with(|| (item, make())).1
}

impl<R: SurfaceSource> Space<R> {
    /// Eye space.
    pub(super) fn of_eye(rays: &R) -> Self {
        let normals = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Self { rays: rays.local(None), normals, normals_scale: 1.0, reach: 0.0 }
    }

    /// The space of an instance's mesh.
    pub(super) fn of_instance(rays: &R, instance: &Instance) -> Self {
        // The scale of normals is free, because they are normalised later: it is kept near one.
        let [x, y, z] = three!(i => instance.normals.col(i).abs());
        let size = x.max(y).max(z).max_element();
        Self {
            rays: rays.local(Some(instance)),
            normals: three!(i => (instance.normals.col(i) / size).as_vec3().to_array()),
            normals_scale: (1.0 / size) as f32,
            reach: instance.translation.abs().max_element() as f32,
        }
    }
}
