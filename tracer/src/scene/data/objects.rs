//! Geometry of a scene: instances of meshes, spheres, planes, single triangles.

use glam::{DMat3, DVec3, Vec2};
use serde::{Deserialize, Serialize};

use crate::mesh::MeshId;

/// Shading normals of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum NormalMode {
    /// Interpolated between the vertices.
    Smooth,
    /// Geometric normal of each triangle.
    Flat,
}

/// An instance of a compiled mesh: scaled, rotated about x, y and z in turn, transformed by its groups, then translated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// Hash of the compiled mesh.
    pub mesh: MeshId,
    /// For each material slot of the mesh, an index into [`crate::scene::Scene::materials`].
    pub materials: Vec<u32>,
    /// Shading normals.
    pub normals: NormalMode,
    /// World position of the mesh's origin.
    pub translate: DVec3,
    /// Degrees about x, then y, then z.
    pub rotate: DVec3,
    /// Factors along the mesh's own axes; none is zero.
    pub scale: DVec3,
    /// Linear part of the transforms of the groups that the model is in, after its own rotation; invertible. `translate` is final.
    pub group: DMat3,
}

/// An analytic sphere.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sphere {
    /// World position of the centre.
    pub center: DVec3,
    /// Radius in scene units, above zero.
    pub radius: f64,
    /// Index into [`crate::scene::Scene::materials`].
    pub material: u32,
    /// Whether its front side is the inside: a bubble in a transparent material.
    pub inside_out: bool,
    /// Rotation of its texture coordinates, which are those of a panorama: degrees about x, then y, then z.
    pub uv_rotate: DVec3,
}

/// An infinite plane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plane {
    /// Any point on it.
    pub point: DVec3,
    /// Unit normal; both sides are visible.
    pub normal: DVec3,
    /// Index into [`crate::scene::Scene::materials`].
    pub material: u32,
    /// World units per repeat of a texture.
    pub size: f64,
}

/// A flat disk.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Disk {
    /// World position of the centre.
    pub center: DVec3,
    /// Unit normal; both sides are visible.
    pub normal: DVec3,
    /// Radius in scene units, above zero.
    pub radius: f64,
    /// Index into [`crate::scene::Scene::materials`].
    pub material: u32,
}

/// A single flat triangle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Triangle {
    /// World positions of the corners.
    pub vertices: [DVec3; 3],
    /// Texture coordinates of the corners, whole repeats removed as by [`crate::texture::without_repeats`].
    pub uvs: Option<[Vec2; 3]>,
    /// Index into [`crate::scene::Scene::materials`].
    pub material: u32,
}
