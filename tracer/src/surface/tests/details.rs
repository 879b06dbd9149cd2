//! Patterns and normal maps.

use glam::DMat3;

use super::*;
use crate::mesh::{Mesh, NamedMaterial};
use crate::scene::{Checker, CheckerSpace, Model, NormalMap, NormalMode};

const COLORS: [Vec3; 2] = [Vec3::X, Vec3::Z];

fn pattern(space: CheckerSpace, size: f32) -> Checker {
    Checker { colors: COLORS, size, space }
}

/// Asserts that the floor shows the cells of a pattern, away from their borders; `cells` are those across y.
fn assert_cells(picture: &[[u8; 3]], camera: &Camera, size: f64, origin: DVec2, layer: f64) {
    let mut tested = 0;
    for ([x, y], point) in points_of_floor(camera) {
        let place = (point - origin) / size;
        if point.abs().max_element() > 8.9 || (place - place.round()).abs().min_element() < 1e-3 {
            continue;
        }
        let odd = (place.floor().element_sum() + layer).rem_euclid(2.0) == 1.0;
        let expected = if odd { [0, 0, 255] } else { [255, 0, 0] };
        assert_eq!(pixel(picture, x, y), expected, "{x}, {y}: {place}");
        tested += 1;
    }
    assert!(tested > 1000, "{tested}");
}

/// The floor is exactly between two layers of cells, and shows those below it.
#[test]
fn a_floor_on_a_border_shows_the_cells_below_it() {
    let mut scene = empty();
    above(&mut scene);
    scene.planes = vec![Plane { point: DVec3::new(0.5, 0.0, 0.25), ..floor() }];
    for (space, origin) in [(CheckerSpace::World, DVec2::ZERO), (CheckerSpace::Object, DVec2::new(0.5, 0.25))]
    {
        scene.materials[0].checker = Some(pattern(space, 0.75));
        let picture = rendered(&scene, &[], &[], Quality::default());
        assert_cells(&picture, &scene.camera, 0.75, origin, -1.0);
    }
    // In the plane of a texture there are no layers; v grows towards -Z.
    scene.materials[0].checker = Some(pattern(CheckerSpace::Uv, 0.75));
    scene.planes[0].point = DVec3::ZERO;
    let picture = rendered(&scene, &[], &[], Quality::default());
    assert_cells(&picture, &scene.camera, 0.75, DVec2::ZERO, 1.0);
}

/// A floor as a model of two triangles, with its own coordinates around (3, 0.3, -7).
fn floor_model() -> Arc<CompiledMesh> {
    let corner = |x: f64, z: f64| DVec3::new(3.0 + x, 0.3, z - 7.0);
    Arc::new(
        CompiledMesh::compile(&Mesh {
            positions: vec![corner(-9.0, 9.0), corner(9.0, 9.0), corner(9.0, -9.0), corner(-9.0, -9.0)],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            triangle_materials: vec![0; 2],
            materials: vec![NamedMaterial::plain("m", Material::NEUTRAL)],
            ..Mesh::default()
        })
        .unwrap()
        .0,
    )
}

#[test]
fn patterns_move_with_a_model_and_not_in_the_world() {
    let mesh = floor_model();
    let mut scene = empty();
    above(&mut scene);
    scene.models = vec![Model {
        mesh: mesh.id(),
        materials: vec![0],
        normals: NormalMode::Flat,
        translate: DVec3::new(-3.0, -0.3, 7.0),
        rotate: DVec3::ZERO,
        scale: DVec3::ONE,
        group: DMat3::IDENTITY,
    }];
    let seen = |scene: &Scene| rendered(scene, &[Arc::clone(&mesh)], &[], Quality::default());
    // The file's y = 0.3 is a border, too: 0.3 = 3 * 0.1.
    scene.materials[0].checker = Some(pattern(CheckerSpace::Object, 0.1));
    let size = f64::from(0.1_f32);
    let layer = (0.3 / size - 1.0 / 1024.0).floor();
    assert_cells(&seen(&scene), &scene.camera, size, DVec2::new(-3.0, 7.0), layer);
    // Moved together with the camera: the same picture of the object, another one of the world.
    let moved = |scene: &Scene, by: DVec3| {
        let mut moved = scene.clone();
        moved.models[0].translate += by;
        moved.camera.position += by;
        moved.camera.look_at += by;
        moved
    };
    let by = DVec3::new(0.5, 0.0, 0.0);
    for (size, space, same) in [(1.0, CheckerSpace::Object, true), (0.5, CheckerSpace::World, false)] {
        scene.materials[0].checker = Some(pattern(space, size));
        let off = different(&seen(&scene), &seen(&moved(&scene, by)), 0);
        assert_eq!(off < (SIDE * SIDE / 100) as usize, same, "{space:?}: {off}");
    }
}

#[test]
fn lights_see_patterns() {
    let mut scene = empty();
    above(&mut scene);
    scene.planes = vec![floor()];
    scene.materials[0].checker = Some(pattern(CheckerSpace::World, 0.75));
    let by_ambient = rendered(&scene, &[], &[], Quality::default());
    scene.ambient = Vec3::ZERO;
    scene.lights = vec![sun(DVec3::NEG_Y)];
    assert_eq!(different(&rendered(&scene, &[], &[], Quality::default()), &by_ambient, 1), 0);
}

/// A lit floor whose normal map has one texel.
fn mapped_floor(texel: [u8; 3], to_light: DVec3) -> (Scene, Arc<Texture>) {
    let mut scene = empty();
    above(&mut scene);
    scene.ambient = Vec3::ZERO;
    scene.lights = vec![sun(-to_light)];
    let texture = add_texture(&mut scene, [1, 1], Filter::Bilinear, |_, _| texel);
    scene.planes = vec![floor()];
    scene.materials[0].normal_map = Some(NormalMap { texture: 0, strength: 1.0 });
    (scene, texture)
}

/// Brightness of the middle of the floor, in linear light.
fn brightness((scene, texture): &(Scene, Arc<Texture>)) -> f64 {
    let picture = rendered(scene, &[], &[Arc::clone(texture)], Quality::default());
    crate::srgb::decode(pixel(&picture, SIDE / 2, SIDE / 2)[0])
}

#[test]
fn normals_tilt_to_the_side_that_the_texel_names() {
    // x along +X, y along -Z: see the axes of planes. Light at 60 degrees from the vertical on one side.
    let slanted = |x: f64, z: f64| DVec3::new(x * 0.8, 0.6, z * 0.8);
    for (texel, towards) in [
        ([255, 128, 128], slanted(1.0, 0.0)),
        ([0, 128, 128], slanted(-1.0, 0.0)),
        ([128, 255, 128], slanted(0.0, -1.0)),
        ([128, 0, 128], slanted(0.0, 1.0)),
    ] {
        let away = DVec3::new(-towards.x, towards.y, -towards.z);
        let lit = brightness(&mapped_floor(texel, towards));
        assert!((lit - 0.8).abs() < 0.02, "{texel:?}: {lit}");
        assert_eq!(brightness(&mapped_floor(texel, away)), 0.0, "{texel:?}");
        let untilted = brightness(&mapped_floor([128, 128, 255], towards));
        assert!((untilted - 0.6).abs() < 0.01, "{untilted}");
        // The tilted normal faces this light, the floor does not.
        let below = DVec3::new(towards.x, -towards.y, towards.z);
        assert_eq!(brightness(&mapped_floor(texel, below)), 0.0, "{texel:?}");
    }
}

#[test]
fn the_back_of_a_surface_shows_its_relief_from_behind() {
    let to_light = DVec3::new(0.8, -0.6, 0.0);
    let from_below = |texel| {
        let (mut scene, texture) = mapped_floor(texel, to_light);
        scene.camera.position.y = -2.0;
        scene.camera.look_at.y = 0.0;
        brightness(&(scene, texture))
    };
    // Outwards is up: seen from below, a slope towards +X is turned away from it.
    assert_eq!(from_below([255, 128, 128]), 0.0);
    assert!((from_below([0, 128, 128]) - 0.8).abs() < 0.02);
}

#[test]
fn strength_scales_the_slope() {
    let (mut scene, texture) = mapped_floor([255, 128, 255], DVec3::new(0.8, 0.6, 0.0));
    for (strength, expected) in [(0.0, 0.6), (1.0, 1.4 / 2.0_f64.sqrt()), (100.0, 0.8)] {
        scene.materials[0].normal_map = Some(NormalMap { texture: 0, strength });
        let found = brightness(&(scene.clone(), Arc::clone(&texture)));
        assert!((found - expected).abs() < 0.02, "{strength}: {found}, not {expected}");
    }
}

#[test]
fn planes_and_triangles_are_tilted_alike() {
    let (mut scene, texture) = mapped_floor([200, 60, 220], DVec3::new(0.3, 0.8, 0.4));
    let plane = brightness(&(scene.clone(), Arc::clone(&texture)));
    scene.planes.clear();
    scene.triangles = floor_of_triangles().to_vec();
    let triangle = brightness(&(scene, texture));
    assert!(plane > 0.1 && (plane - triangle).abs() < 0.01, "{plane}, {triangle}");
}
