//! Volumes in eye space.

use glam::DVec3;

use super::affine::Affine;
use super::instance::{Instance, ToEye};
use crate::compile::{AttributeUse, CompiledScene};
use crate::scene::VolumeBoundary;
use crate::shape::EyeSphere;

/// A homogeneous volume.
#[derive(Debug)]
pub(crate) struct EyeVolume {
    pub boundary: EyeBoundary,
    /// Mean number of scatterings per eye unit.
    pub density: f64,
    /// Albedo, linear RGB.
    pub color: DVec3,
}

/// The surface of a volume.
#[derive(Debug)]
pub(crate) enum EyeBoundary {
    Sphere(EyeSphere),
    /// The corners with the lowest and the highest coordinates.
    Box(DVec3, DVec3),
    Solid {
        instance: Box<Instance>,
        /// Whether the fronts of its triangles face its inside.
        faces_inside: bool,
    },
}

/// Places the volumes of a scene.
pub(super) fn volumes(
    scene: &CompiledScene,
    spin: f64,
    to_eye: &ToEye,
    to_picture: &Affine,
) -> Vec<EyeVolume> {
    let mut solids = scene.solids().iter();
    let place = |boundary: &VolumeBoundary| {
        Some(match boundary {
            VolumeBoundary::Sphere { center, radius } => {
                EyeBoundary::Sphere(EyeSphere { center: to_eye.point(*center), radius: radius / to_eye.unit })
            }
            VolumeBoundary::Box { lower, upper } => {
                EyeBoundary::Box(to_eye.point(*lower), to_eye.point(*upper))
            }
            VolumeBoundary::Model(model) => {
                let solid = solids.next()?;
                let unseen = AttributeUse::default();
                let instance = Instance::new(model, &solid.mesh, &unseen, spin, to_eye, to_picture);
                EyeBoundary::Solid { instance: Box::new(instance), faces_inside: solid.faces_inside }
            }
        })
    };
    let boundaries: Vec<EyeBoundary> =
        scene.scene().volumes.iter().map(|volume| &volume.boundary).filter_map(place).collect();
    let with_medium = boundaries.into_iter().zip(&scene.scene().volumes);
    with_medium
        .map(|(boundary, volume)| EyeVolume {
            boundary,
            density: volume.density * to_eye.unit,
            color: volume.color.as_dvec3(),
        })
        .collect()
}
