//! Single rays: watertightness, ties, shadows; and blocks of rays against single ones.

use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};
use proptest::prelude::*;

use super::*;
use crate::compile::CompiledScene;
use crate::intersect::{Primitive, RayHit};
use crate::mesh::{CompiledMesh, Mesh, NamedMaterial};
use crate::scene::{
    Background, Camera, CameraKind, FrameView, Material, Model, NormalMode, Plane, RenderSettings, Scene,
    Sphere, Triangle,
};
use crate::shape::ShearedRay;

/// The closest hit: its t and its primitive.
fn closest(frame: &PreparedFrame, ray: &Ray, t_max: f64) -> Option<(f64, PrimitiveId)> {
    frame.closest(ray, t_max, None).map(|hit| (hit.t, hit.primitive))
}

/// A scene of models of one mesh, seen from `eye`.
fn frame_of(mesh: &Mesh, eye: DVec3, change: impl FnOnce(&mut Scene)) -> PreparedFrame {
    let (compiled, _) = CompiledMesh::compile(mesh).unwrap();
    let model = Model {
        mesh: compiled.id(),
        materials: vec![0],
        normals: NormalMode::Flat,
        translate: DVec3::ZERO,
        rotate: DVec3::ZERO,
        scale: DVec3::ONE,
        group: DMat3::IDENTITY,
    };
    let look_at = eye + DVec3::NEG_Z;
    let mut scene = Scene {
        ambient: Vec3::ZERO,
        render: RenderSettings::default(),
        camera: Camera {
            position: eye,
            look_at,
            up: DVec3::Y,
            fov: 40.0,
            zoom: 1.0,
            kind: CameraKind::PINHOLE,
        },
        background: Background::Color(Vec3::ZERO),
        lights: vec![],
        materials: vec![Material::NEUTRAL],
        textures: vec![],
        models: vec![model],
        spheres: vec![],
        planes: vec![],
        triangles: vec![],
        disks: Vec::new(),
        background_visible: true,
        ..Scene::default()
    };
    change(&mut scene);
    let view = FrameView::of(&scene);
    PreparedFrame::new(Arc::new(CompiledScene::new(scene, [Arc::new(compiled)], []).unwrap()), &view).unwrap()
}

fn mesh_of(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Mesh {
    let slots = vec![0; triangles.len()];
    let material = NamedMaterial::plain("m", Material::NEUTRAL);
    Mesh { positions, triangles, triangle_materials: slots, materials: vec![material], ..Mesh::default() }
}

/// A closed, lumpy ball: every edge belongs to two triangles.
fn ball(rings: u32, sectors: u32, place: impl Fn(DVec3) -> DVec3) -> Mesh {
    let mut positions = vec![place(DVec3::Y), place(DVec3::NEG_Y)];
    for ring in 1..rings {
        for sector in 0..sectors {
            let polar = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
            let around = std::f64::consts::TAU * f64::from(sector) / f64::from(sectors);
            let radius = 1.0 + 0.13 * f64::from((ring * 7 + sector * 3) % 5);
            let unit = DVec3::new(polar.sin() * around.cos(), polar.cos(), polar.sin() * around.sin());
            positions.push(place(unit * radius));
        }
    }
    let at = |ring: u32, sector: u32| 2 + (ring - 1) * sectors + sector % sectors;
    let mut triangles = Vec::new();
    for sector in 0..sectors {
        triangles.push([0, at(1, sector + 1), at(1, sector)]);
        triangles.push([1, at(rings - 1, sector), at(rings - 1, sector + 1)]);
        for ring in 1..rings - 1 {
            let (a, b) = (at(ring, sector), at(ring, sector + 1));
            let (c, d) = (at(ring + 1, sector), at(ring + 1, sector + 1));
            triangles.push([a, b, d]);
            triangles.push([a, d, c]);
        }
    }
    mesh_of(positions, triangles)
}

/// Rays from `eye` at every vertex and at points of every edge of a mesh around the origin. Returns how many missed.
fn leaks(mesh: &Mesh, eye: DVec3) -> usize {
    let frame = frame_of(mesh, eye, |_| {});
    let aim = |target: DVec3| {
        closest(&frame, &Ray { origin: DVec3::ZERO, direction: target - eye }, f64::INFINITY).is_none()
    };
    let mut missed = mesh.positions.iter().filter(|&&p| aim(p)).count();
    for corners in &mesh.triangles {
        for edge in 0..3 {
            let [a, b] = [edge, (edge + 1) % 3].map(|i| mesh.positions[corners[i] as usize]);
            missed += (1..8).filter(|&i| aim(a.lerp(b, f64::from(i) / 8.0))).count();
        }
    }
    missed
}

#[test]
fn rays_from_inside_hit_all_edges_and_vertices() {
    for eye in [DVec3::ZERO, DVec3::new(0.3, -0.2, 0.11), DVec3::new(0.0, 0.7, 0.0)] {
        assert_eq!(leaks(&ball(24, 37, |p| p), eye), 0, "from {eye}");
    }
}

#[test]
fn rays_from_inside_hit_edges_at_any_scale_and_place() {
    for (scale, offset) in [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e6), (3.0, -1e4)] {
        let place = |p: DVec3| p * scale + offset * scale;
        let eye = place(DVec3::new(0.1, 0.2, -0.1));
        assert_eq!(leaks(&ball(12, 19, place), eye), 0, "scale {scale}, offset {offset}");
    }
}

#[test]
fn zero_components_of_directions_hit_like_others() {
    let frame = frame_of(&ball(12, 20, |p| p), DVec3::ZERO, |_| {});
    for direction in [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z] {
        for length in [1.0, 1e-30, 1e90] {
            let ray = Ray { origin: DVec3::ZERO, direction: direction * length };
            assert!(closest(&frame, &ray, f64::INFINITY).is_some(), "{direction} {length}");
        }
    }
}

#[test]
fn at_equal_distances_the_lowest_source_index_wins() {
    // Two coplanar triangles that overlap, wound so that cleaning keeps both; then the same in the other order.
    let quad = [DVec3::new(-1.0, -1.0, -2.0), DVec3::new(1.0, -1.0, -2.0), DVec3::new(0.0, 1.0, -2.0)];
    let larger = quad.map(|p| DVec3::new(p.x * 2.0, p.y * 2.0, p.z));
    for order in [[quad, larger], [larger, quad]] {
        let positions = order.iter().flatten().copied().collect();
        let frame = frame_of(&mesh_of(positions, vec![[0, 1, 2], [3, 4, 5]]), DVec3::ZERO, |_| {});
        let ray = Ray { origin: DVec3::ZERO, direction: DVec3::NEG_Z };
        let (_, primitive) = closest(&frame, &ray, f64::INFINITY).unwrap();
        assert_eq!(frame.instances[0].mesh.source(primitive.triangle), 0);
    }
}

#[test]
fn at_equal_distances_the_first_item_wins() {
    let corners = [DVec3::new(-1.0, -1.0, -2.0), DVec3::new(1.0, -1.0, -2.0), DVec3::new(0.0, 1.0, -2.0)];
    let frame = frame_of(&ball(6, 6, |p| p + DVec3::Z * 50.0), DVec3::ZERO, |scene| {
        scene.triangles = vec![Triangle { vertices: corners, uvs: None, material: 0 }; 5];
    });
    let ray = Ray { origin: DVec3::ZERO, direction: DVec3::NEG_Z };
    let (_, primitive) = closest(&frame, &ray, f64::INFINITY).unwrap();
    assert_eq!(primitive.item, 1, "item 0 is the model, 1 the first triangle");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Random triangles, instanced and rotated, against every triangle in turn.
    #[test]
    fn the_tree_finds_what_brute_force_finds(
        seeds in prop::collection::vec(prop::array::uniform9(-1.0..1.0_f64), 1..60),
        rotate in prop::array::uniform3(-180.0..180.0_f64),
        scale in prop::array::uniform3(0.1..3.0_f64),
        directions in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 20),
    ) {
        let positions: Vec<DVec3> = seeds
            .iter()
            .flat_map(|s| {
                let [ax, ay, az, bx, by, bz, cx, cy, cz] = *s;
                let middle = DVec3::new(ax, ay, az) * 3.0;
                [middle, middle + DVec3::new(bx, by, bz), middle + DVec3::new(cx, cy, cz)]
            })
            .collect();
        let triangles = (0..seeds.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let frame = frame_of(&mesh_of(positions, triangles), DVec3::new(0.1, 0.2, 0.3), |scene| {
            scene.models[0].rotate = rotate.into();
            scene.models[0].scale = scale.into();
            scene.models.push(scene.models[0].clone());
            scene.models[1].translate = DVec3::new(2.0, -1.0, 0.5);
        });
        for direction in directions {
            let ray = Ray { origin: DVec3::ZERO, direction: direction.into() };
            prop_assume!(ray.direction.length() > 1e-3);
            let brute = brute_force(&frame, &ray);
            let found = closest(&frame, &ray, f64::INFINITY);
            prop_assert_eq!(found, brute);
            if let Some((t, primitive)) = brute {
                prop_assert!(frame.occluded(&ray, t * 1.001, None));
                prop_assert!(!frame.occluded(&ray, t, None));
                prop_assert!(!frame.occluded(&ray, t * 1.000001, Some(primitive)) || brute_count(&frame, &ray, t * 1.00001) > 1);
                prop_assert_eq!(closest(&frame, &ray, t), None);
            }
        }
    }

    /// Rays from anywhere, near and far, at vertices, at points of edges, and past the mesh: on every level of SIMD what
    /// brute force finds, to the bit.
    #[test]
    fn at_vertices_and_edges_every_level_finds_what_brute_force_finds(
        from in prop::array::uniform3(-3.0..3.0_f64),
        distance in prop::sample::select(vec![0.1, 1.0, 30.0, 1e5]),
        targets in prop::collection::vec((0_usize..400, 0_usize..3, 0.0..1.0_f64, prop::bool::ANY), 30),
        length in prop::sample::select(vec![1.0, 1.0 / f64::from(1 << 25), f64::from(1 << 25)]),
        shift in prop::array::uniform3(-1.0..1.0_f64),
        apart in prop::sample::select(vec![1e-2, 1e-6, 1e-7]),
    ) {
        let mesh = ball(9, 13, |p| p);
        let mut frame = frame_of(&mesh, DVec3::new(0.1, 0.2, 0.3), |scene| {
            scene.models.push(scene.models[0].clone());
            // Once more in the same place, so that all hits tie, and once slightly apart.
            scene.models.push(Model { translate: DVec3::from(shift) * apart, ..scene.models[0].clone() });
        });
        let scale = 1.0 / frame.per_unit;
        for (triangle, corner, share, on_edge) in targets {
            let corners = mesh.triangles[triangle % mesh.triangles.len()].map(|v| mesh.positions[v as usize]);
            let [a, b] = [corners[corner], corners[(corner + 1) % 3]];
            let target = if on_edge { a.lerp(b, share) } else { a };
            let origin = DVec3::from(from) * distance;
            prop_assume!((target - origin).length() > 1e-3);
            let eye = DVec3::new(0.1, 0.2, 0.3);
            let direction = (target - origin) * length;
            let ray = Ray { origin: (origin - eye) / scale, direction: direction / scale };
            let brute = brute_force(&frame, &ray);
            for level in crate::simd::all() {
                frame.level = level;
                prop_assert_eq!(closest(&frame, &ray, f64::INFINITY), brute);
                let public = frame.closest_hit(origin, direction, f64::INFINITY);
                prop_assert_eq!(public.map(|hit| hit.t), brute.map(|(t, _)| t));
                prop_assert_eq!(frame.any_hit(origin, direction, f64::INFINITY), brute.is_some());
            }
        }
    }
}

/// Boxes that all overlap: the stack holds far more children than usual.
#[test]
fn traversals_that_enter_all_boxes_find_all_hits() {
    let corner = |i: u32, turn: f64| {
        let angle = f64::from(i) * 0.37 + turn * std::f64::consts::TAU / 3.0;
        DVec3::new(angle.cos(), angle.sin(), f64::from(i * 997 % 6000) * 1e-5 - 2.0)
    };
    let count = 6000;
    let positions = (0..count).flat_map(|i| [0.0, 1.0, 2.0].map(|turn| corner(i, turn))).collect();
    let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let frame = frame_of(&mesh_of(positions, triangles), DVec3::ZERO, |_| {});
    for (x, y) in [(0.0, 0.0), (0.1, -0.2), (-0.3, 0.05), (0.2, 0.2)] {
        for direction in [DVec3::new(x, y, -1.0), DVec3::new(x, y, -1e-3)] {
            let ray = Ray { origin: DVec3::ZERO, direction };
            assert_eq!(closest(&frame, &ray, f64::INFINITY), brute_force(&frame, &ray));
        }
    }
}

#[test]
fn hits_are_named_by_their_place_in_the_scene() {
    let eye = DVec3::new(3.0, 4.0, 50.0);
    let frame = frame_of(&ball(6, 6, |p| p), eye, |scene| {
        let place = |x: f64| DVec3::new(x, 0.0, 0.0);
        scene.models.push(Model { translate: place(10.0), ..scene.models[0].clone() });
        scene.spheres = vec![Sphere {
            center: place(20.0),
            radius: 2.0,
            material: 0,
            inside_out: false,
            uv_rotate: DVec3::ZERO,
        }];
        let corners = [DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, -1.0, 0.0), DVec3::new(0.0, 1.0, 0.0)];
        let triangle = |x: f64| Triangle { vertices: corners.map(|p| p + place(x)), uvs: None, material: 0 };
        scene.triangles = vec![triangle(30.0), triangle(40.0)];
        scene.planes = vec![Plane { point: DVec3::NEG_Z * 7.0, normal: DVec3::Z, material: 0, size: 1.0 }];
    });
    let at = |x: f64| frame.closest_hit(DVec3::new(x, 0.01, 9.0), DVec3::NEG_Z * 0.5, f64::INFINITY).unwrap();
    assert!(matches!(at(10.0).primitive, Primitive::Model { model: 1, .. }));
    assert!((at(20.0).t - 14.0).abs() < 1e-4 && at(20.0).primitive == Primitive::Sphere(0));
    assert_eq!(at(40.0), RayHit { t: 18.0, primitive: Primitive::Triangle(1) });
    assert_eq!(at(60.0), RayHit { t: 32.0, primitive: Primitive::Plane(0) });
    let origin = DVec3::new(60.0, 0.0, 9.0);
    assert!(frame.any_hit(origin, DVec3::NEG_Z, 16.1) && !frame.any_hit(origin, DVec3::NEG_Z, 16.0));
}

#[test]
fn invalid_rays_hit_nothing() {
    let frame = frame_of(&ball(6, 6, |p| p), DVec3::ZERO, |_| {});
    for broken in
        [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY, DVec3::X * 1e-200, DVec3::new(1.0, f64::NAN, 0.0)]
    {
        assert!(frame.closest_hit(DVec3::ZERO, broken, f64::INFINITY).is_none(), "{broken}");
    }
    assert!(!frame.any_hit(DVec3::NAN, DVec3::X, f64::INFINITY));
    assert!(!frame.any_hit(DVec3::ZERO, DVec3::X, f64::NAN));
}

/// All triangles in turn, by the same test of one ray against one triangle but without trees.
fn all_hits(frame: &PreparedFrame, ray: &Ray) -> Vec<(f64, PrimitiveId)> {
    let mut hits = Vec::new();
    for (item, instance) in frame.instances.iter().enumerate() {
        let local = instance.to_mesh(ray);
        let exact = ShearedRay::new(local.origin, local.direction);
        for triangle in instance.mesh.triangles() {
            if let Some(t) = exact.intersect(&instance.mesh.corners(triangle).map(Vec3::as_dvec3)) {
                hits.push((t, PrimitiveId { item: item as u32, triangle }));
            }
        }
    }
    hits
}

fn brute_force(frame: &PreparedFrame, ray: &Ray) -> Option<(f64, PrimitiveId)> {
    let hits = all_hits(frame, ray);
    for &(t, primitive) in &hits {
        assert_eq!(frame.t_of(ray, primitive, None), Some(t));
    }
    frame.preferred_of(ray, hits.iter().map(|&(_, primitive)| primitive), f64::INFINITY, None)
}

fn brute_count(frame: &PreparedFrame, ray: &Ray, t_max: f64) -> usize {
    all_hits(frame, ray).iter().filter(|(t, _)| *t < t_max).count()
}

/// Rays that start on the planes of boxes, inside them, and on surfaces, along the axes and their diagonals: slab tests with
/// zero times infinity.
#[test]
fn origins_on_planes_and_surfaces_hit_as_brute_force_does() {
    let n = 6;
    let at = |x: u32, y: u32| y * (n + 1) + x;
    let height = |x: u32, y: u32| f64::from((x * 7 + y * 13) % 3);
    let positions: Vec<DVec3> = (0..=n)
        .flat_map(|y| (0..=n).map(move |x| DVec3::new(f64::from(x), height(x, y), f64::from(y))))
        .collect();
    let triangles = (0..n)
        .flat_map(|y| (0..n).map(move |x| (x, y)))
        .flat_map(|(x, y)| {
            [[at(x, y), at(x + 1, y), at(x + 1, y + 1)], [at(x, y), at(x + 1, y + 1), at(x, y + 1)]]
        })
        .collect();
    let frame = frame_of(&mesh_of(positions.clone(), triangles), DVec3::ZERO, |scene| {
        scene.models.push(Model { translate: DVec3::new(3.0, 1.0, 0.0), ..scene.models[0].clone() });
    });
    let step = |i: u32| f64::from(i % 3) - 1.0;
    let directions: Vec<DVec3> = (0..27)
        .map(|i| DVec3::new(step(i), step(i / 3), step(i / 9)))
        .filter(|&direction| direction != DVec3::ZERO)
        .collect();
    let mut hits = 0;
    for origin in positions.iter().flat_map(|&p| [p, p + DVec3::Y, p + DVec3::new(0.5, 0.0, 0.5)]) {
        for &direction in &directions {
            let ray = Ray { origin: origin * frame.per_unit, direction: direction * frame.per_unit };
            let found = closest(&frame, &ray, f64::INFINITY);
            assert_eq!(found, brute_force(&frame, &ray), "from {origin} along {direction}");
            hits += usize::from(found.is_some());
        }
    }
    assert!(hits > 300, "{hits} hits say little");
}
