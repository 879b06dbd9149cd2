//! The share of light that arrives at a point.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};

use super::super::Oracle;
use super::{BLACK, assert_near, empty, looking, marker, plane, point_light, seen, sphere};
use crate::mesh::{CompiledMesh, Mesh, NamedMaterial};
use crate::scene::{FrameView, Light, Material, Model, NormalMode, Scene, Triangle};

const WHITE: Material = Material { diffuse: Vec3::ONE, ..BLACK };

/// A white floor at y = 0 under a light.
fn floor(light: Light) -> Scene {
    let mut scene = empty();
    scene.materials = vec![WHITE, BLACK];
    scene.planes = vec![plane(DVec3::ZERO, DVec3::Y, 0)];
    scene.lights = vec![light];
    scene
}

/// The colour of a point of the floor, seen from the side, below everything that is higher than 1/2.
fn at(scene: &Scene, x: f64) -> DVec3 {
    seen(scene, DVec3::new(x, 0.5, 0.5), DVec3::new(0.0, -0.5, -0.5))
}

/// Share of S_j: the colour relative to that without anything between.
fn share_at(scene: &Scene, x: f64) -> DVec3 {
    let free = Scene { triangles: vec![], spheres: vec![], ..scene.clone() };
    let free = Scene { planes: vec![scene.planes[0]], ..free };
    at(scene, x) / at(&free, x)
}

/// A half plane at y = `height`, for x < 0.
fn half_plane(height: f64) -> Vec<Triangle> {
    let corner = |x: f64, z: f64| DVec3::new(x, height, z);
    let vertices = [corner(0.0, -1e3), corner(0.0, 1e3), corner(-1e3, 0.0)];
    vec![Triangle { vertices, uvs: None, material: 1 }]
}

/// Over a straight edge, the light at height H is visible from x where its own x is above -x (H - e) / e: the penumbra is
/// 2 r e / (H - e) wide, and in it the share is that of a disc cut by a chord.
#[test]
fn the_penumbra_is_that_of_a_disc_cut_by_an_edge() {
    let (height, edge, radius) = (10.0, 1.0, 0.5);
    let mut scene = floor(Light { radius, ..point_light(DVec3::Y * height) });
    scene.triangles = half_plane(edge);
    let half_width = radius * edge / (height - edge);
    for i in -12..=12 {
        let u = f64::from(i) / 10.0;
        let share = match u {
            ..=-1.0 => 0.0,
            1.0.. => 1.0,
            u => 0.5 + (u * (1.0 - u * u).sqrt() + libm::asin(u)) / PI,
        };
        let found = share_at(&scene, u * half_width);
        assert_near(found, DVec3::splat(share), 0.02, &format!("{u} of the half width"));
    }
    // Without an extent the edge is hard.
    scene.lights[0].radius = 0.0;
    assert_near(share_at(&scene, -1e-6), DVec3::ZERO, 0.0, "in the shadow");
    assert_near(share_at(&scene, 1e-6), DVec3::ONE, 0.0, "in the light");
}

/// A sphere that covers the light's disc in the middle leaves the ring around it.
#[test]
fn the_share_is_that_of_areas_on_the_disc() {
    let mut scene = floor(Light { radius: 2.0, ..point_light(DVec3::Y * 1000.0) });
    scene.materials.push(WHITE);
    // Half the distance, half the size: its disc seen from the origin has the radius 1.
    scene.spheres = vec![sphere(DVec3::Y * 500.0, 0.5, 2)];
    assert_near(share_at(&scene, 0.0), DVec3::splat(0.75), 0.005, "a quarter is covered");
}

/// Of four sets of points, that with the index k has k points in the light: each sample of a pattern of 2 x 2 has its own.
#[test]
fn given_points_replace_the_disc() {
    let mut scene = floor(Light { radius: 0.5, ..point_light(DVec3::Y * 10.0) });
    scene.triangles = half_plane(1.0);
    let (lit, dark) = (DVec3::X * 0.9, DVec3::NEG_X * 0.9);
    let set = |k: usize| (0..4).map(|i| if i < k { lit } else { dark }).collect::<Vec<_>>();
    let sets = (0..4).map(set).collect();
    let from = DVec3::new(0.0, 0.5, 0.5);
    let view = looking(&scene, from, -from);
    let view = FrameView { width: 4, height: 4, ..view };
    let view = FrameView { camera: crate::scene::Camera { fov: 1e-3, ..view.camera }, ..view };
    let with = Oracle::new(&scene, &[], &[], &view).with_light_points(vec![sets]);
    scene.triangles.clear();
    let free = Oracle::new(&scene, &[], &[], &view);
    for (x, y) in (0..4).flat_map(|y| (0..4).map(move |x| (x, y))) {
        let expected = f64::from(x % 2 + 2 * (y % 2)) / 4.0;
        let share = with.pixel(x, y) / free.pixel(x, y);
        assert_near(share, DVec3::splat(expected), 1e-12, &format!("pixel ({x}, {y})"));
    }
}

#[test]
fn transparent_occluders_color_shadows_surface_by_surface() {
    let color = Vec3::new(0.5, 0.25, 1.0);
    let glass = Material { transmit: color, reflect: Vec3::ONE, fresnel: true, ..BLACK };
    let mut scene = floor(point_light(DVec3::Y * 10.0));
    let share = |scene: &Scene| share_at(scene, 0.25);
    scene.triangles = half_plane(1.0);
    scene.triangles[0].vertices = scene.triangles[0].vertices.map(|v| v + DVec3::X);
    assert_near(share(&scene), DVec3::ZERO, 0.0, "opaque");
    scene.materials[1] = glass;
    assert_near(share(&scene), color.as_dvec3(), 1e-12, "a sheet");
    scene.spheres = vec![sphere(DVec3::new(0.2, 4.0, 0.0), 0.7, 1)];
    let cube = |c: DVec3| c * c * c;
    assert_near(share(&scene), cube(color.as_dvec3()), 1e-12, "a sheet and both sides of a ball");
    scene.materials[1] = Material { casts_shadow: false, ..BLACK };
    assert_near(share(&scene), DVec3::ONE, 1e-12, "without a shadow");
    scene.materials.push(marker(Vec3::ZERO));
    scene.planes.push(plane(DVec3::Y * 6.0, DVec3::Y, 2));
    assert_near(share(&scene), DVec3::ZERO, 0.0, "an opaque plane behind");
    scene.planes[1].point = DVec3::Y * 10.5;
    assert_near(share(&scene), DVec3::ONE, 1e-12, "a plane beyond the light");
}

/// The triangles of a part of the unit sphere, each side of the part divided into 2^`depth`.
fn divided([a, b, c]: [DVec3; 3], depth: u32) -> Vec<[DVec3; 3]> {
    if depth == 0 {
        return vec![[a, b, c]];
    }
    let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(from, to)| (from + to).normalize());
    let parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
    parts.into_iter().flat_map(|part| divided(part, depth - 1)).collect()
}

/// 512 triangles with the normals of a sphere.
fn ball() -> Mesh {
    let octants = (0..8).flat_map(|octant: i32| {
        let sign = |axis: i32| if octant >> axis & 1 == 1 { -1.0 } else { 1.0 };
        let [x, y, z] = [DVec3::X * sign(0), DVec3::Y * sign(1), DVec3::Z * sign(2)];
        // Counter-clockwise, seen from outside.
        let corners = if sign(0) * sign(1) * sign(2) > 0.0 { [x, y, z] } else { [y, x, z] };
        divided(corners, 3)
    });
    let positions: Vec<DVec3> = octants.flatten().collect();
    let count = positions.len() as u32 / 3;
    Mesh {
        normals: positions.iter().map(|position| position.as_vec3()).collect(),
        positions,
        triangles: (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        triangle_materials: vec![0; count as usize],
        materials: vec![NamedMaterial::plain("m", Material::NEUTRAL)],
        ..Mesh::default()
    }
}

/// Nothing shades a convex body but itself, and N.L does that: a picture without shadows is the right one.
#[test]
fn smooth_convex_meshes_cast_no_shadow_on_their_lit_side() {
    let mesh = Arc::new(CompiledMesh::compile(&ball()).unwrap().0);
    let mut scene = empty();
    scene.materials = vec![WHITE];
    scene.lights = vec![point_light(DVec3::new(8.0, 3.0, 2.0))];
    scene.models = vec![Model {
        mesh: mesh.id(),
        materials: vec![0],
        normals: NormalMode::Smooth,
        translate: DVec3::ZERO,
        rotate: DVec3::new(10.0, 20.0, 30.0),
        scale: DVec3::new(1.0, 1.2, 0.9),
        group: DMat3::IDENTITY,
    }];
    let view = FrameView { width: 24, height: 24, ..looking(&scene, DVec3::Z * 5.0, DVec3::NEG_Z) };
    let pictures = [(true, true), (true, false), (false, true)].map(|(shadows, smooth_terminator)| {
        let quality = crate::scene::Quality { shadows, smooth_terminator, ..view.quality };
        Oracle::new(&scene, &[Arc::clone(&mesh)], &[], &FrameView { quality, ..view }).render().pixels
    });
    assert!(pictures[0] == pictures[2], "as without shadows");
    assert!(pictures[1] != pictures[2], "the remedy is needed");
}
