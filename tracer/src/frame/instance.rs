//! Meshes placed in eye space.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::affine::Affine;
use super::rounding::{F64_ERROR, largest_axis};
use crate::compile::{AttributeUse, orientation};
use crate::mesh::CompiledMesh;
use crate::scene::{Model, NormalMode};

/// A mesh placed in eye space: eye = `linear` * mesh + `translation`.
#[derive(Debug)]
pub(crate) struct Instance {
    pub mesh: Arc<CompiledMesh>,
    pub linear: DMat3,
    pub translation: DVec3,
    /// Linear map from eye space to mesh space.
    pub inverse: DMat3,
    /// Map of normals from mesh space to eye space, up to their length.
    pub normals: DMat3,
    /// Whether normals are interpolated.
    pub smooth: bool,
    /// `linear` and `translation` as one map.
    pub placement: Affine,
    /// Map from mesh space to the camera's picture.
    pub to_picture: Affine,
    /// Whether a material of the model has a texture.
    pub textured: bool,
    /// Error bound of the placement as a whole, in eye units.
    pub error: f64,
    /// Largest distance of coincident points on each axis, in mesh units.
    pub drift: f32,
    /// Whether a material of the model uses vertex colours.
    pub colored: bool,
    /// Bits of the triangles that alpha cuts out: see `PreparedFrame::cutouts_of`.
    pub cutouts: Arc<[u16]>,
}

/// The map from world space to eye space.
pub(super) struct ToEye {
    /// Position of the camera in the world.
    pub eye: DVec3,
    /// World units per eye unit: a power of two.
    pub unit: f64,
}

impl ToEye {
    /// Eye space coordinates of a point of the world.
    pub(super) fn point(&self, world: DVec3) -> DVec3 {
        (world - self.eye) / self.unit
    }
}

impl Instance {
    /// Places a model. Its `drift` is still to be set.
    pub(super) fn new(
        model: &Model,
        mesh: &Arc<CompiledMesh>,
        attributes: &AttributeUse,
        spin: f64,
        to_eye: &ToEye,
        to_picture: &Affine,
    ) -> Self {
        let orientation = orientation(model, spin);
        let unit = to_eye.unit;
        // Powers of two only: exact.
        let linear = orientation * (libm::exp2(f64::from(mesh.exponent())) / unit);
        let inverse = linear.inverse();
        let translation = to_eye.point(model.translate) + orientation * mesh.center() / unit;
        let placement = Affine::new(linear, translation);
        let numbers =
            (model.translate.abs() + (orientation * mesh.center()).abs()) / unit + translation.abs();
        let error = F64_ERROR * (numbers.max_element() + largest_axis(&linear));
        Self {
            mesh: Arc::clone(mesh),
            linear,
            translation,
            placement,
            to_picture: to_picture.after(&placement),
            inverse,
            normals: inverse.transpose(),
            smooth: model.normals == NormalMode::Smooth,
            textured: attributes.textured,
            error,
            drift: 0.0,
            colored: attributes.colored,
            cutouts: Arc::clone(&attributes.cutouts),
        }
    }

    /// Whether its triangles have flat normals and one colour each.
    #[inline(always)]
    pub(crate) fn is_bare(&self) -> bool {
        !self.smooth && !self.textured && !self.colored
    }

    /// Sets [`Instance::drift`] for surfaces of which each is off by at most `coarsest` eye units.
    pub(super) fn set_drift(&mut self, coarsest: f64) {
        self.drift = (2.0 * coarsest * largest_axis(&self.inverse)) as f32;
    }
}
