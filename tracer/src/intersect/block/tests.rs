//! Blocks of any sixteen rays against single rays, to the bit, and against the oracle in `f64`.

use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};
use proptest::prelude::*;

use super::*;
use crate::compile::CompiledScene;
use crate::intersect::{Primitive, RaySegment};
use crate::mesh::{CompiledMesh, Mesh, NamedMaterial};
use crate::rays::{BLOCKS, RayBatch};
use crate::reference::Oracle;
use crate::scene::{
    Background, Camera, CameraKind, FrameView, Material, Model, NormalMode, Plane, RenderSettings, Scene,
    Sphere, Triangle,
};
use crate::simd::{self, LANES};
use crate::surface::Surfaces;

const EYE: DVec3 = DVec3::new(0.1, 0.2, 5.0);

/// Two instances of a mesh of random triangles, a sphere, two triangles and a plane.
fn scene_of(corners: &[[f64; 9]], rotate: DVec3, scale: DVec3) -> (Scene, Arc<CompiledMesh>) {
    let triangle = |numbers: &[f64; 9]| {
        let [ax, ay, az, bx, by, bz, cx, cy, cz] = *numbers;
        let middle = DVec3::new(ax, ay, az) * 3.0;
        [middle, middle + DVec3::new(bx, by, bz), middle + DVec3::new(cx, cy, cz)]
    };
    let mesh = Mesh {
        positions: corners.iter().flat_map(triangle).collect(),
        triangles: (0..corners.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        triangle_materials: vec![0; corners.len()],
        materials: vec![NamedMaterial::plain("m", Material::NEUTRAL)],
        ..Mesh::default()
    };
    let mesh = Arc::new(CompiledMesh::compile(&mesh).unwrap().0);
    let model = |translate: DVec3| Model {
        mesh: mesh.id(),
        materials: vec![0],
        normals: NormalMode::Flat,
        translate,
        rotate,
        scale,
        group: DMat3::IDENTITY,
    };
    let single = |numbers: &[f64; 9]| Triangle { vertices: triangle(numbers), uvs: None, material: 0 };
    let scene = Scene {
        ambient: Vec3::ZERO,
        render: RenderSettings::default(),
        camera: Camera {
            position: EYE,
            look_at: DVec3::ZERO,
            up: DVec3::Y,
            fov: 40.0,
            zoom: 1.0,
            kind: CameraKind::PINHOLE,
        },
        background: Background::Color(Vec3::ZERO),
        lights: vec![],
        materials: vec![Material::NEUTRAL],
        textures: vec![],
        models: vec![model(DVec3::ZERO), model(DVec3::new(2.0, -1.0, 0.5))],
        spheres: vec![Sphere {
            center: DVec3::new(0.5, 0.0, 0.5),
            radius: 0.7,
            material: 0,
            inside_out: false,
            uv_rotate: DVec3::ZERO,
        }],
        planes: vec![Plane {
            point: DVec3::NEG_Y * 3.0,
            normal: DVec3::new(0.1, 1.0, 0.0),
            material: 0,
            size: 1.0,
        }],
        triangles: corners.iter().take(2).map(single).collect(),
        disks: Vec::new(),
        background_visible: true,
        ..Scene::default()
    };
    (scene, mesh)
}

fn frame_of(scene: &Scene, mesh: &Arc<CompiledMesh>) -> PreparedFrame {
    let compiled = Arc::new(CompiledScene::new(scene.clone(), [Arc::clone(mesh)], []).unwrap());
    PreparedFrame::new(compiled, &FrameView::of(scene)).unwrap()
}

/// Rays that continue in other directions from the hits of the first ones: bounces.
fn bounces(frame: &PreparedFrame, rays: &[RaySegment], directions: &[[f64; 3]]) -> Vec<RaySegment> {
    let pairs = rays.iter().zip(directions);
    let bounce = |(ray, direction): (&RaySegment, &[f64; 3])| {
        let hit = frame.closest_hit(ray.origin, ray.direction, ray.t_max)?;
        let origin = ray.origin + ray.direction * hit.t;
        let direction = DVec3::from(*direction);
        Some(RaySegment { origin, direction, t_max: f64::INFINITY, starts_on: Some(hit.primitive) })
    };
    pairs.filter_map(bounce).collect()
}

/// Asserts that a block gives the hits of single rays, to the bit, on every level.
fn check_block(frame: &mut PreparedFrame, rays: &[RaySegment]) {
    let block_of = |frame: &PreparedFrame| -> Vec<(crate::rays::Ray, RaySegment)> {
        let usable = |ray: &RaySegment| Some((frame.to_eye(ray.origin, ray.direction)?, *ray));
        rays.iter().filter_map(usable).collect()
    };
    let usable = block_of(frame);
    let id = |frame: &PreparedFrame, primitive: Option<Primitive>| primitive.map(|name| frame.id_of(name));
    let expected: Vec<_> = usable
        .iter()
        .map(|(ray, segment)| {
            let starts_on = id(frame, segment.starts_on);
            let hit = frame.closest(ray, segment.t_max, starts_on);
            let any = frame.occluded(ray, segment.t_max, starts_on);
            assert_eq!(any, hit.is_some());
            hit.map(|hit| (hit.t.to_bits(), hit.primitive))
        })
        .collect();
    for level in simd::all() {
        frame.level = level;
        let mut block = RayBlock::new(frame);
        for (lane, (ray, segment)) in usable.iter().enumerate() {
            block.set(lane, *ray, segment.t_max, id(frame, segment.starts_on));
        }
        let mut hits = HitBlock::NONE;
        frame.closest_hits_of(&block, u32::MAX, &mut hits);
        let any = frame.any_hits_of(&block);
        for (lane, expected) in expected.iter().enumerate() {
            let found = frame.hit_in(&block, &hits, lane).map(|hit| (hit.t.to_bits(), hit.primitive));
            assert_eq!(&found, expected, "lane {lane} with {}", simd::name(level));
            assert_eq!(any >> lane & 1 == 1, expected.is_some(), "lane {lane} with {}", simd::name(level));
        }
        assert_eq!(any >> usable.len(), 0);
        check_surfaces(frame, &block, &hits);
    }
}

#[inline(always)]
fn find_surfaces<S: Simd>(simd: S, surfaces: &mut Surfaces, rays: &RayBatch<'_>, hits: &[HitBlock]) {
    surfaces.find(simd, rays, hits);
}

/// Asserts that the surface points of a block are those of the exact hits.
fn check_surfaces(frame: &PreparedFrame, block: &RayBlock<'_>, hits: &HitBlock) {
    let mut surfaces = Surfaces::empty(frame);
    let mut rays = RayBatch::new(frame);
    rays.blocks[0] = block.clone();
    let mut all: [HitBlock; BLOCKS] = std::array::from_fn(|_| HitBlock::NONE);
    all[0] = hits.clone();
    dispatch!(frame.level, simd => find_surfaces(simd, &mut surfaces, &rays, &all));
    let surface = &surfaces.blocks[0];
    for lane in 0..LANES {
        let Some(hit) = frame.hit_in(block, hits, lane) else {
            assert_eq!(surface.hit >> lane & 1, 0);
            continue;
        };
        assert_eq!(surface.hit >> lane & 1, 1);
        let ray = block.ray(0, lane);
        let point = ray.origin + ray.direction * hit.t;
        let vector = |lanes: &[crate::simd::Lanes; 3]| {
            DVec3::from_array([0, 1, 2].map(|axis| f64::from(lanes[axis].0[lane])))
        };
        let (found, ng) = (vector(&surface.point), vector(&surface.ng));
        assert!((ng.length() - 1.0).abs() < 1e-5 && ng.dot(ray.direction) <= 1e-5, "lane {lane}: {ng}");
        // Across the surface: along it, the error grows as the ray grazes it.
        let across = (found - point).dot(ng).abs();
        assert!(across <= 4.0 * f64::from(surface.bias.0[lane]), "lane {lane}: {found}, not {point}");
    }
}

#[test]
fn a_block_without_live_rays_hits_nothing() {
    let (scene, mesh) = scene_of(&[[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]], DVec3::ZERO, DVec3::ONE);
    let frame = frame_of(&scene, &mesh);
    let block = RayBlock::new(&frame);
    let mut hits = HitBlock::NONE;
    frame.closest_hits_of(&block, u32::MAX, &mut hits);
    assert!((0..LANES).all(|lane| hits.primitive(lane).is_none()));
    assert_eq!(frame.any_hits_of(&block), 0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    /// Rays from anywhere, then bounces from their hits, which start on primitives.
    #[test]
    fn blocks_hit_what_single_rays_and_the_oracle_hit(
        corners in prop::collection::vec(prop::array::uniform9(-1.0..1.0_f64), 1..40),
        rotate in prop::array::uniform3(-180.0..180.0_f64),
        scale in prop::array::uniform3(0.3..2.0_f64),
        origins in prop::collection::vec(prop::array::uniform3(-4.0..4.0_f64), LANES),
        directions in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), LANES),
        others in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), LANES),
        t_max in prop::sample::select(vec![f64::INFINITY, 3.0, 0.5]),
    ) {
        let enough = |v: &[f64; 3]| DVec3::from(*v).length() > 1e-2;
        prop_assume!(directions.iter().all(enough) && others.iter().all(enough));
        let (scene, mesh) = scene_of(&corners, rotate.into(), scale.into());
        let mut frame = frame_of(&scene, &mesh);
        let oracle = Oracle::new(&scene, &[Arc::clone(&mesh)], &[], &FrameView::of(&scene));
        let first: Vec<RaySegment> = origins
            .iter()
            .zip(&directions)
            .map(|(&origin, &direction)| RaySegment {
                origin: origin.into(),
                direction: direction.into(),
                t_max,
                starts_on: None,
            })
            .collect();
        let second = bounces(&frame, &first, &others);
        let third = bounces(&frame, &second, &directions);
        for rays in [first, second, third] {
            check_block(&mut frame, &rays);
            let hits = frame.closest_hits(&rays);
            let any = frame.any_hits(&rays);
            for (lane, ray) in rays.iter().enumerate() {
                prop_assert_eq!(any >> lane & 1 == 1, hits[lane].is_some());
                let expected = oracle.closest_hit_of(ray);
                match (hits[lane], expected) {
                    (None, None) => {}
                    (Some(found), Some(expected)) => {
                        let off = (found.t - expected.t).abs() / (1.0 + expected.t);
                        prop_assert!(off < 1e-6, "{ray:?}: {found:?}, not {expected:?}");
                    }
                    (found, expected) => {
                        // Only within rounding of the upper end, or of the start on another surface.
                        let t = found.or(expected).map_or(0.0, |hit| hit.t);
                        prop_assert!(t < 1e-6 || (t - ray.t_max).abs() < 1e-6, "{ray:?}: {found:?}, not {expected:?}");
                    }
                }
            }
        }
    }
}
