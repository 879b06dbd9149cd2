use super::*;
use crate::mesh::{Mesh, NamedMaterial};

fn box_mesh(lower: DVec3, upper: DVec3) -> CompiledMesh {
    let positions =
        vec![lower, DVec3::new(upper.x, lower.y, lower.z), upper, DVec3::new(lower.x, upper.y, upper.z)];
    let mesh = Mesh {
        positions,
        normals: Vec::new(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        triangle_materials: vec![0, 0],
        uvs: Vec::new(),
        materials: vec![NamedMaterial { name: "a".into(), material: Material::NEUTRAL, texture: None }],
    };
    CompiledMesh::compile(&mesh).unwrap().0
}

/// Where a point lies in the picture: inside when both are within [-1, 1] and it is in front.
fn projected(camera: &Camera, aspect: f64, point: DVec3) -> Option<(f64, f64)> {
    let forward = (camera.look_at - camera.position).normalize();
    let right = forward.cross(camera.up).normalize();
    let up = right.cross(forward);
    let to = point - camera.position;
    let half = (camera.fov / 2.0).to_radians().tan() * to.dot(forward);
    (half > 0.0).then(|| (to.dot(right) / (half * aspect), to.dot(up) / half))
}

#[test]
fn a_bare_model_is_wholly_in_the_picture() {
    for (lower, upper) in [
        (DVec3::splat(-1.0), DVec3::splat(1.0)),
        (DVec3::new(0.0, 0.0, 0.0), DVec3::new(100.0, 1.0, 0.01)),
        (DVec3::new(1e7, -1e7, 0.0), DVec3::new(1e7 + 1.0, -1e7 + 3.0, 2.0)),
        (DVec3::splat(-1e-9), DVec3::new(1e-9, 1e-8, 1e-9)),
        (DVec3::ZERO, DVec3::new(1.0, 1000.0, 1.0)),
    ] {
        let scene = bare_model(&box_mesh(lower, upper));
        scene.validate().unwrap();
        for corner in 0..8 {
            let pick = |axis: usize| if corner & (1 << axis) == 0 { lower[axis] } else { upper[axis] };
            let corner = DVec3::new(pick(0), pick(1), pick(2));
            for aspect in [1.0, 4.0 / 3.0, 16.0 / 9.0] {
                let (x, y) = projected(&scene.camera, aspect, corner).unwrap();
                assert!(x.abs() < 1.0 && y.abs() < 1.0, "{corner} at {x} {y} of {:?}", scene.camera);
            }
        }
        // And it is not lost in the distance.
        let (_, top) = projected(&scene.camera, 1.0, lower).unwrap();
        let (_, bottom) = projected(&scene.camera, 1.0, upper).unwrap();
        let (left, _) = projected(&scene.camera, 1.0, lower).unwrap();
        let (right, _) = projected(&scene.camera, 1.0, upper).unwrap();
        assert!((top - bottom).hypot(left - right) > 0.5, "{:?}", scene.camera);
    }
}

#[test]
fn the_default_light_is_above_and_left_of_the_camera() {
    let camera =
        Camera { position: DVec3::Z * 2.0, look_at: DVec3::ZERO, up: DVec3::Y, fov: 40.0, zoom: 1.0 };
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
    // Behind, sideways, and here.
    assert_eq!(at(middle_at(DVec3::new(0.0, 0.0, 5.0))), DVec3::NEG_Z * 5.0);
    assert_eq!(at(middle_at(DVec3::new(3.0, 4.0, 0.0))), DVec3::NEG_Z * 5.0);
    assert_eq!(at(middle_at(DVec3::new(3.0, 4.0, -1e-9))), DVec3::NEG_Z * 5.0);
    assert_eq!(at(middle_at(DVec3::ZERO)), DVec3::NEG_Z);
}

#[test]
fn bounds_follow_scale_rotation_and_translation() {
    let mesh = Arc::new(box_mesh(DVec3::ZERO, DVec3::new(1.0, 2.0, 4.0)));
    let mut scene = bare_model(&mesh);
    assert_eq!(bounds(&scene, std::slice::from_ref(&mesh)), Some((DVec3::ZERO, DVec3::new(1.0, 2.0, 4.0))));
    scene.models[0].scale = DVec3::new(1.0, -1.0, 0.5);
    scene.models[0].rotate = DVec3::new(0.0, 90.0, 0.0);
    scene.models[0].translate = DVec3::new(10.0, 0.0, 0.0);
    // Z becomes X, and X becomes -Z.
    let expected = (DVec3::new(10.0, -2.0, -1.0), DVec3::new(12.0, 0.0, 0.0));
    assert_eq!(bounds(&scene, &[mesh]), Some(expected));
    assert_eq!(bounds(&Scene { models: Vec::new(), ..scene }, &[]), None);
}
