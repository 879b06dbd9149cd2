//! Surfaces that a plane separates from the points of a tile and a ball, in `f64`.

use glam::{DMat3, DVec3};

use crate::frame::Instance;
use crate::rays::BLOCKS;
use crate::shape::EyeSphere;
use crate::simd::{Lanes, each_bit, three};

/// Distance that counts as apart, relative to the largest coordinate: far above the rounding of the exact test, and far below the
/// distance of the origin of a shadow ray from its surface.
const MARGIN: f64 = 1.0 / (1_u64 << 40) as f64;

/// The points of a tile, and a ball.
pub(super) struct Sides<'a> {
    points: &'a [[Lanes; 3]; BLOCKS],
    lanes: &'a [u32; BLOCKS],
    /// Bounds of the points.
    lo: DVec3,
    hi: DVec3,
    center: DVec3,
    radius: f64,
    /// Largest coordinate of points and ball.
    size: f64,
}

impl<'a> Sides<'a> {
    /// `None` without points, or if any is not finite.
    pub(super) fn new(
        points: &'a [[Lanes; 3]; BLOCKS],
        lanes: &'a [u32; BLOCKS],
        center: DVec3,
        radius: f64,
    ) -> Option<Self> {
        let nowhere = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let mut finite = center.is_finite() && radius.is_finite();
        let (lo, hi) = each_point(points, lanes).fold(nowhere, |(lo, hi), point| {
            finite &= point.is_finite();
            (lo.min(point), hi.max(point))
        });
        let size = lo.abs().max(hi.abs()).max(center.abs() + radius).max_element();
        (finite && size.is_finite()).then_some(Self { points, lanes, lo, hi, center, radius, size })
    }

    /// The box around the points.
    pub(super) fn bounds(&self) -> [DVec3; 2] {
        [self.lo, self.hi]
    }

    /// Boxes around the points and around the ball in the space of a mesh.
    pub(super) fn in_mesh(&self, instance: &Instance) -> [[DVec3; 2]; 2] {
        let DMat3 { x_axis, y_axis, z_axis } = instance.inverse;
        let around = |middle: DVec3, reach: DVec3| {
            let middle = instance.inverse * (middle - instance.translation);
            [middle - reach, middle + reach]
        };
        let half = (self.hi - self.lo) * 0.5;
        let of_box = x_axis.abs() * half.x + y_axis.abs() * half.y + z_axis.abs() * half.z;
        // Lengths of the rows.
        let rows = (x_axis * x_axis + y_axis * y_axis + z_axis * z_axis).map(f64::sqrt);
        [around((self.lo + self.hi) * 0.5, of_box), around(self.center, rows * self.radius)]
    }

    /// Whether all points and the ball are on one side of a plane.
    pub(super) fn are_apart_from(&self, normal: DVec3, on: DVec3) -> bool {
        let length = normal.length();
        let margin = length * self.size.max(on.abs().max_element()) * MARGIN;
        let of_center = normal.dot(self.center - on);
        if !(of_center.abs() - length * self.radius > margin) {
            return false;
        }
        let normal = if of_center < 0.0 { -normal } else { normal };
        let (middle, half) = ((self.lo + self.hi) * 0.5, (self.hi - self.lo) * 0.5);
        let of_box = normal.dot(middle - on) - normal.abs().dot(half);
        of_box > margin || each_point(self.points, self.lanes).all(|point| normal.dot(point - on) > margin)
    }

    /// [`Sides::are_apart_from`] the plane of a triangle.
    pub(super) fn are_apart_from_triangle(&self, [a, b, c]: [DVec3; 3]) -> bool {
        self.are_apart_from((b - a).cross(c - a), a)
    }

    /// Whether all points are outside of a sphere, and the ball is above the tangent plane of the nearest place of the sphere for
    /// each of them: then every segment leads away from the sphere.
    pub(super) fn turn_from(&self, sphere: &EyeSphere) -> bool {
        let margin = self.size.max(sphere.center.abs().max_element() + sphere.radius) * MARGIN;
        each_point(self.points, self.lanes).all(|point| {
            let out = point - sphere.center;
            let distance = out.length();
            distance > sphere.radius + margin
                && out.dot(self.center - point) > distance * (self.radius + margin)
        })
    }
}

/// The points of the lanes.
fn each_point(points: &[[Lanes; 3]; BLOCKS], lanes: &[u32; BLOCKS]) -> impl Iterator<Item = DVec3> {
    points.iter().zip(lanes).flat_map(|(points, &lanes)| {
        each_bit(lanes).map(move |lane| DVec3::from_array(three!(axis => f64::from(points[axis].0[lane]))))
    })
}
