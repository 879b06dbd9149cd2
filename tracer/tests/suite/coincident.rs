//! Coplanar surfaces: one of them is visible as a whole, in one even colour, on every path.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::common::{empty, light, render};
use glam::{DMat3, DVec3, Vec3};
use rayfarm_tracer::image::RgbImage;
use rayfarm_tracer::mesh::{CompiledMesh, Mesh, NamedMaterial};
use rayfarm_tracer::reference::Oracle;
use rayfarm_tracer::scene::{
    Attenuation, Background, Camera, CameraKind, FrameView, LightKind, Material, Model, NormalMode, Plane,
    Scene, Triangle,
};
use rayfarm_tracer::{CompiledScene, PreparedFrame, Primitive, render_rows};

const SIDE: u32 = 96;

/// Materials of the tests: red outside, grey inside.
const OUTSIDE: u32 = 0;
const INSIDE: u32 = 1;

/// A quad with its corners in order, as two triangles that share the diagonal from corner `first`.
fn fan(corners: [DVec3; 4], first: usize) -> [[DVec3; 3]; 2] {
    let at = |i: usize| corners[(first + i) % 4];
    [[at(0), at(1), at(2)], [at(0), at(2), at(3)]]
}

/// The other side of a quad.
fn turned([a, b, c, d]: [DVec3; 4]) -> [DVec3; 4] {
    [d, c, b, a]
}

/// A wall of z = 0 that faces +z.
fn wall() -> [DVec3; 4] {
    [(-2.0, -1.25), (2.0, -1.25), (2.0, 1.25), (-2.0, 1.25)].map(|(x, y)| DVec3::new(x, y, 0.0))
}

/// Triangles with a material slot each.
fn mesh_of(triangles: &[([DVec3; 3], u16)]) -> Arc<CompiledMesh> {
    let material = |name: &str| NamedMaterial::plain(name, Material::NEUTRAL);
    let mesh = Mesh {
        positions: triangles.iter().flat_map(|(corners, _)| *corners).collect(),
        triangles: (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        triangle_materials: triangles.iter().map(|&(_, slot)| slot).collect(),
        materials: vec![material("outside"), material("inside")],
        ..Mesh::default()
    };
    Arc::new(CompiledMesh::compile(&mesh).unwrap().0)
}

/// Both sides of a wall, the inside divided by the given diagonal. The placement is applied before rounding to `f32`.
fn two_sided(place: impl Fn(DVec3) -> DVec3, outside_first: bool, diagonal: usize) -> Arc<CompiledMesh> {
    let outside = fan(wall().map(&place), 0).map(|triangle| (triangle, OUTSIDE as u16));
    let inside = fan(turned(wall()).map(&place), diagonal).map(|triangle| (triangle, INSIDE as u16));
    let both = if outside_first { [outside, inside] } else { [inside, outside] };
    mesh_of(both.as_flattened())
}

fn model(mesh: &CompiledMesh) -> Model {
    Model {
        mesh: mesh.id(),
        materials: vec![OUTSIDE, INSIDE],
        normals: NormalMode::Flat,
        translate: DVec3::ZERO,
        rotate: DVec3::ZERO,
        scale: DVec3::ONE,
        group: DMat3::IDENTITY,
    }
}

/// A scene with a black background and ambient light only.
fn dark_scene(eye: DVec3, look_at: DVec3) -> Scene {
    let mut scene = empty(SIDE, SIDE * 3 / 4);
    scene.background = Background::Color(Vec3::ZERO);
    scene.camera =
        Camera { position: eye, look_at, up: DVec3::Y, fov: 55.0, zoom: 1.0, kind: CameraKind::PINHOLE };
    scene.ambient = Vec3::splat(0.5);
    let flat = |diffuse| Material { diffuse, specular: Vec3::ZERO, exponent: 1.0, ..Material::NEUTRAL };
    scene.materials = vec![flat(Vec3::new(0.75, 0.15, 0.1)), flat(Vec3::splat(0.8))];
    scene
}

/// Number of pixels of each colour.
fn colours(image: &RgbImage) -> BTreeMap<[u8; 3], usize> {
    let mut counts = BTreeMap::new();
    for pixel in image.pixels.chunks_exact(3) {
        *counts.entry([pixel[0], pixel[1], pixel[2]]).or_default() += 1;
    }
    counts.remove(&[0, 0, 0]);
    counts
}

/// Renders a scene and compares each pixel with the oracle and with a single ray. Returns the colours.
fn seen(scene: &Scene, meshes: &[Arc<CompiledMesh>]) -> BTreeMap<[u8; 3], usize> {
    let view = FrameView::of(scene);
    let (image, _) = render(scene, meshes, &view);
    let oracle = Oracle::new(scene, meshes, &[], &view);
    let expected = oracle.render();
    let frame = PreparedFrame::new(
        Arc::new(CompiledScene::new(scene.clone(), meshes.iter().cloned(), []).unwrap()),
        &view,
    )
    .unwrap();
    let pairs = image.pixels.chunks_exact(3).zip(expected.pixels.chunks_exact(3));
    let off = pairs.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 1)).count();
    assert!(off <= 2, "{off} pixels are not the oracle's");
    // The same bytes in bands of other heights.
    let mut bands = RgbImage::new(view.width, view.height);
    let (mut from, row) = (0, view.width as usize * 3);
    while from < view.height {
        let to = (from + 5).min(view.height);
        let rows = &mut bands.pixels[from as usize * row..to as usize * row];
        render_rows(&frame, from..to, rows, &|| false).unwrap();
        from = to;
    }
    assert!(bands.pixels == image.pixels, "other bands, another picture");
    colours(&image)
}

/// Asserts that the scene has one colour, that of this material, also for every fourth single ray.
fn assert_even(what: &str, scene: &Scene, meshes: &[Arc<CompiledMesh>], material: u32) {
    let found = seen(scene, meshes);
    assert_eq!(found.len(), 1, "{what}: {found:?}");
    let (colour, count) = found.first_key_value().unwrap();
    assert!(*count > 80, "{what}: {count} pixels say little");
    let is_red = colour[0] / 2 > colour[1];
    assert_eq!(is_red, material == OUTSIDE, "{what}: {found:?}");
}

fn turns() -> [DMat3; 4] {
    [
        DMat3::IDENTITY,
        DMat3::from_rotation_y(0.3),
        DMat3::from_rotation_x(0.21) * DMat3::from_rotation_z(1.0),
        DMat3::from_rotation_z(0.7) * DMat3::from_rotation_x(-0.4) * DMat3::from_rotation_y(0.5),
    ]
}

#[test]
fn of_two_sides_of_a_wall_the_front_side_is_visible() {
    for (index, turn) in turns().into_iter().enumerate() {
        for (scale, offset) in [(1.0, 0.0), (1.0, 37.7), (1e-6, 0.0), (3e5, 1e3), (1.0, 1e6)] {
            for case in 0..4 {
                let offset = DVec3::new(1.0, -0.7, 0.3) * offset * scale;
                let place = |p: DVec3| turn * p * scale + offset;
                let mesh = two_sided(place, case % 2 == 0, case / 2);
                for (side, material) in [(1.0, OUTSIDE), (-1.0, INSIDE)] {
                    let eye = place(DVec3::new(0.4, 0.3, 3.1 * side));
                    let mut scene = dark_scene(eye, offset);
                    scene.models = vec![model(&mesh)];
                    let what = format!("turn {index}, scale {scale:e}, offset {offset}, case {case}, {side}");
                    assert_even(&what, &scene, &[Arc::clone(&mesh)], material);
                }
            }
        }
    }
}

#[test]
fn a_wall_seen_at_a_grazing_angle_is_even() {
    for turn in turns() {
        for height in [0.3, 0.06, 0.02] {
            let mesh = two_sided(|p| turn * p, false, 1);
            let mut scene = dark_scene(turn * DVec3::new(0.1, -2.0, height), turn * DVec3::ZERO);
            scene.camera.up = turn * DVec3::Z;
            scene.models = vec![model(&mesh)];
            assert_even(&format!("height {height}"), &scene, &[mesh], OUTSIDE);
        }
    }
}

#[test]
fn a_wall_under_light_is_even_and_its_far_side_is_dark() {
    for (index, turn) in turns().into_iter().enumerate() {
        for elevation in [0.7, 0.05, 0.002] {
            let mesh = two_sided(|p| turn * p * 3.0, index % 2 == 0, 1);
            let mut scene = dark_scene(turn * DVec3::new(0.4, 0.3, 8.0), DVec3::ZERO);
            scene.models = vec![model(&mesh)];
            let towards = turn * DVec3::new(0.6, 0.4, elevation);
            scene.lights =
                vec![light(LightKind::Directional { direction: -towards }, 0.9, Attenuation::None)];
            let lit = seen(&scene, &[Arc::clone(&mesh)]);
            assert_eq!(lit.len(), 1, "turn {index}, light at {elevation}: {lit:?}");
            scene.lights[0].shadows = false;
            assert_eq!(seen(&scene, &[Arc::clone(&mesh)]), lit, "no shadow falls on it");
            // It is unlit from behind.
            scene.lights[0].shadows = true;
            scene.camera.position = turn * DVec3::new(0.4, 0.3, -8.0);
            let behind = seen(&scene, &[Arc::clone(&mesh)]);
            scene.lights.clear();
            assert_eq!(behind, seen(&scene, &[mesh]), "turn {index}, light at {elevation}");
        }
    }
}

#[test]
fn of_coplanar_instances_one_is_visible() {
    let one_side =
        |material: u16, corners| mesh_of(&fan(corners, usize::from(material)).map(|t| (t, material)));
    for rotate in [DVec3::ZERO, DVec3::new(20.0, 35.0, 50.0), DVec3::new(-70.0, 12.0, 5.0)] {
        let (outside, inside) = (one_side(0, wall()), one_side(1, turned(wall()).map(|p| p * 1.5)));
        let mut scene = dark_scene(DVec3::ZERO, DVec3::NEG_Z);
        let placed = |mesh: &CompiledMesh, scale: f64| Model {
            rotate,
            translate: DVec3::new(0.1, -0.2, 0.3),
            scale: DVec3::splat(scale),
            ..model(mesh)
        };
        scene.models = vec![placed(&inside, 0.8), placed(&outside, 1.2)];
        let turn = DMat3::from_rotation_z(rotate.z.to_radians())
            * DMat3::from_rotation_y(rotate.y.to_radians())
            * DMat3::from_rotation_x(rotate.x.to_radians());
        for (side, material) in [(1.0, OUTSIDE), (-1.0, INSIDE)] {
            scene.camera.position = scene.models[0].translate + turn * DVec3::new(0.3, 0.2, 4.0 * side);
            scene.camera.look_at = scene.models[0].translate;
            assert_even(
                &format!("{rotate} {side}"),
                &scene,
                &[Arc::clone(&outside), Arc::clone(&inside)],
                material,
            );
        }
        // Of two that face the camera the first one is visible.
        let both = [one_side(0, wall()), one_side(1, wall())];
        for (first, second, material) in [(0, 1, OUTSIDE), (1, 0, INSIDE)] {
            scene.models = vec![placed(&both[first], 1.0), placed(&both[second], 1.0)];
            scene.camera.position = scene.models[0].translate + turn * DVec3::new(0.3, 0.2, 4.0);
            assert_even(&format!("{rotate}, {first} first"), &scene, &both, material);
        }
    }
}

#[test]
fn triangles_of_the_scene_follow_the_same_rule() {
    for (turn, offset) in turns().into_iter().flat_map(|turn| [(turn, 0.0), (turn, 1e5)]) {
        let place = |p: DVec3| turn * p + DVec3::new(0.3, 1.0, -0.6) * offset;
        let triangle = |material| move |vertices: [DVec3; 3]| Triangle { vertices, uvs: None, material };
        let outside = fan(wall().map(place), 0).map(triangle(OUTSIDE));
        let inside = fan(turned(wall()).map(place), 0).map(triangle(INSIDE));
        for triangles in [[outside, inside], [inside, outside]] {
            for (side, material) in [(1.0, OUTSIDE), (-1.0, INSIDE)] {
                let mut scene = dark_scene(place(DVec3::new(0.2, 0.4, 3.5 * side)), place(DVec3::ZERO));
                scene.triangles = triangles.as_flattened().to_vec();
                assert_even(&format!("offset {offset}, side {side}"), &scene, &[], material);
            }
        }
    }
}

/// For both windings, and for triangles of scenes and meshes.
#[test]
fn items_on_a_plane_are_visible() {
    for (index, turn) in turns().into_iter().enumerate() {
        for side in [1.0, -1.0] {
            let mut scene = dark_scene(turn * DVec3::new(0.2, 0.4, 3.5 * side), DVec3::ZERO);
            scene.planes = vec![Plane {
                point: turn * DVec3::new(5.0, -3.0, 0.0),
                normal: turn * DVec3::Z,
                material: INSIDE,
                size: 1.0,
            }];
            let bare = seen(&scene, &[]);
            let [lower, _] = fan(wall(), 0);
            for corners in [lower, [lower[0], lower[2], lower[1]]] {
                let corners = corners.map(|p| turn * p);
                let red = |found: &BTreeMap<[u8; 3], usize>| {
                    assert_eq!(found.len(), 2, "turn {index}: {found:?}");
                    *found.iter().find(|(colour, _)| colour[0] / 2 > colour[1]).unwrap().1
                };
                let mut with_triangle = scene.clone();
                with_triangle.triangles = vec![Triangle { vertices: corners, uvs: None, material: OUTSIDE }];
                let on_plane = red(&seen(&with_triangle, &[]));
                let mesh = mesh_of(&[(corners, OUTSIDE as u16)]);
                let mut with_model = scene.clone();
                with_model.models = vec![model(&mesh)];
                let as_model = red(&seen(&with_model, &[mesh]));
                // The same number of pixels as without the plane, except at the edges.
                with_triangle.planes.clear();
                let alone: usize = seen(&with_triangle, &[]).values().sum();
                assert!(
                    alone > 500 && alone.abs_diff(on_plane) <= 2 && alone.abs_diff(as_model) <= 2,
                    "turn {index}, side {side}: {alone} pixels alone, {on_plane} and {as_model} on the plane"
                );
            }
            assert_eq!(bare.len(), 1, "{bare:?}");
        }
    }
}

/// Single rays hit what the picture shows, also from outside of the camera.
#[test]
fn single_rays_hit_the_same_surface_everywhere() {
    for turn in turns() {
        let mesh = two_sided(|p| turn * p, false, 1);
        let mut scene = dark_scene(DVec3::new(9.0, 8.0, 7.0), DVec3::ZERO);
        scene.models = vec![model(&mesh)];
        let compiled = CompiledScene::new(scene.clone(), [Arc::clone(&mesh)], []).unwrap();
        let frame = PreparedFrame::new(Arc::new(compiled), &FrameView::of(&scene)).unwrap();
        for i in 0..40 * 25 {
            let target = DVec3::new(f64::from(i % 40) * 0.097 - 1.9, f64::from(i / 40) * 0.097 - 1.2, 0.0);
            for (side, slot) in [(1.0, 0), (-1.0, 1)] {
                let origin = turn * DVec3::new(0.7, -0.1, side);
                let hit = frame.closest_hit(origin, turn * target - origin, f64::INFINITY).unwrap();
                let Primitive::Model { triangle, .. } = hit.primitive else { unreachable!() };
                assert_eq!(mesh.slot(triangle), slot, "at {target} from {side}");
            }
        }
    }
}

/// The rule does not reach beyond rounding: a surface that is a thousandth nearer is visible.
#[test]
fn separate_surfaces_are_not_coincident() {
    let mesh = two_sided(|p| p, true, 1);
    let mut scene = dark_scene(DVec3::new(0.4, 0.3, 3.0), DVec3::ZERO);
    for (nearer, material) in [(1e-5, INSIDE), (-1e-5, OUTSIDE)] {
        let inside = mesh_of(&fan(turned(wall()), 1).map(|triangle| (triangle, INSIDE as u16)));
        scene.models = vec![model(&mesh), Model { translate: DVec3::Z * nearer, ..model(&inside) }];
        assert_even(&format!("{nearer} nearer"), &scene, &[Arc::clone(&mesh), inside], material);
    }
}
