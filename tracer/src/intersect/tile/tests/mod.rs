//! Tiles against brute force: closest hits and occluded points are those of the exact test of every primitive in turn, on
//! every level. The triangles are those that a filter with narrow bounds would get wrong: with a corner or an edge on a ray,
//! edge-on, slivers, layers a few digits apart, around the projection.

mod mirrored;

use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};

use super::{Scratch, find_closest};
use crate::compile::{CompiledScene, Item};
use crate::frame::{CameraRays, PreparedFrame};
use crate::light::SHADOW_T_MAX;
use crate::mesh::{CompiledMesh, Mesh, NamedMaterial};
use crate::rays::{
    BLOCKS, EyeTile, HitBlock, ParallelTile, PictureTile, PrimitiveId, Ray, SIDE, ShadowTarget, ShadowTile,
    TileRays, TileSamples, place,
};
use crate::scene::{
    Background, Camera, CameraKind, FrameView, Material, Model, NormalMode, Plane, Quality, RenderSettings,
    Scene, Sphere, Triangle,
};
use crate::simd::{self, LANES, Lanes, Simd, dispatch};

/// Pseudorandom numbers (Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", 2014).
pub(super) struct Random(pub(super) u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    fn one_of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }

    /// In [0, 1).
    fn share(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Components in [-1, 1).
    pub(super) fn vector(&mut self) -> DVec3 {
        DVec3::new(self.share(), self.share(), self.share()) * 2.0 - 1.0
    }

    /// Ten to the power of a uniform number.
    fn ten_to(&mut self, from: f64, to: f64) -> f64 {
        libm::exp10(from + (to - from) * self.share())
    }
}

/// Rays with a projection: from a point to targets, or parallel and from targets.
enum Beam<'a> {
    Point { origin: DVec3, targets: &'a [DVec3] },
    Parallel { direction: DVec3, targets: &'a [DVec3] },
}

impl Beam<'_> {
    /// A point on one of the rays.
    fn point(&self, random: &mut Random) -> DVec3 {
        match *self {
            Self::Point { origin, targets } => {
                let depths = [1e-6, 1e-3, 0.3, 0.9, 0.999_999, 1.0, 1.000_001, 1.5, 8.0, -0.5];
                origin + (random.one_of(targets) - origin) * random.one_of(&depths)
            }
            Self::Parallel { direction, targets } => {
                let depths = [0.0, 1e-9, 1e-3, 0.3, 0.999_999, 1.0, 1.000_001, 8.0, -1e-9, -0.5];
                random.one_of(targets) + direction * random.one_of(&depths)
            }
        }
    }

    /// Direction of the ray through a point, of any length.
    fn direction_at(&self, point: DVec3) -> DVec3 {
        match *self {
            Self::Point { origin, .. } => point - origin,
            Self::Parallel { direction, .. } => direction,
        }
    }

    /// A point that rays start at.
    fn start(&self) -> DVec3 {
        match *self {
            Self::Point { origin, .. } => origin,
            Self::Parallel { targets, .. } => targets[targets.len() / 2],
        }
    }

    /// Largest distance of a target.
    fn size(&self) -> f64 {
        let (Self::Point { targets, .. } | Self::Parallel { targets, .. }) = self;
        targets.iter().map(|target| target.distance(self.start())).fold(0.0, f64::max)
    }
}

/// Triangles that are hard to test against the rays of a beam.
fn hard_triangles(random: &mut Random, beam: &Beam<'_>, count: usize) -> Vec<[DVec3; 3]> {
    let (scale, start) = (beam.size(), beam.start());
    let mut triangles: Vec<[DVec3; 3]> = Vec::new();
    while triangles.len() < count {
        let [a, b] = [beam.point(random), beam.point(random)];
        let (small, size) = (scale * random.ten_to(-9.0, -2.0), scale * random.ten_to(-4.0, 0.5));
        let [u, v, w] = [random.vector(), random.vector(), random.vector()];
        let along = beam.direction_at(a);
        triangles.push(match random.below(8) {
            0 => [a + u * size, a + v * size, a + w * size],
            // Around the start of the rays.
            1 => [start + u * size, start + v * size * 10.0, start + w * size * 10.0],
            // A sliver.
            2 => [a, b, a.lerp(b, random.share()) + u * small],
            // Nearly edge-on.
            3 => [a, b, a + along * (v.x - 1.0) + beam.direction_at(b) * v.y + u * small],
            // A corner on a ray, an edge across a ray.
            4 => [a, a + u * size, a + v * size],
            5 => [a + u * size, a - u * size, a + v * size],
            // Nearly facing the rays: all points have about the same depth.
            6 => [a, a + (b - a) * v.x, a + along.cross(b - a).normalize_or_zero() * size],
            // A layer next to another.
            _ => match triangles.last() {
                Some(&[a, b, c]) => [a + u * small, b + u * small, c + w * small],
                None => continue,
            },
        });
    }
    triangles
}

/// A mesh of these triangles; `None` if all are degenerate.
fn mesh_of(triangles: &[[DVec3; 3]]) -> Option<CompiledMesh> {
    let material = NamedMaterial::plain("m", Material::NEUTRAL);
    let mesh = Mesh {
        positions: triangles.concat(),
        triangles: (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        triangle_materials: vec![0; triangles.len()],
        materials: vec![material],
        ..Mesh::default()
    };
    CompiledMesh::compile(&mesh).ok().map(|(mesh, _)| mesh)
}

fn camera(random: &mut Random) -> Camera {
    let fov = random.one_of(&[0.02, 3.0, 40.0, 120.0, 175.0]);
    Camera {
        position: DVec3::ZERO,
        look_at: random.vector(),
        up: DVec3::new(0.1, 1.0, 0.2),
        fov,
        zoom: 1.0,
        kind: CameraKind::PINHOLE,
    }
}

fn orthographic(random: &mut Random) -> Camera {
    let view_height = random.one_of(&[1e-6, 1e-2, 1.0, 40.0, 1e6]);
    Camera { kind: CameraKind::Orthographic { view_height }, ..camera(random) }
}

/// A scene of these triangles: most in a mesh with up to two nearly equal instances, four as triangles of the scene file, and
/// sometimes a sphere and a plane; and a mirror.
fn frame_of(
    random: &mut Random,
    triangles: &[[DVec3; 3]],
    camera: Camera,
    (width, height, samples): (u32, u32, u32),
    mirror: Option<Plane>,
) -> PreparedFrame {
    let (singles, rest) = triangles.split_at(4);
    let mesh = mesh_of(rest).map(Arc::new);
    let model = |translate: DVec3, scale: DVec3| Model {
        mesh: mesh.as_ref().unwrap().id(),
        materials: vec![0],
        normals: NormalMode::Flat,
        translate,
        rotate: DVec3::ZERO,
        scale,
        group: DMat3::IDENTITY,
    };
    let shift = random.vector() * random.one_of(&[0.0, 1e-8, 1e-6, 0.1]);
    let scale = random.one_of(&[DVec3::ONE, DVec3::new(1.0, -1.0, 1.0), DVec3::new(1.0, 0.3, 1e-4)]);
    let count = random.below(3).min(if mesh.is_some() { 2 } else { 0 });
    let placements = [(DVec3::ZERO, DVec3::ONE), (shift, scale)];
    let models = placements[..count].iter().map(|&(translate, scale)| model(translate, scale)).collect();
    let single = |vertices: &[DVec3; 3]| Triangle { vertices: *vertices, uvs: None, material: 0 };
    let few = random.below(4) == 0;
    let spheres = Sphere {
        center: random.vector(),
        radius: random.ten_to(-3.0, -0.5),
        material: 0,
        inside_out: false,
        uv_rotate: DVec3::ZERO,
    };
    let planes = Plane { point: random.vector(), normal: random.vector(), material: 0, size: 1.0 };
    let scene = Scene {
        ambient: Vec3::ZERO,
        render: RenderSettings { width, height, samples, ..RenderSettings::default() },
        camera,
        background: Background::Color(Vec3::ZERO),
        lights: vec![],
        materials: vec![Material::NEUTRAL],
        textures: vec![],
        models,
        spheres: vec![spheres; usize::from(few)],
        planes: std::iter::repeat_n(planes, usize::from(few)).chain(mirror).collect(),
        triangles: singles.iter().map(single).collect(),
        background_visible: true,
        disks: Vec::new(),
        ..Scene::default()
    };
    let view = FrameView::of(&scene);
    PreparedFrame::new(Arc::new(CompiledScene::new(scene, mesh, []).unwrap()), &view).unwrap()
}

/// All primitives of a frame.
fn primitives(frame: &PreparedFrame) -> Vec<PrimitiveId> {
    let mut all = Vec::new();
    for item in frame.items.range() {
        match frame.items.get(item) {
            Item::Model(index) => {
                let triangles = frame.instances[index].mesh.triangles();
                all.extend(triangles.map(|triangle| PrimitiveId { item, triangle }));
            }
            Item::Sphere(_) | Item::Triangle(_) | Item::Disk(_) => {
                all.push(PrimitiveId { item, triangle: 0 })
            }
        }
    }
    let planes = 0..frame.planes.len() as u32;
    all.extend(planes.map(|plane| PrimitiveId { item: frame.items.first_plane() + plane, triangle: 0 }));
    all
}

/// Live lanes: all, one, or any.
fn some_lanes(random: &mut Random) -> [u32; BLOCKS] {
    let mut lanes = [0; BLOCKS];
    match random.below(3) {
        0 => lanes = [0xffff; BLOCKS],
        1 => lanes[random.below(BLOCKS)] = 1 << random.below(LANES),
        _ => lanes.iter_mut().for_each(|lanes| *lanes = (random.bits() & random.bits()) as u32 & 0xffff),
    }
    lanes
}

fn each_lane(lanes: &[u32; BLOCKS]) -> impl Iterator<Item = (usize, usize)> {
    let all = (0..BLOCKS).flat_map(|block| (0..LANES).map(move |lane| (block, lane)));
    all.filter(|&(block, lane)| lanes[block] >> lane & 1 == 1)
}

#[inline(always)]
fn find_in_tile<S: Simd>(
    simd: S,
    frame: &PreparedFrame,
    live: [u32; BLOCKS],
    corner: (u32, u32),
    hits: &mut [HitBlock; BLOCKS],
) {
    let rays = &TileRays::grid(simd);
    let center = [corner.0, corner.1].map(|corner| f64::from(corner + SIDE as u32 / 2));
    let samples = TileSamples { rays, live, center, grid: frame.rays.grid() };
    let scratch = &mut Scratch::new();
    match &frame.rays {
        CameraRays::Pinhole(camera) => {
            find_closest(simd, &EyeTile::new(frame, camera, samples), hits, scratch);
        }
        CameraRays::Parallel(camera) => {
            let tile = ParallelTile::new(frame, camera, samples);
            find_closest::<S, dyn PictureTile>(simd, &tile, hits, scratch);
        }
        CameraRays::Fisheye(_) => panic!("fisheye cameras have no tiles"),
    }
}

/// The ray of a sample, by its column and row in the whole picture.
fn ray_of(rays: &CameraRays, column: u32, row: u32) -> Ray {
    let grid = f64::from(rays.grid());
    let (across, along) = ((f64::from(column) + 0.5) / grid, (f64::from(row) + 0.5) / grid);
    match rays {
        CameraRays::Pinhole(rays) => Ray { origin: DVec3::ZERO, direction: rays.through(across, along) },
        CameraRays::Parallel(rays) => Ray { origin: rays.origin(across, along), direction: rays.direction() },
        CameraRays::Fisheye(rays) => {
            Ray { origin: DVec3::ZERO, direction: rays.through(across, along).direction }
        }
    }
}

/// Checks, on each level, the closest hits of a tile of a camera among triangles that are hard to test against its rays.
fn check_closest(seed: u64, camera: fn(&mut Random) -> Camera) {
    let mut hits = [const { HitBlock::NONE }; BLOCKS];
    let random = &mut Random(seed);
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
    let side = SIDE as u32;
    let of_world: Vec<Ray> =
        (0..side * side).map(|i| ray_of(&rays, corner.0 + i % side, corner.1 + i / side)).collect();
    let triangles = if let CameraKind::Orthographic { view_height } = camera.kind {
        let targets: Vec<DVec3> = of_world.iter().map(|ray| ray.origin).collect();
        let direction = of_world[0].direction * view_height;
        hard_triangles(random, &Beam::Parallel { direction, targets: &targets }, 60)
    } else {
        let targets: Vec<DVec3> = of_world.iter().map(|ray| ray.direction).collect();
        hard_triangles(random, &Beam::Point { origin: DVec3::ZERO, targets: &targets }, 60)
    };
    let mut frame = frame_of(random, &triangles, camera, size, None);
    let live = some_lanes(random);
    let primitives = primitives(&frame);
    let closest = |ray: &Ray| frame.preferred_of(ray, primitives.iter().copied(), f64::INFINITY, None);
    let expected: Vec<(usize, usize, Option<PrimitiveId>)> = each_lane(&live)
        .map(|(block, lane)| {
            let (column, row) = place(block, lane);
            let hit = closest(&ray_of(&frame.rays, corner.0 + column as u32, corner.1 + row as u32));
            (block, lane, hit.map(|(_, primitive)| primitive))
        })
        .collect();
    for level in simd::all() {
        frame.level = level;
        dispatch!(level, simd => find_in_tile(simd, &frame, live, corner, &mut hits));
        for &(block, lane, expected) in &expected {
            let found = hits[block].primitive(lane);
            assert_eq!(found, expected, "seed {seed}, {}, {block}/{lane}", simd::name(level));
        }
    }
}

#[test]
fn closest_hits_of_tiles_are_those_of_brute_force() {
    (0..400).for_each(|seed| check_closest(seed, camera));
}

#[test]
fn closest_hits_of_parallel_tiles_are_those_of_brute_force() {
    (0..400).for_each(|seed| check_closest(seed, orthographic));
}

/// Points of a tile: a patch of a surface, smooth or rough, in two parts, or in one place.
fn points(random: &mut Random, middle: DVec3, light: DVec3) -> [[Lanes; 3]; BLOCKS] {
    let size = random.ten_to(-7.0, 0.0);
    let mut across = random.vector();
    let mut along = random.vector();
    match random.below(6) {
        // Edge-on from the light.
        0 => along = (light - middle).normalize_or_zero() + random.vector() * random.ten_to(-9.0, -1.0),
        // Nearly on a line.
        1 => along = across + random.vector() * random.ten_to(-9.0, -1.0),
        2 => (across, along) = (across * random.ten_to(-6.0, 0.0), along * 10.0),
        3 => (across, along) = (DVec3::ZERO, DVec3::ZERO),
        _ => {}
    }
    let roughness = random.one_of(&[0.0, 0.0, 1e-3, 1.0]);
    let step = random.vector() * random.one_of(&[0.0, 1.0, 30.0]);
    let mut points = [[Lanes::ZERO; 3]; BLOCKS];
    for (block, lane) in each_lane(&[0xffff; BLOCKS]) {
        let (column, row) = place(block, lane);
        let (x, y) = (column as f64 / 8.0 - 1.0, row as f64 / 8.0 - 1.0);
        let beyond = if column + 2 * row > 20 { step } else { DVec3::ZERO };
        let place = middle + (across * x + along * y + random.vector() * roughness + beyond) * size;
        (0..3).for_each(|axis| points[block][axis].0[lane] = place[axis] as f32);
    }
    points
}

fn point_of(points: &[[Lanes; 3]; BLOCKS], (block, lane): (usize, usize)) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|axis| f64::from(points[block][axis].0[lane])))
}

#[inline(always)]
fn occluded<S: Simd>(
    simd: S,
    frame: &PreparedFrame,
    light: ShadowTarget,
    points: &[[Lanes; 3]; BLOCKS],
    hits: &[HitBlock; BLOCKS],
    live: [u32; BLOCKS],
) -> [u32; BLOCKS] {
    let grid = &TileRays::grid(simd);
    let t_max = if matches!(light, ShadowTarget::Parallel(_)) { f64::INFINITY } else { SHADOW_T_MAX };
    let tile = ShadowTile { frame, light, t_max, grid, points, hits, live };
    *tile.occluded(simd, &mut Scratch::new())
}

/// Checks, on each level, the occluded points among triangles that are hard to test against the rays to a light.
fn check_shadows(seed: u64, far: f64) {
    let random = &mut Random(seed);
    let middle = random.vector();
    let mut light = middle + random.vector() * random.ten_to(-7.0, far);
    let mut points = points(random, middle, light);
    let lanes: Vec<(usize, usize)> = each_lane(&[0xffff; BLOCKS]).collect();
    let parallel = random.below(4) == 0;
    if random.below(10) == 0 {
        light = point_of(&points, random.one_of(&lanes));
    }
    let targets: Vec<DVec3> = lanes.iter().map(|&lane| point_of(&points, lane)).collect();
    let triangles = hard_triangles(random, &Beam::Point { origin: light, targets: &targets }, 60);
    let camera = camera(random);
    let mut frame = frame_of(random, &triangles, camera, (16, 16, 1), None);
    let scale = frame.per_unit;
    for block in &mut points {
        block.iter_mut().for_each(|lanes| lanes.0.iter_mut().for_each(|x| *x *= scale as f32));
    }
    let light =
        if parallel { ShadowTarget::Parallel(light - middle) } else { ShadowTarget::Point(light * scale) };
    let primitives = primitives(&frame);
    let mut hits = [const { HitBlock::NONE }; BLOCKS];
    let live = some_lanes(random);
    let mut expected = [0; BLOCKS];
    for (block, lane) in each_lane(&live) {
        let origin = point_of(&points, (block, lane));
        // Not a sphere: the far root assumes a point on the sphere, and these are on none.
        let own = (random.below(2) == 0).then(|| random.one_of(&primitives));
        let is_sphere = |item| matches!(frame.items.get(item), Item::Sphere(_));
        let own = own.filter(|own| own.item >= frame.items.first_plane() || !is_sphere(own.item));
        if let Some(own) = own {
            hits[block].set(lane, own);
        }
        let (direction, t_max) = match light {
            ShadowTarget::Point(light) => (light - origin, SHADOW_T_MAX),
            ShadowTarget::Parallel(to_light) => (to_light, f64::INFINITY),
        };
        let ray = Ray { origin, direction };
        let hits = primitives.iter().filter_map(|&primitive| frame.hit_of(&ray, primitive, own));
        expected[block] |= u32::from(hits.into_iter().any(|hit| hit.t < t_max)) << lane;
    }
    for level in simd::all() {
        frame.level = level;
        let found = dispatch!(level, simd => occluded(simd, &frame, light, &points, &hits, live));
        assert_eq!(found, expected, "seed {seed}, far {far}, {}", simd::name(level));
    }
}

#[test]
fn occluded_points_of_tiles_are_those_of_brute_force() {
    for seed in 0..400 {
        check_shadows(seed, 1.0);
        check_shadows(seed, 6.0);
    }
}
