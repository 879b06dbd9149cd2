//! Boxes of triangles against the test of every triangle.

use glam::{DVec3, Vec3};

use super::super::Oracle;
use super::super::cull::Boxes;
use super::super::terminator::ShadowStart;
use super::{BLACK, empty, looking, plane, sphere};
use crate::scene::{Material, Scene, Triangle};

/// Weyl's sequence of the golden ratio, in [-1, 1): evenly spread, and the same on every machine.
struct Spread(u64);

impl Spread {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (mixed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn point(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next())
    }
}

/// Triangles of all sizes and directions, a grid on the plane y = 0 and one on z = 1/2, some of them transparent, and other shapes.
fn crowd(spread: &mut Spread) -> Scene {
    let mut scene = empty();
    scene.materials = vec![BLACK, Material { transmit: Vec3::new(0.5, 0.25, 0.75), ..BLACK }];
    let mut put = |vertices, material| scene.triangles.push(Triangle { vertices, uvs: None, material });
    for i in 0..400 {
        let (center, size) = (spread.point(), 0.3 * libm::exp2(f64::from(i % 8) - 7.0));
        put([0; 3].map(|_| center + spread.point() * size), u32::from(i % 3 == 0));
    }
    for (x, y) in (-4..4).flat_map(|x| (-4..4).map(move |y| (f64::from(x) / 4.0, f64::from(y) / 4.0))) {
        let corners = [(0.0, 0.0), (0.25, 0.0), (0.25, 0.25), (0.0, 0.25)].map(|(a, b)| (x + a, y + b));
        let [a, b, c, d] = corners.map(|(x, z)| DVec3::new(x, 0.0, z));
        put([a, b, c], 1);
        put([a, c, d], 0);
        let [a, b, c, d] = corners.map(|(x, y)| DVec3::new(x, y, 0.5));
        put([a, b, c], 0);
        put([a, c, d], 1);
    }
    scene.spheres = vec![sphere(DVec3::new(0.2, 0.3, 0.1), 0.2, 1)];
    scene.planes = vec![plane(DVec3::NEG_Y, DVec3::Y, 0)];
    scene
}

/// Random rays, rays along the axes from random points and from corners of the grids, and rays in the planes of the grids.
fn rays(spread: &mut Spread) -> Vec<[DVec3; 2]> {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z];
    let corner = |point: DVec3| (point * 4.0).round() / 4.0;
    let mut rays = Vec::new();
    for i in 0..1500 {
        let (from, to) = (spread.point() * 2.0, spread.point());
        let axis = axes[i % 6];
        rays.extend([[from, to - from], [from, axis], [corner(from), axis], [corner(from), to - from]]);
        rays.push([from * DVec3::new(1.0, 0.0, 1.0), (to - from) * DVec3::new(1.0, 0.0, 1.0)]);
        rays.push([from.with_z(0.5), (to - from).with_z(0.0)]);
    }
    rays
}

#[test]
fn boxes_change_no_hit_and_no_shadow() {
    let mut spread = Spread(1);
    for (scale, away) in [(1.0, 0.0), (1e-6, 0.0), (1e9, 0.0), (1.0, 1e5)] {
        let mut scene = crowd(&mut spread);
        let moved = |p: DVec3| p * scale + DVec3::splat(away);
        for triangle in &mut scene.triangles {
            triangle.vertices = triangle.vertices.map(moved);
        }
        scene.spheres[0].center = moved(scene.spheres[0].center);
        scene.spheres[0].radius *= scale;
        scene.planes[0].point = moved(scene.planes[0].point);
        let view = looking(&scene, DVec3::ZERO, DVec3::NEG_Z);
        let culled = Oracle::new(&scene, &[], &[], &view);
        let mut whole = Oracle::new(&scene, &[], &[], &view);
        whole.boxes = Boxes::none(&whole.primitives);
        let (mut hits, mut tested) = (0, 0);
        for [from, direction] in rays(&mut spread) {
            let from = moved(from);
            let seen = [&culled, &whole].map(|oracle| {
                let found = oracle.closest(from, direction, f64::INFINITY, None);
                found.map(|found| (found.primitive, found.crossing.t.to_bits(), found.coincidence.to_bits()))
            });
            assert_eq!(seen[0], seen[1], "{from} {direction} at scale {scale}");
            let start = ShadowStart { position: from, normal: DVec3::Y, on: 0 };
            let [a, b] = [&culled, &whole].map(|oracle| oracle.unoccluded(&start, direction * scale, 1.0));
            assert_eq!(a, b, "shadow from {from} along {direction} at scale {scale}");
            hits += usize::from(seen[0].is_some());
            tested += culled.boxes.candidates(from, direction).len();
        }
        let all = 9000 * culled.primitives.len();
        assert!(hits > 4000 && hits < 9000 && tested * 4 < all, "{hits} hits, {tested} of {all} tests");
    }
}
