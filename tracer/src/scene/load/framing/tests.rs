use super::*;
use crate::mesh::{Mesh, NamedMaterial};

fn box_mesh(lower: DVec3, upper: DVec3) -> CompiledMesh {
    let positions =
        vec![lower, DVec3::new(upper.x, lower.y, lower.z), upper, DVec3::new(lower.x, upper.y, upper.z)];
    let mesh = Mesh {
        positions,
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        triangle_materials: vec![0, 0],
        materials: vec![NamedMaterial::plain("a", Material::NEUTRAL)],
        ..Mesh::default()
    };
    CompiledMesh::compile(&mesh).unwrap().0
}

/// Position of a point in the picture: inside if both are within [-1, 1] and it is in front.
fn projected(camera: &Camera, aspect: f64, point: DVec3) -> Option<(f64, f64)> {
    let forward = (camera.look_at - camera.position).normalize();
    let right = forward.cross(camera.up).normalize();
    let up = right.cross(forward);
    let to = point - camera.position;
    let half = (camera.fov / 2.0).to_radians().tan() * to.dot(forward);
    (half > 0.0).then(|| (to.dot(right) / (half * aspect), to.dot(up) / half))
}

/// Shares of width and height that some points span, and the middle of the span.
fn filled(camera: &Camera, (width, height): (u32, u32), points: &[DVec3]) -> [(f64, f64); 2] {
    let aspect = f64::from(width) / f64::from(height);
    let places: Vec<_> = points.iter().map(|point| projected(camera, aspect, *point).unwrap()).collect();
    let span = |axis: fn(&(f64, f64)) -> f64| {
        let least = places.iter().map(axis).fold(f64::INFINITY, f64::min);
        let most = places.iter().map(axis).fold(f64::NEG_INFINITY, f64::max);
        ((most - least) / 2.0, (most + least) / 2.0)
    };
    [span(|place| place.0), span(|place| place.1)]
}

/// Distance of the nearest of some points along the view direction.
fn nearest(camera: &Camera, points: &[DVec3]) -> f64 {
    let forward = (camera.look_at - camera.position).normalize();
    points.iter().map(|point| (*point - camera.position).dot(forward)).fold(f64::INFINITY, f64::min)
}

fn half_diagonal(lower: DVec3, upper: DVec3) -> f64 {
    (upper - lower).length() / 2.0
}

const SIZES: [(u32, u32); 6] = [(1024, 768), (300, 300), (90, 160), (1920, 800), (1, 16384), (16384, 1)];

#[test]
fn a_bare_model_fills_nine_tenths_of_every_picture() {
    for (lower, upper) in [
        (DVec3::splat(-1.0), DVec3::splat(1.0)),
        (DVec3::new(0.0, 0.0, 0.0), DVec3::new(100.0, 1.0, 0.01)),
        (DVec3::new(1e7, -1e7, 0.0), DVec3::new(1e7 + 1.0, -1e7 + 3.0, 2.0)),
        (DVec3::splat(-1e-6), DVec3::new(1e-6, 1e-5, 1e-6)),
        (DVec3::splat(-1e6), DVec3::new(3e6, 1e6, 1e6)),
        (DVec3::ZERO, DVec3::new(1.0, 1000.0, 1.0)),
        (DVec3::ZERO, DVec3::new(5.0, 0.0, 5.0)),
        (DVec3::ZERO, DVec3::new(0.001, 5.0, 0.0)),
    ] {
        let mesh = box_mesh(lower, upper);
        let scale = libm::exp2(f64::from(mesh.exponent()));
        let vertices: Vec<DVec3> = mesh
            .triangles()
            .flat_map(|triangle| mesh.corners(triangle))
            .map(|corner| mesh.center() + corner.as_dvec3() * scale)
            .collect();
        for (size, up) in SIZES.into_iter().flat_map(|size| [(size, Up::Y), (size, Up::Z)]) {
            let scene = bare_model(&mesh, up, Some(size));
            scene.validate().unwrap();
            let upright: Vec<DVec3> = vertices.iter().map(|vertex| up.upright(*vertex)).collect();
            let [(width, x), (height, y)] = filled(&scene.camera, size, &upright);
            // Far from the origin the camera has as many digits as the model.
            let fill = width.max(height);
            // Seen from its end, or in a narrow picture, a long model limits the camera by its nearest point.
            let is_at_least_distance =
                nearest(&scene.camera, &upright) < 1.001 * NEAREST * half_diagonal(lower, upper);
            let is_filled = (fill - 0.9).abs() < 1e-6 || is_at_least_distance && fill < 0.9;
            assert!(is_filled, "{lower} {upper} {size:?}: {width} x {height}");
            let (fullest, middle) = if width > height { (width, x) } else { (height, y) };
            assert!(middle.abs() < 1e-6 || fill < 0.9 - 1e-6, "{middle} of {fullest}");
            assert!(x.abs() + width < 1.0 && y.abs() + height < 1.0, "{x} {y}, {width} x {height}");
        }
    }
}

#[test]
fn the_camera_looks_from_the_front_the_right_and_above() {
    let camera = bare_model(&box_mesh(-DVec3::ONE, DVec3::ONE), Up::Y, None).camera;
    let towards = (camera.position - camera.look_at).normalize();
    assert!((towards - DVec3::new(0.6, 0.35, 1.0).normalize()).length() < 1e-12);
    assert_eq!((camera.fov, camera.up), (45.0, DVec3::Y));
}

#[test]
fn a_scene_without_a_camera_fills_its_picture_by_its_box() {
    let bounds = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(9.0, 3.0, 4.0));
    for size in SIZES {
        let camera = camera_showing(Some(bounds), size);
        let [(width, _), (height, _)] = filled(&camera, size, &corners_of(bounds).collect::<Vec<_>>());
        assert!((width.max(height) - 0.9).abs() < 1e-9, "{size:?}: {width} x {height}");
    }
}

#[test]
fn a_model_whose_z_points_up_is_turned_upright() {
    let mesh = Arc::new(box_mesh(DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, 1.0, 6.0)));
    let scene = bare_model(&mesh, Up::Z, None);
    let expected = (DVec3::new(-1.0, 0.0, -1.0), DVec3::new(1.0, 6.0, 1.0));
    assert_eq!(bounds(&scene, std::slice::from_ref(&mesh)), Some(expected));
}

#[test]
fn the_default_light_is_above_and_left_of_the_camera() {
    let camera = Camera {
        position: DVec3::Z * 2.0,
        look_at: DVec3::ZERO,
        up: DVec3::Y,
        fov: 40.0,
        zoom: 1.0,
        kind: crate::scene::CameraKind::PINHOLE,
    };
    let light = default_light(&camera);
    assert_eq!(light.kind, LightKind::Point { position: DVec3::new(-0.7, 1.0, 2.0) });
    assert_eq!((light.color, light.attenuation, light.shadows), (Vec3::ONE, Attenuation::None, true));
}

#[test]
fn the_point_on_the_axis_is_the_one_nearest_to_the_middle() {
    let middle_at = |center: DVec3| Some((center - 1.0, center + 1.0));
    let at = |bounds| point_on_axis(DVec3::ZERO, DVec3::NEG_Z, bounds);
    assert_eq!(at(None), DVec3::NEG_Z);
    assert_eq!(at(middle_at(DVec3::new(3.0, 4.0, -7.0))), DVec3::new(0.0, 0.0, -7.0));
    // Behind, sideways, and at the camera.
    assert_eq!(at(middle_at(DVec3::new(0.0, 0.0, 5.0))), DVec3::NEG_Z * 5.0);
    assert_eq!(at(middle_at(DVec3::new(3.0, 4.0, 0.0))), DVec3::NEG_Z * 5.0);
    assert_eq!(at(middle_at(DVec3::new(3.0, 4.0, -1e-9))), DVec3::NEG_Z * 5.0);
    assert_eq!(at(middle_at(DVec3::ZERO)), DVec3::NEG_Z);
}

#[test]
fn bounds_follow_scale_rotation_and_translation() {
    let mesh = Arc::new(box_mesh(DVec3::ZERO, DVec3::new(1.0, 2.0, 4.0)));
    let mut scene = bare_model(&mesh, Up::Y, None);
    assert_eq!(bounds(&scene, std::slice::from_ref(&mesh)), Some((DVec3::ZERO, DVec3::new(1.0, 2.0, 4.0))));
    scene.models[0].scale = DVec3::new(1.0, -1.0, 0.5);
    scene.models[0].rotate = DVec3::new(0.0, 90.0, 0.0);
    scene.models[0].translate = DVec3::new(10.0, 0.0, 0.0);
    // Z becomes X, and X becomes -Z.
    let expected = (DVec3::new(10.0, -2.0, -1.0), DVec3::new(12.0, 0.0, 0.0));
    assert_eq!(bounds(&scene, &[mesh]), Some(expected));
    assert_eq!(bounds(&Scene { models: Vec::new(), ..scene }, &[]), None);
}

#[test]
fn bounds_follow_groups_and_disks() {
    let mesh = Arc::new(box_mesh(DVec3::ZERO, DVec3::new(1.0, 2.0, 4.0)));
    let mut scene = bare_model(&mesh, Up::Y, None);
    // A shear in its group: x grows by y.
    scene.models[0].group = DMat3::from_cols(DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Z);
    let meshes = [mesh];
    assert_eq!(bounds(&scene, &meshes), Some((DVec3::ZERO, DVec3::new(3.0, 2.0, 4.0))));
    scene.models.clear();
    let disk = |normal: DVec3| Disk { center: DVec3::ONE, normal, radius: 2.0, material: 0 };
    scene.disks = vec![disk(DVec3::Y)];
    assert_eq!(bounds(&scene, &meshes), Some((DVec3::new(-1.0, 1.0, -1.0), DVec3::new(3.0, 1.0, 3.0))));
    // Tilted by 3 : 4 : 5.
    scene.disks = vec![disk(DVec3::new(0.6, 0.8, 0.0))];
    let (lower, upper) = bounds(&scene, &meshes).unwrap();
    assert!((lower - DVec3::new(-0.6, -0.2, -1.0)).length() < 1e-12, "{lower}");
    assert!((upper - DVec3::new(2.6, 2.2, 3.0)).length() < 1e-12, "{upper}");
}
