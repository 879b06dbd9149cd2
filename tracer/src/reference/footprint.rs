//! Colours of textures, filtered over the part of a surface that a sample shows: a cone around its ray, as wide as the sample at the
//! length of the ray's whole way.

use glam::{DVec2, DVec3};

use super::Oracle;
use super::surface::SurfacePoint;
use super::texture::bilinear;
use crate::scene::{CameraKind, Filter, FovAxis, TextureMap};

/// Least cosine of the angle between a ray and a normal: flatter surfaces are seen as at this angle.
const LEAST_COSINE: f64 = 1e-4;

impl Oracle {
    /// Linear RGB of a texture at a surface point.
    pub(super) fn texture_color(&self, map: TextureMap, surface: &SurfacePoint) -> DVec3 {
        let filter = self.view.quality.filter.unwrap_or(map.filter);
        let index = self.textures.iter().position(|texture| texture.id() == map.texture);
        let Some(levels) =
            index.and_then(|index| self.pyramids.get(index)).filter(|_| filter == Filter::Trilinear)
        else {
            return self.texel(map, surface.uv).truncate();
        };
        let most = (levels.len() - 1) as f64;
        let size = DVec2::new(f64::from(levels[0].width), f64::from(levels[0].height));
        let reach = self.reach(surface).map(|uv| (uv * size * map.tiling.scale.as_dvec2()).length());
        let level = libm::log2(reach[0].max(reach[1]).max(1.0)).clamp(0.0, most);
        let at = |level: f64| {
            let level = &levels[level.min(most) as usize];
            bilinear(&map, [level.width, level.height], surface.uv, |i, j| level.texel(i, j).extend(1.0))
                .truncate()
        };
        at(level.floor()).lerp(at(level.floor() + 1.0), level.fract())
    }

    /// Reach of the texture coordinates along the long and the short axis of the ellipse in which the cone cuts the surface.
    fn reach(&self, surface: &SurfacePoint) -> [DVec2; 2] {
        let [by_u, by_v] = surface.tangents;
        let (n, d) = (surface.winding_normal, surface.direction);
        let (to_u, to_v) = (by_v.cross(n), n.cross(by_u));
        let (of_u, of_v) = (to_u / by_u.dot(to_u), to_v / by_v.dot(to_v));
        let cosine = d.dot(n);
        let along = (d - n * cosine).normalize_or(by_u.normalize_or_zero());
        let width = self.sample_width(surface.before + surface.way);
        let axes = [along * (width / cosine.abs().max(LEAST_COSINE)), n.cross(along) * width];
        axes.map(|axis| {
            let reach = DVec2::new(of_u.dot(axis), of_v.dot(axis));
            if reach.is_finite() { reach } else { DVec2::ZERO }
        })
    }

    /// Width of a sample of the picture at a distance, in world units.
    fn sample_width(&self, distance: f64) -> f64 {
        let camera = &self.view.camera;
        let (width, height) = (f64::from(self.view.width), f64::from(self.view.height));
        let plane = 2.0 * libm::tan(camera.fov.to_radians() / 2.0) / camera.zoom;
        let of_pixel = match camera.kind {
            CameraKind::Pinhole { fov_axis: FovAxis::Vertical } => plane / height * distance,
            CameraKind::Pinhole { fov_axis: FovAxis::Horizontal } => plane / width * distance,
            CameraKind::Orthographic { view_height } => view_height / camera.zoom / height,
            CameraKind::Fisheye => camera.fov.to_radians() / width.min(height) * distance,
        };
        of_pixel / f64::from(self.view.grid())
    }
}
