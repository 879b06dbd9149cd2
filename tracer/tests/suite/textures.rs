//! Textures: single texels with known values, and comparison with the oracle.

use std::path::Path;
use std::sync::Arc;

use crate::common::{ball, empty, light, point, render_textured};
use glam::{DMat3, DVec2, DVec3, Vec2, Vec3};
use rayfarm_tracer::CompiledScene;
use rayfarm_tracer::image::{self, RgbImage};
use rayfarm_tracer::mesh::CompiledMesh;
use rayfarm_tracer::reference::Oracle;
use rayfarm_tracer::scene::{
    Attenuation, Filter, FrameView, LoadedScene, Material, Model, NormalMode, Scene, TextureMap, Triangle,
    load,
};
use rayfarm_tracer::srgb;
use rayfarm_tracer::texture::{Texture, without_repeats};

const RED: [u8; 3] = [255, 0, 0];
const GREEN: [u8; 3] = [0, 200, 0];
const BLUE: [u8; 3] = [0, 0, 90];
const GREY: [u8; 3] = [120, 121, 122];

/// Red and green above, blue and grey below.
fn four() -> Arc<Texture> {
    let pixels = [RED, GREEN, BLUE, GREY].concat();
    Arc::new(Texture::new(&RgbImage { width: 2, height: 2, pixels }).unwrap())
}

/// Pseudo-random texels of the given size.
fn noise(width: u32, height: u32) -> Arc<Texture> {
    let byte = |i: u32| (i.wrapping_mul(0x9e37_79b1).rotate_left(13).wrapping_mul(0x85eb_ca6b) >> 24) as u8;
    let pixels = (0..width * height * 3).map(byte).collect();
    Arc::new(Texture::new(&RgbImage { width, height, pixels }).unwrap())
}

/// A unit square that fills the picture, with ambient light only: the picture is the texture.
fn square(uvs: [[f64; 2]; 4], texture: &Texture, filter: Filter) -> Scene {
    let mut scene = empty(64, 64);
    scene.ambient = Vec3::ONE;
    scene.camera.position = DVec3::new(0.5, 0.5, 1.0);
    scene.camera.look_at = DVec3::new(0.5, 0.5, 0.0);
    scene.camera.fov = 2.0 * libm::atan(0.5).to_degrees();
    scene.textures = vec![TextureMap::new(texture.id(), filter)];
    scene.materials[0] = Material { diffuse: Vec3::ONE, texture: Some(0), ..scene.materials[1] };
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
    let triangle = |[a, b, c]: [usize; 3]| Triangle {
        vertices: [corners[a], corners[b], corners[c]],
        uvs: without_repeats([a, b, c].map(|i| DVec2::from_array(uvs[i]))),
        material: 0,
    };
    scene.triangles = vec![triangle([0, 1, 2]), triangle([0, 2, 3])];
    scene
}

const WHOLE: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

/// The picture's colour at a position of the square, both coordinates from 0 to 1 from the bottom left.
fn color_at(scene: &Scene, texture: &Arc<Texture>, x: f64, y: f64) -> [u8; 3] {
    let (picture, _) = render_textured(scene, &[], std::slice::from_ref(texture), &FrameView::of(scene));
    picture.pixel((x * 64.0) as u32, 63 - (y * 64.0) as u32).unwrap()
}

/// A picture whose pixels are all at one position of the texture.
fn color_of(texture: &Arc<Texture>, filter: Filter, uv: [f64; 2]) -> [u8; 3] {
    color_at(&square([uv; 4], texture, filter), texture, 0.4, 0.6)
}

#[test]
fn v_rises_from_the_bottom_row_and_codes_round_trip() {
    for filter in [Filter::Nearest, Filter::Bilinear] {
        for (uv, expected) in [
            ([0.25, 0.75], RED),
            ([0.75, 0.75], GREEN),
            ([0.25, 0.25], BLUE),
            ([0.75, 0.25], GREY),
            ([-0.75, 0.75], RED),
            ([3.75, -1.25], GREEN),
            ([999_998.25, -999_998.75], BLUE),
        ] {
            assert_eq!(color_of(&four(), filter, uv), expected, "{filter:?} at {uv:?}");
        }
    }
    let scene = square(WHOLE, &four(), Filter::Nearest);
    for (x, y, expected) in [(0.1, 0.9, RED), (0.9, 0.9, GREEN), (0.1, 0.1, BLUE), (0.9, 0.1, GREY)] {
        assert_eq!(color_at(&scene, &four(), x, y), expected);
    }
}

#[test]
fn halfway_between_centres_is_the_mean_in_linear_light() {
    let mean = |colors: &[[u8; 3]]| {
        let sum: DVec3 = colors.iter().map(|c| DVec3::from_array(c.map(srgb::decode))).sum();
        srgb::encode((sum / colors.len() as f64).as_vec3())
    };
    for (uv, expected) in [
        ([0.5, 0.75], mean(&[RED, GREEN])),
        ([0.25, 0.5], mean(&[RED, BLUE])),
        ([0.5, 0.5], mean(&[RED, GREEN, BLUE, GREY])),
        // Across the seam of two repeats.
        ([0.0, 0.25], mean(&[BLUE, GREY])),
        ([1.0, 7.0], mean(&[RED, GREEN, BLUE, GREY])),
    ] {
        let color = color_of(&four(), Filter::Bilinear, uv);
        let near = color.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 1);
        assert!(near, "{color:?}, not {expected:?}, at {uv:?}");
    }
}

#[test]
fn the_diffuse_colour_is_a_factor_of_the_texel() {
    let mut scene = square([[0.75, 0.75]; 4], &four(), Filter::Nearest);
    scene.materials[0].diffuse = Vec3::new(1.0, 0.25, 1.0);
    let expected = srgb::encode(Vec3::new(0.0, 0.25 * srgb::decode(GREEN[1]) as f32, 0.0));
    assert_eq!(color_at(&scene, &four(), 0.5, 0.4), expected);
}

#[test]
fn one_texel_is_one_colour_everywhere() {
    let texture = Arc::new(Texture::new(&RgbImage { width: 1, height: 1, pixels: GREY.to_vec() }).unwrap());
    for filter in [Filter::Nearest, Filter::Bilinear] {
        let scene = square([[-3.0, 0.0], [1e6, 0.0], [7.0, 9.0], [0.3, -1e6]], &texture, filter);
        let (picture, _) =
            render_textured(&scene, &[], std::slice::from_ref(&texture), &FrameView::of(&scene));
        assert!(picture.pixels.chunks_exact(3).all(|pixel| pixel == GREY));
    }
}

/// Number of pixels that differ by more than one step.
fn off(scene: &Scene, meshes: &[Arc<CompiledMesh>], texture: &Arc<Texture>, view: &FrameView) -> usize {
    let textures = std::slice::from_ref(texture);
    let (picture, _) = render_textured(scene, meshes, textures, view);
    let expected = Oracle::new(scene, meshes, textures, view).render();
    let pairs = picture.pixels.chunks_exact(3).zip(expected.pixels.chunks_exact(3));
    pairs.filter(|(a, b)| a.iter().zip(b.iter()).any(|(a, b)| a.abs_diff(*b) > 1)).count()
}

#[test]
fn a_textured_square_matches_the_oracle() {
    let skewed = [[-1.3, 0.2], [2.1, -0.4], [1.7, 3.3], [-0.2, 1.1]];
    let far = skewed.map(|[u, v]| [u + 4000.0, v - 4000.0]);
    for (name, uvs) in [("whole", WHOLE), ("skewed", skewed), ("far", far)] {
        // Magnified, minified, not square.
        for (width, height) in [(2, 2), (7, 3), (300, 1), (256, 256)] {
            let texture = noise(width, height);
            for filter in [Filter::Nearest, Filter::Bilinear] {
                let mut scene = square(uvs, &texture, filter);
                // Oblique, so that no pixel's centre is on the edge of a texel.
                scene.camera.position = DVec3::new(0.13, -0.21, 0.77);
                scene.camera.up = DVec3::new(0.2, 1.0, 0.1);
                scene.lights = vec![light(point(1.0, 2.0, 3.0), 0.7, Attenuation::None)];
                for samples in [1, 4] {
                    let view = FrameView { samples, ..FrameView::of(&scene) };
                    let off = off(&scene, &[], &texture, &view);
                    // Between two texels without a filter, rounding decides.
                    let allowed = if filter == Filter::Nearest { 2 } else { 0 };
                    assert!(off <= allowed, "{name}, {width} x {height}, {filter:?}: {off} pixels differ");
                }
            }
        }
    }
}

/// A ball with a map of the world, with a closed seam: the last column of triangles ends at u = 1, not 0.
fn globe() -> Arc<CompiledMesh> {
    let mut mesh = ball(12, 18);
    let uv = |p: DVec3| {
        DVec2::new(
            libm::atan2(p.z, p.x) / std::f64::consts::TAU + 0.5,
            1.0 - libm::acos(p.y.clamp(-1.0, 1.0)) / std::f64::consts::PI,
        )
    };
    mesh.uvs = mesh
        .triangles
        .iter()
        .map(|triangle| {
            let uvs = triangle.map(|vertex| uv(mesh.positions[vertex as usize]));
            let wraps = uvs.iter().any(|uv| uv.x > 0.75) && uvs.iter().any(|uv| uv.x < 0.25);
            let shift = |uv: DVec2| if wraps && uv.x < 0.25 { uv + DVec2::X } else { uv };
            without_repeats(uvs.map(shift)).unwrap()
        })
        .collect();
    Arc::new(CompiledMesh::compile(&mesh).unwrap().0)
}

#[test]
fn textured_instances_match_the_oracle() {
    let (mesh, texture) = (globe(), noise(64, 32));
    for filter in [Filter::Nearest, Filter::Bilinear] {
        let mut scene = empty(120, 90);
        scene.textures = vec![TextureMap::new(texture.id(), filter)];
        scene.materials[0].texture = Some(0);
        let model = |x: f64, scale: [f64; 3], normals, materials| Model {
            mesh: mesh.id(),
            materials,
            normals,
            translate: DVec3::new(x, 0.0, 0.0),
            rotate: DVec3::new(20.0, 70.0, 10.0),
            scale: scale.into(),
            group: DMat3::IDENTITY,
        };
        scene.models = vec![
            model(-1.2, [0.8; 3], NormalMode::Flat, vec![0, 1]),
            model(0.0, [0.4, 1.0, -0.5], NormalMode::Smooth, vec![0, 0]),
            model(1.2, [0.7; 3], NormalMode::Smooth, vec![2, 0]),
        ];
        scene.lights = vec![light(point(2.0, 4.0, 3.0), 0.9, Attenuation::None)];
        for spin in [0.0, 111.0] {
            let view = FrameView { spin, ..FrameView::of(&scene) };
            let off = off(&scene, std::slice::from_ref(&mesh), &texture, &view);
            let allowed = if filter == Filter::Nearest { 3 } else { 0 };
            assert!(off <= allowed, "{filter:?}, spin {spin}: {off} pixels differ");
        }
    }
}

#[test]
fn a_scene_with_files_matches_the_oracle() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/textured.toml");
    let LoadedScene { scene, meshes, textures, .. } = load(&path).unwrap();
    let view = FrameView { width: 60, height: 45, samples: 1, ..FrameView::of(&scene) };
    let (picture, _) = render_textured(&scene, &meshes, &textures, &view);
    let expected = Oracle::new(&scene, &meshes, &textures, &view).render();
    let difference = image::compare(&picture, &expected).unwrap();
    let pairs = picture.pixels.chunks_exact(3).zip(expected.pixels.chunks_exact(3));
    let off = pairs.filter(|(a, b)| a.iter().zip(b.iter()).any(|(a, b)| a.abs_diff(*b) > 1)).count();
    assert!(off <= 3, "{off} pixels differ: {difference:?}");
}

#[test]
fn mismatched_meshes_and_textures_are_refused() {
    let texture = four();
    let mut scene = square(WHOLE, &texture, Filter::Nearest);
    let missing = CompiledScene::new(scene.clone(), [], [noise(1, 1)]).unwrap_err().to_string();
    assert!(missing.contains(&texture.id().to_string()), "{missing}");

    let bare = Arc::new(CompiledMesh::compile(&ball(4, 5)).unwrap().0);
    scene.models = vec![Model {
        mesh: bare.id(),
        materials: vec![1, 0],
        normals: NormalMode::Flat,
        translate: DVec3::ZERO,
        rotate: DVec3::ZERO,
        scale: DVec3::ONE,
        group: DMat3::IDENTITY,
    }];
    let unfit = CompiledScene::new(scene.clone(), [bare.clone()], [texture.clone()]).unwrap_err().to_string();
    assert!(unfit.contains("without texture coordinates"), "{unfit}");
    scene.models[0].materials = vec![1, 2];
    CompiledScene::new(scene, [bare], [texture]).unwrap();
}

#[test]
fn invalid_texture_coordinates_are_refused() {
    let texture = four();
    let mut scene = square(WHOLE, &texture, Filter::Nearest);
    scene.validate().unwrap();
    for odd in [f32::NAN, -1e9, 1e9] {
        scene.triangles[0].uvs = Some([Vec2::ZERO, Vec2::splat(odd), Vec2::ONE]);
        assert!(scene.validate().unwrap_err().to_string().starts_with("triangles[0].uvs must be"));
    }
    scene.triangles[0].uvs = None;
    assert!(scene.validate().unwrap_err().to_string().contains("no texture coordinates"));
}
