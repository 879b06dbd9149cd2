//! Footprints: how far texture coordinates reach over the part of a surface that a sample shows.
//!
//! A sample is a cone around its ray. Its width is that of a sample of the picture at the point's distance along the way of the light,
//! over all bounces; the curvature of mirrors does not widen it. On a surface the cone is an ellipse, longer along the ray by one over
//! the cosine of the angle to the normal. The texture is filtered over the longer axis, in texels (Williams, "Pyramidal Parametrics",
//! 1983).

use glam::{DVec3, Vec2};

use super::Surfaces;
use super::group::Group;
use super::place::Place;
use crate::frame::PreparedFrame;
use crate::rays::{HitBlock, SurfaceSource};
use crate::scene::{Camera, CameraKind, Filter, FovAxis, FrameView};
use crate::simd::math::log2;
use crate::simd::{Lanes, Simd, SimdBase, each_bit, f32x16, splat};

/// Least cosine: flatter surfaces are seen as at this angle.
const LEAST_COSINE: f64 = 1e-4;

/// Largest square of a footprint in texels.
const MOST: f32 = 1e30;

/// Width of the cone of a sample, in eye units: `base` + `growth` * distance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone {
    base: f64,
    growth: f64,
}

/// Reach of sixteen footprints: u and v along both axes of the ellipse.
pub(super) struct Footprint([[Lanes; 2]; 2]);

impl Cone {
    /// The cone of a frame; `None` if none of its textures is filtered by it.
    pub(super) fn for_frame(frame: &PreparedFrame) -> Option<Self> {
        let used = frame.textures().iter().any(|(_, map)| frame.filter_of(map) == Filter::Trilinear);
        (used && frame.features.textured).then(|| Self::of(frame.view(), frame.per_unit))
    }

    fn of(view: &FrameView, per_unit: f64) -> Self {
        let (width, height) = (f64::from(view.width), f64::from(view.height));
        let Camera { fov, zoom, .. } = view.camera;
        let samples = f64::from(view.grid());
        let plane = |side: f64| 2.0 * libm::tan(fov.to_radians() / 2.0) / (zoom * side * samples);
        match view.camera.kind {
            CameraKind::Pinhole { fov_axis: FovAxis::Vertical } => Self { base: 0.0, growth: plane(height) },
            CameraKind::Pinhole { fov_axis: FovAxis::Horizontal } => Self { base: 0.0, growth: plane(width) },
            CameraKind::Orthographic { view_height } => {
                Self { base: view_height * per_unit / (zoom * height * samples), growth: 0.0 }
            }
            CameraKind::Fisheye => {
                Self { base: 0.0, growth: fov.to_radians() / (width.min(height) * samples) }
            }
        }
    }

    /// Reach of u and v along the axes of the ellipse at a place, after a way before the ray in eye units.
    fn at(&self, place: &Place<'_>, before: f64) -> Option<[Vec2; 2]> {
        let width = self.base + self.growth * (before + place.distance);
        let [along_u, along_v] = place.uv_steps()?;
        let normal = place.normal();
        // Gradients of u and v on the surface.
        let (to_u, to_v) = (along_v.cross(normal), normal.cross(along_u));
        let (of_u, of_v) = (to_u / along_u.dot(to_u), to_v / along_v.dot(to_v));
        let cosine = place.direction.dot(normal);
        let across = place.direction - normal * cosine;
        let major = across.normalize_or(along_u.normalize_or_zero());
        let minor = normal.cross(major) * width;
        let major = major * (width / cosine.abs().max(LEAST_COSINE));
        let reach = |axis: DVec3| Vec2::new(of_u.dot(axis) as f32, of_v.dot(axis) as f32);
        Some([reach(major), reach(minor)])
    }
}

impl Footprint {
    /// The level of a texture whose texels are as large as the footprint, from 0 upwards, with a part of a level; `size` is in texels
    /// and `scale` that of the texture's tiling.
    #[inline(always)]
    pub(super) fn level<S: Simd>(&self, simd: S, size: [u32; 2], scale: Vec2) -> f32x16<S> {
        let mut most = splat(simd, 1.0);
        for axis in &self.0 {
            let u = axis[0].load(simd) * splat(simd, size[0] as f32 * scale.x);
            let v = axis[1].load(simd) * splat(simd, size[1] as f32 * scale.y);
            // The other one for NaN.
            most = (u * u + v * v).max_precise(most);
        }
        log2(simd, most.min(splat(simd, MOST))) * splat(simd, 0.5)
    }
}

impl Surfaces {
    /// The footprints of some lanes of a block; `None` if the frame uses none.
    #[inline(always)]
    pub(super) fn footprint<S: Simd, R: SurfaceSource>(
        &self,
        group: &Group<'_, R, S>,
        hits: &HitBlock,
    ) -> Option<Box<Footprint>> {
        let cone = self.cone.as_ref()?;
        Some(cone.footprint(group.rays, group.block, group.lanes, hits))
    }
}

impl Cone {
    #[inline(never)]
    fn footprint<R: SurfaceSource>(
        &self,
        rays: &R,
        block: usize,
        lanes: u32,
        hits: &HitBlock,
    ) -> Box<Footprint> {
        let mut footprint = Box::new(Footprint([[Lanes::ZERO; 2]; 2]));
        for lane in each_bit(lanes) {
            let place = Place::of(rays, block, lane, hits.slot(lane));
            let before = rays.way_before(block, lane);
            let Some(axes) = place.and_then(|place| self.at(&place, before)) else { continue };
            for (reach, axis) in footprint.0.iter_mut().zip(axes) {
                reach[0].0[lane] = axis.x;
                reach[1].0[lane] = axis.y;
            }
        }
        footprint
    }
}
