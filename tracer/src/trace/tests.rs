//! Watertightness, ties and shadows, ray by ray.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use proptest::prelude::*;

use super::*;
use crate::compile::CompiledScene;
use crate::mesh::{CompiledMesh, Mesh, NamedMaterial};
use crate::scene::{
    Background, Camera, FrameView, Material, Model, NormalMode, RenderSettings, Scene, Triangle,
};

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
    };
    let look_at = eye + DVec3::NEG_Z;
    let mut scene = Scene {
        ambient: Vec3::ZERO,
        render: RenderSettings::default(),
        camera: Camera { position: eye, look_at, up: DVec3::Y, fov: 40.0, zoom: 1.0 },
        background: Background::Color(Vec3::ZERO),
        lights: vec![],
        materials: vec![Material::NEUTRAL],
        models: vec![model],
        spheres: vec![],
        planes: vec![],
        triangles: vec![],
    };
    change(&mut scene);
    let view = FrameView::of(&scene);
    PreparedFrame::new(Arc::new(CompiledScene::new(scene, [Arc::new(compiled)]).unwrap()), &view).unwrap()
}

fn mesh_of(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Mesh {
    let slots = vec![0; triangles.len()];
    let material = NamedMaterial { name: "m".into(), material: Material::NEUTRAL };
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
    let aim = |target: DVec3| frame.closest(&Ray { origin: DVec3::ZERO, direction: target - eye }).is_none();
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
fn no_ray_from_inside_slips_through_an_edge_or_a_vertex() {
    for eye in [DVec3::ZERO, DVec3::new(0.3, -0.2, 0.11), DVec3::new(0.0, 0.7, 0.0)] {
        assert_eq!(leaks(&ball(24, 37, |p| p), eye), 0, "from {eye}");
    }
}

#[test]
fn no_ray_from_inside_slips_through_at_any_scale_or_place() {
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
        assert!(frame.closest(&Ray { origin: DVec3::ZERO, direction }).is_some(), "{direction}");
        assert!(frame.closest(&Ray { origin: DVec3::ZERO, direction: direction * 1e-30 }).is_some());
    }
}

#[test]
fn of_equal_distances_the_lowest_source_index_is_seen() {
    // Two coplanar triangles that overlap, wound so that cleaning keeps both; then the same in the other order.
    let quad = [DVec3::new(-1.0, -1.0, -2.0), DVec3::new(1.0, -1.0, -2.0), DVec3::new(0.0, 1.0, -2.0)];
    let larger = quad.map(|p| DVec3::new(p.x * 2.0, p.y * 2.0, p.z));
    for order in [[quad, larger], [larger, quad]] {
        let positions = order.iter().flatten().copied().collect();
        let frame = frame_of(&mesh_of(positions, vec![[0, 1, 2], [3, 4, 5]]), DVec3::ZERO, |_| {});
        let hit = frame.closest(&Ray { origin: DVec3::ZERO, direction: DVec3::NEG_Z }).unwrap();
        assert_eq!(frame.instances[0].mesh.source(hit.primitive.triangle), 0);
        assert_eq!(hit.t * f64::from(2_u32), hit.t + hit.t);
    }
}

#[test]
fn of_equal_distances_the_first_item_is_seen() {
    let corners = [DVec3::new(-1.0, -1.0, -2.0), DVec3::new(1.0, -1.0, -2.0), DVec3::new(0.0, 1.0, -2.0)];
    let frame = frame_of(&ball(6, 6, |p| p + DVec3::Z * 50.0), DVec3::ZERO, |scene| {
        scene.triangles = vec![Triangle { vertices: corners, material: 0 }; 5];
    });
    let hit = frame.closest(&Ray { origin: DVec3::ZERO, direction: DVec3::NEG_Z }).unwrap();
    assert_eq!(hit.primitive.item, 1, "item 0 is the model, 1 the first triangle");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Random soups, instanced and turned, against every triangle in turn.
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
            let found = frame.closest(&ray);
            prop_assert_eq!(found.map(|hit| hit.primitive), brute.map(|(_, primitive)| primitive));
            if let (Some(hit), Some((t, primitive))) = (found, brute) {
                prop_assert!((hit.t - t).abs() <= 1e-12 * t);
                let elsewhere = PrimitiveId { item: u32::MAX, triangle: 0 };
                prop_assert!(frame.occluded(&ray, t * 1.001, elsewhere));
                prop_assert!(!frame.occluded(&ray, t * 0.999, elsewhere));
                prop_assert!(!frame.occluded(&ray, t * 1.000001, primitive) || brute_count(&frame, &ray, t * 1.00001) > 1);
            }
        }
    }
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
    all_hits(frame, ray).into_iter().min_by(|a, b| a.0.total_cmp(&b.0))
}

fn brute_count(frame: &PreparedFrame, ray: &Ray, t_max: f64) -> usize {
    all_hits(frame, ray).iter().filter(|(t, _)| *t < t_max).count()
}
