//! Tiles of a plane mirror against brute force.

use super::*;
use crate::rays::{BATCH, MirrorTile, MirroredRay};

/// A plane that a camera in the origin sees.
fn mirror_before(random: &mut Random, camera: &Camera) -> Plane {
    let ahead = camera.look_at.normalize();
    let tilt = random.one_of(&[0.0, 0.3, 2.0, 30.0]);
    let normal = (random.vector() * tilt - ahead).normalize();
    Plane { point: ahead * random.ten_to(-2.0, 0.5), normal, material: 0, size: 1.0 }
}

/// A direction after the reflection at a plane.
fn reflected(direction: DVec3, normal: DVec3) -> DVec3 {
    direction - normal * (2.0 * direction.dot(normal))
}

#[inline(always)]
fn find_mirrored<S: Simd>(
    simd: S,
    frame: &PreparedFrame,
    (mirror, live, reflected): (PrimitiveId, [u32; BLOCKS], &[MirroredRay; BATCH]),
    corner: (u32, u32),
    hits: &mut [HitBlock; BLOCKS],
) {
    let CameraRays::Pinhole(camera) = &frame.rays else { panic!("only pinhole cameras have eye tiles") };
    let rays = &TileRays::grid(simd);
    let center = [corner.0, corner.1].map(|corner| f64::from(corner + SIDE as u32 / 2));
    let eye = EyeTile::new(frame, camera, TileSamples { rays, live, center, grid: frame.rays.grid() });
    let plane = frame.planes.last().unwrap();
    let tile = MirrorTile::new(simd, &eye, mirror, (plane.normal, plane.offset), live, reflected);
    find_closest::<S, dyn PictureTile>(simd, &tile, hits, &mut Scratch::new());
}

/// Checks the hits of the mirrored rays of a tile; returns how many of them hit something.
fn check_mirrored(seed: u64) -> usize {
    let random = &mut Random(seed ^ 0x5eed);
    let camera = camera(random);
    let grid = 1 + random.below(4) as u32;
    let size = (1 + random.below(40) as u32, 1 + random.below(40) as u32, grid * grid);
    let (width, height, samples) = size;
    let view = FrameView {
        camera,
        width,
        height,
        samples,
        spin: 0.0,
        quality: Quality::default(),
        ..FrameView::default()
    };
    let rays = CameraRays::new(&view, 1.0);
    let corner = (random.below(width as usize * 4) as u32, random.below(height as usize * 4) as u32);
    let plane = mirror_before(random, &camera);
    let image = plane.normal * (2.0 * plane.normal.dot(plane.point));
    let side = SIDE as u32;
    let seen = |i: u32| ray_of(&rays, corner.0 + i % side, corner.1 + i / side).direction;
    let targets: Vec<DVec3> = (0..side * side).map(|i| image + reflected(seen(i), plane.normal)).collect();
    let triangles = hard_triangles(random, &Beam::Point { origin: image, targets: &targets }, 60);
    let mut frame = frame_of(random, &triangles, camera, size, Some(plane));
    let mirror = PrimitiveId { item: frame.items.first_plane() + frame.planes.len() as u32 - 1, triangle: 0 };
    let normal = frame.planes.last().unwrap().normal;
    let mut live = [0; BLOCKS];
    let mut leaving = Box::new([MirroredRay::NONE; BATCH]);
    for (block, lane) in each_lane(&some_lanes(random)) {
        let (column, row) = place(block, lane);
        let arriving = ray_of(&frame.rays, corner.0 + column as u32, corner.1 + row as u32);
        let Some(t) = frame.t_of(&arriving, mirror, None) else { continue };
        live[block] |= 1 << lane;
        let direction = reflected(arriving.direction, normal).normalize();
        leaving[block * LANES + lane] = MirroredRay {
            ray: Ray { origin: arriving.direction * t, direction },
            start: t,
            speed: 1.0 / arriving.direction.length(),
        };
    }
    let primitives = primitives(&frame);
    let expected: Vec<(usize, usize, Option<PrimitiveId>)> = each_lane(&live)
        .map(|(block, lane)| {
            let ray = leaving[block * LANES + lane].ray;
            let hit = frame.preferred_of(&ray, primitives.iter().copied(), f64::INFINITY, Some(mirror));
            (block, lane, hit.map(|(_, primitive)| primitive))
        })
        .collect();
    let mut hits = [const { HitBlock::NONE }; BLOCKS];
    for level in simd::all() {
        frame.level = level;
        let rays = (mirror, live, &*leaving);
        dispatch!(level, simd => find_mirrored(simd, &frame, rays, corner, &mut hits));
        for &(block, lane, expected) in &expected {
            let found = hits[block].primitive(lane);
            assert_eq!(found, expected, "seed {seed}, {}, {block}/{lane}", simd::name(level));
        }
    }
    expected.iter().filter(|(_, _, hit)| hit.is_some()).count()
}

#[test]
fn closest_hits_of_mirrored_tiles_are_those_of_brute_force() {
    let tested: usize = (0..400).map(check_mirrored).sum();
    assert!(tested > 1000, "only {tested} rays hit something");
}
