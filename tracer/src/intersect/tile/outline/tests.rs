//! Outlines against the exact intersection of every ray of a tile, at extreme radii and distances, on every level.

use glam::{DMat3, DVec3};
use proptest::prelude::*;

use super::{Outline, PictureLines};
use crate::frame::Affine;
use crate::rays::{BLOCKS, Projection, Ray, TileRays};
use crate::shape::EyeSphere;
use crate::simd::{self, LANES, dispatch};

/// A tile of a camera: axes to the right, upwards and forwards, focal length and place of the tile's centre in the picture.
#[derive(Clone, Copy, Debug)]
struct Tile {
    axes: [DVec3; 3],
    eye: DVec3,
    focal: f64,
    center: [f64; 2],
    parallel: bool,
}

impl Tile {
    fn projection(&self) -> Projection {
        let [right, up, forwards] = self.axes;
        let rows = if self.parallel {
            [right * self.focal, up * self.focal, forwards]
        } else {
            let [x, y] = self.center;
            [right * self.focal - forwards * x, up * self.focal - forwards * y, forwards]
        };
        let [x, y] = if self.parallel { self.center } else { [0.0; 2] };
        let linear = DMat3::from_cols(rows[0], rows[1], rows[2]).transpose();
        let constant =
            DVec3::new(-rows[0].dot(self.eye) - x, -rows[1].dot(self.eye) - y, -rows[2].dot(self.eye));
        Projection::new(Affine::new(linear, constant), 2.0, self.parallel)
    }

    /// The ray of a place: depth 1 at t = 1.
    fn ray(&self, x: f64, y: f64) -> Ray {
        let [right, up, forwards] = self.axes;
        let [x, y] = [(x + self.center[0]) / self.focal, (y + self.center[1]) / self.focal];
        let across = right * x + up * y;
        if self.parallel {
            Ray { origin: self.eye + across, direction: forwards }
        } else {
            Ray { origin: self.eye, direction: across + forwards }
        }
    }

    fn outlined<R>(
        &self,
        sphere: &EyeSphere,
        each: impl Fn(&Outline, [u32; 2], usize, &TileRays) -> R,
    ) -> Vec<R> {
        let projection = self.projection();
        let mut results = Vec::new();
        for level in simd::all() {
            let rays = dispatch!(level, simd => TileRays::grid(simd));
            let outline = PictureLines::new(&projection, &rays).outline(sphere);
            for block in 0..BLOCKS {
                let found = dispatch!(level, simd => outline.at(simd, &rays, block));
                results.push(each(&outline, found, block, &rays));
            }
        }
        results
    }
}

fn unit_axes([x, y, z]: [f64; 3], turn: f64) -> [DVec3; 3] {
    let forwards = DVec3::new(x, y, z + 1e-3).normalize();
    let (one, other) = forwards.any_orthonormal_pair();
    let (sin, cos) = libm::sincos(turn);
    [one * cos + other * sin, other * cos - one * sin, forwards]
}

fn tiles() -> impl Strategy<Value = Tile> {
    let vector = || prop::array::uniform3(-1.0..1.0_f64);
    (vector(), vector(), 0.0..6.3_f64, 1.0..3.3_f64, prop::array::uniform2(-500.0..500.0_f64), any::<bool>())
        .prop_map(|(forwards, eye, turn, focal, center, parallel)| Tile {
            axes: unit_axes(forwards, turn),
            eye: DVec3::from(eye),
            focal: libm::exp10(focal),
            center,
            parallel,
        })
}

proptest! {
    #[test]
    fn rays_are_rejected_and_accepted_as_by_the_exact_test(
        tile in tiles(),
        at in prop::array::uniform2(-12.0..12.0_f64),
        depth in -6.0..3.0_f64,
        radius in -7.0..7.0_f64,
        // Whether the outline is to pass near the place `at`.
        touches in any::<bool>(),
    ) {
        let ray = tile.ray(at[0], at[1]);
        let radius = libm::exp10(radius);
        let place = ray.origin + ray.direction * libm::exp10(depth);
        let center = if touches { place + tile.axes[0] * radius } else { place };
        let sphere = EyeSphere { center, radius };
        tile.outlined(&sphere, |outline, [may_hit, inside], block, rays| {
            for lane in 0..LANES {
                let ray = tile.ray(f64::from(rays.x[block].0[lane]), f64::from(rays.y[block].0[lane]));
                let hit = sphere.intersect(ray.origin, ray.direction, false);
                let (may_hit, inside) = (may_hit >> lane & 1 == 1, inside >> lane & 1 == 1);
                prop_assert!(may_hit || hit.is_none(), "rejected, but hit at {hit:?}");
                prop_assert!(may_hit || !inside);
                if let Some(t) = hit {
                    let closeness = if tile.parallel { -t } else { 1.0 / t };
                    prop_assert!(f64::from(outline.z_low) <= closeness && closeness <= f64::from(outline.z_high));
                }
                let in_front = if tile.parallel { outline.z_high < 0.0 } else { outline.z_low > 0.0 };
                prop_assert!(!inside || !in_front || hit.is_some(), "inside, but not hit");
            }
            Ok(())
        }).into_iter().collect::<Result<Vec<()>, TestCaseError>>()?;
    }
}

#[test]
fn a_two_hundredth_of_a_pixel_beside_the_outline_is_certain() {
    let (focal, depth) = (800.0, 0.5);
    for parallel in [false, true] {
        let axes = [DVec3::X, DVec3::Y, DVec3::NEG_Z];
        let tile = Tile { axes, eye: DVec3::ZERO, focal, center: [0.0; 2], parallel };
        let per_pixel = if parallel { 1.0 / focal } else { depth / focal };
        // The places of eight rays are 2.9155 pixels from the middle, and no others between 2.6 and 3.5.
        for radius in [2.91, 2.921] {
            let sphere = EyeSphere { center: DVec3::new(0.0, 0.0, -depth), radius: radius * per_pixel };
            tile.outlined(&sphere, |_, found, block, rays| {
                for lane in 0..LANES {
                    let [x, y] = [&rays.x, &rays.y].map(|places| f64::from(places[block].0[lane]));
                    let expected = x.hypot(y) < radius;
                    assert_eq!(found.map(|bits| bits >> lane & 1 == 1), [expected; 2], "{x} {y}");
                }
            });
        }
    }
}

#[test]
fn nothing_is_certain_from_the_inside_of_a_sphere() {
    let axes = [DVec3::X, DVec3::Y, DVec3::NEG_Z];
    let tile = Tile { axes, eye: DVec3::ZERO, focal: 800.0, center: [0.0; 2], parallel: false };
    let sphere = EyeSphere { center: DVec3::new(0.0, 0.0, -0.5), radius: 1.0 };
    tile.outlined(&sphere, |outline, [may_hit, _], _, _| {
        assert_eq!(may_hit, 0xffff);
        assert_eq!((outline.z_low, outline.z_high), (f32::NEG_INFINITY, f32::INFINITY));
    });
}
