//! Extreme inputs that no other file covers: exact distances to spheres, degenerate meshes, the largest frame,
//! attenuated lights at all scales, models far from their origin.

use std::fmt::Write;
use std::sync::Arc;

use crate::common::{analytic, empty, light, point, render, torus};
use glam::{DMat3, DVec3, Vec3};
use rayfarm_tracer::mesh::{CompiledMesh, Mesh};
use rayfarm_tracer::reference::Oracle;
use rayfarm_tracer::scene::{
    Attenuation, FrameView, LightKind, Model, NormalMode, Plane, Scene, Sphere, load,
};
use rayfarm_tracer::{CompiledScene, PreparedFrame, render_rows};

/// A number as the sum of two, with some 32 digits (Dekker, "A floating-point technique for extending the available
/// precision", Numerische Mathematik 18, 1971).
#[derive(Clone, Copy, Debug)]
struct Twofold(f64, f64);

impl Twofold {
    fn sum(a: f64, b: f64) -> Self {
        let sum = a + b;
        let of_b = sum - a;
        Self(sum, (a - (sum - of_b)) + (b - of_b))
    }

    fn add(self, other: Self) -> Self {
        let high = Self::sum(self.0, other.0);
        Self::sum(high.0, high.1 + self.1 + other.1)
    }

    fn minus(self, other: Self) -> Self {
        self.add(Self(-other.0, -other.1))
    }

    fn times(self, other: Self) -> Self {
        let product = self.0 * other.0;
        let rest = libm::fma(self.0, other.0, -product);
        Self::sum(product, rest + self.0 * other.1 + self.1 * other.0)
    }

    fn over(self, other: Self) -> Self {
        let quotient = Self(self.0 / other.0, 0.0);
        let rest = self.minus(quotient.times(other));
        quotient.add(Self(rest.0 / other.0, 0.0))
    }

    fn sqrt(self) -> Self {
        let root = Self(libm::sqrt(self.0), 0.0);
        let rest = self.minus(root.times(root));
        root.add(Self(rest.0 / (2.0 * root.0), 0.0))
    }
}

fn dot(a: DVec3, b: DVec3) -> Twofold {
    let product = |i: usize| Twofold(a[i], 0.0).times(Twofold(b[i], 0.0));
    product(0).add(product(1)).add(product(2))
}

/// Distance at which a ray from the origin first hits a sphere: the textbook's formula with enough digits.
fn exact_distance(center: DVec3, radius: f64, direction: DVec3) -> f64 {
    let radius = Twofold(radius, 0.0);
    let (a, b, c) =
        (dot(direction, direction), dot(center, direction), dot(center, center).minus(radius.times(radius)));
    let root = b.times(b).minus(a.times(c)).sqrt();
    let near = c.over(b.add(root));
    if c.0 > 0.0 { near.0 } else { b.add(root).over(a).0 }
}

/// Largest relative error of `closest_hit` for one sphere and rays from the origin, compared with the exact distance.
fn worst_error(center: DVec3, radius: f64, directions: impl IntoIterator<Item = DVec3>) -> f64 {
    let mut scene = empty(8, 8);
    scene.camera.position = DVec3::ZERO;
    scene.camera.look_at = DVec3::NEG_Z;
    scene.spheres = vec![Sphere { center, radius, material: 0, inside_out: false, uv_rotate: DVec3::ZERO }];
    let view = FrameView::of(&scene);
    let frame = PreparedFrame::new(Arc::new(CompiledScene::new(scene, [], []).unwrap()), &view).unwrap();
    let error = |direction: DVec3| {
        let hit = frame.closest_hit(DVec3::ZERO, direction, f64::INFINITY);
        let exact = exact_distance(center, radius, direction);
        assert_eq!(hit.is_some(), exact > 0.0, "{center} {radius} {direction}: {hit:?}, {exact}");
        hit.map_or(0.0, |hit| ((hit.t - exact) / exact).abs())
    };
    directions.into_iter().map(error).fold(0.0, f64::max)
}

/// One unit in the last place of the `f32` coordinates of points.
const ULP: f64 = f32::EPSILON as f64;

#[test]
fn the_reference_for_spheres_matches_known_distances() {
    // A chord of 3, 4 and 5; and a hit at 1 of a sphere whose squares have 24 digits.
    assert_eq!(exact_distance(DVec3::new(0.0, 3.0, -5.0), 5.0, DVec3::NEG_Z), 1.0);
    assert_eq!(exact_distance(DVec3::new(0.0, -1e12, 0.0), 1e12 - 1.0, DVec3::NEG_Y), 1.0);
    assert_eq!(exact_distance(DVec3::ZERO, 2.0, DVec3::X), 2.0);
}

#[test]
fn distances_to_a_ground_of_a_million_are_within_an_ulp_from_the_feet_to_the_horizon() {
    let (radius, height) = (1e6, 1.5);
    let ground = DVec3::new(0.0, -radius - height, 0.0);
    // From straight down to within 10^-9 of grazing.
    let horizon = libm::acos(radius / (radius + height));
    let down = |share: f64| {
        let (s, c) = libm::sincos(horizon + (std::f64::consts::FRAC_PI_2 - horizon) * share);
        [DVec3::new(0.6 * c, -s, 0.8 * c), DVec3::new(0.0, -s, -c) * 3.0]
    };
    let far = worst_error(ground, radius, (0..100).flat_map(|i| down(1.0 - f64::from(i) / 100.0)));
    assert!(far <= ULP, "{far:e}, {} ulp", far / ULP);
    let grazing = worst_error(ground, radius, (2..9).flat_map(|i| down(libm::pow(10.0, -f64::from(i)))));
    assert!(grazing <= ULP, "grazing: {grazing:e}, {} ulp", grazing / ULP);
}

#[test]
fn distances_to_a_speck_of_a_millionth_are_within_an_ulp_to_its_outline() {
    for distance in [1e-3, 1.0, 1e3] {
        let (radius, center) = (1e-6, DVec3::new(0.6, 0.0, -0.8) * distance);
        let side = DVec3::new(0.8, 0.0, 0.6) * radius;
        let beside = |i: i32| center + side * (1.0 - libm::exp2(-f64::from(i)));
        let error = worst_error(center, radius, (0..20).map(beside));
        assert!(error <= ULP, "from {distance}: {error:e}, {} ulp", error / ULP);
    }
}

/// A torus with slivers, triangles without an area, duplicates, a triangle over another, and unused vertices.
fn degenerate() -> Mesh {
    let mut mesh = torus(16, 12);
    let mut add = |corners: [DVec3; 3]| {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.triangles.push([first, first + 1, first + 2]);
    };
    for i in 0..40 {
        let (x, width) = (f64::from(i) * 0.04 - 0.8, libm::exp2(-f64::from(i)));
        let (top, bottom) = (DVec3::new(x, 0.9, 0.2), DVec3::new(x, -0.9, 0.2));
        add([bottom, bottom + DVec3::X * width * 0.1, top]);
        add([bottom, top, top]);
        add([bottom, bottom.lerp(top, 0.3), top]);
    }
    let duplicates = mesh.triangles[..30].to_vec();
    mesh.triangles.extend(duplicates);
    mesh.positions.extend([DVec3::splat(1e5), DVec3::NAN, DVec3::INFINITY]);
    mesh.triangle_materials = vec![0; mesh.triangles.len()];
    mesh
}

fn with_model(mesh: &CompiledMesh, width: u32, height: u32) -> Scene {
    let mut scene = empty(width, height);
    scene.lights = vec![light(point(2.0, 4.0, 3.0), 0.9, Attenuation::None)];
    scene.models = vec![Model {
        mesh: mesh.id(),
        materials: vec![0; mesh.material_count()],
        normals: NormalMode::Smooth,
        translate: DVec3::ZERO,
        rotate: DVec3::new(40.0, 10.0, 0.0),
        scale: DVec3::ONE,
        group: DMat3::IDENTITY,
    }];
    scene
}

#[test]
fn slivers_duplicates_and_unused_vertices_match_the_oracle() {
    let (mesh, report) = CompiledMesh::compile(&degenerate()).unwrap();
    assert_eq!((report.dropped_duplicate, report.dropped_not_finite), (30, 0));
    // Slivers thinner than the digits of the mesh are dropped as well.
    assert!((80..110).contains(&report.dropped_degenerate), "{report:?}");
    let (lo, hi) = mesh.bounds();
    assert!(hi.max_element() < 2.0 && lo.min_element() > -2.0, "an unused vertex counts: {lo} {hi}");
    let mesh = Arc::new(mesh);
    let scene = with_model(&mesh, 160, 120);
    let view = FrameView::of(&scene);
    let (image, _) = render(&scene, std::slice::from_ref(&mesh), &view);
    let expected = Oracle::new(&scene, &[mesh], &[], &view).render();
    let pairs = image.pixels.chunks_exact(3).zip(expected.pixels.chunks_exact(3));
    let off = pairs.filter(|(a, b)| a.iter().zip(b.iter()).any(|(a, b)| a.abs_diff(*b) > 1)).count();
    assert_eq!(off, 0, "pixels");
}

#[test]
fn rows_of_the_largest_frame_match_the_oracle() {
    let scene = analytic(16384, 16384);
    let view = FrameView::of(&scene);
    let oracle = Oracle::new(&scene, &[], &[], &view);
    let frame = PreparedFrame::new(Arc::new(CompiledScene::new(scene, [], []).unwrap()), &view).unwrap();
    let mut row = vec![0; 16384 * 3];
    for y in [0, 8000, 12_345, 16383] {
        render_rows(&frame, y..y + 1, &mut row, &|| false).unwrap();
        let differs = |&x: &u32| {
            let found = &row[x as usize * 3..][..3];
            found.iter().zip(oracle.encoded_pixel(x, y)).any(|(a, b)| a.abs_diff(b) > 1)
        };
        assert_eq!((0..16384).step_by(7).filter(differs).count(), 0, "row {y}");
    }
}

/// Attenuated lights are scaled with the scene by a power of two: the picture must not change.
#[test]
fn attenuated_lights_are_the_same_at_all_scales() {
    let scene = analytic(96, 64);
    let (expected, _) = render(&scene, &[], &FrameView::of(&scene));
    for exponent in [-40, -13, 7, 40] {
        let scaled = scaled(&scene, libm::exp2(f64::from(exponent)));
        let (image, _) = render(&scaled, &[], &FrameView::of(&scaled));
        assert!(image == expected, "2^{exponent}");
    }
}

fn scaled(scene: &Scene, factor: f64) -> Scene {
    let mut scene = scene.clone();
    scene.camera.position *= factor;
    scene.camera.look_at *= factor;
    for light in &mut scene.lights {
        if let LightKind::Point { position } | LightKind::Spot { position, .. } = &mut light.kind {
            *position *= factor;
        }
        match &mut light.attenuation {
            Attenuation::None => {}
            Attenuation::InverseSquare => light.color *= (factor * factor) as f32,
            Attenuation::Polynomial { linear, quadratic, .. } => {
                (*linear, *quadratic) = (*linear / factor, *quadratic / (factor * factor));
            }
        }
    }
    for sphere in &mut scene.spheres {
        (sphere.center, sphere.radius) = (sphere.center * factor, sphere.radius * factor);
    }
    scene.planes.iter_mut().for_each(|plane: &mut Plane| plane.point *= factor);
    scene.triangles.iter_mut().for_each(|triangle| triangle.vertices = triangle.vertices.map(|v| v * factor));
    scene
}

/// The numbers of an OBJ file have more digits than `f32`: a model at ten thousand extents from its origin keeps its
/// shape.
#[test]
fn a_model_far_from_its_origin_keeps_its_shape() {
    let folder = tempfile::tempdir().unwrap();
    let picture_at = |name: &str, offset: f64| {
        let mesh = torus(20, 12);
        let mut text = String::new();
        for p in &mesh.positions {
            writeln!(text, "v {:.7} {:.7} {:.7}", p.x + offset, p.y - offset, p.z + offset).unwrap();
        }
        for [a, b, c] in &mesh.triangles {
            writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
        }
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let loaded = load(&path).unwrap();
        let view = FrameView { width: 120, height: 90, ..FrameView::of(&loaded.scene) };
        render(&loaded.scene, &loaded.meshes, &view).0
    };
    let near = picture_at("near.obj", 0.0);
    assert!(near.pixels.iter().any(|&channel| channel != near.pixels[0]), "it shows nothing");
    for offset in [2e1, 2e4, 2e7] {
        let far = picture_at("far.obj", offset);
        let difference = rayfarm_tracer::image::compare(&near, &far).unwrap();
        assert!(difference.differing_pixels <= 5, "{offset}: {difference:?}");
    }
}

#[test]
fn extreme_exponents_and_lights_stay_finite() {
    let mut scene = analytic(32, 24);
    scene.materials.iter_mut().for_each(|material| (material.exponent, material.specular) = (1e6, Vec3::ONE));
    scene.lights.iter_mut().for_each(|light| light.color = Vec3::splat(1e30));
    let view = FrameView::of(&scene);
    let (image, _) = render(&scene, &[], &view);
    let oracle = Oracle::new(&scene, &[], &[], &view).render();
    let pairs = image.pixels.iter().zip(&oracle.pixels);
    assert_eq!(pairs.filter(|(a, b)| a.abs_diff(**b) > 1).count(), 0);
}
