//! Surface features from the file to the pixel: unlit materials, emission, vertex colours, tiling, and cut-outs.

mod cut_outs;

use std::path::Path;
use std::sync::Arc;

use crate::common::{ball, empty, light, point, render_textured};
use ::image::{Rgba, RgbaImage};
use glam::{DMat3, DVec2, DVec3, Vec2, Vec3};
use rayfarm_tracer::image::{RgbImage, save};
use rayfarm_tracer::mesh::{CompiledMesh, Mesh, NamedMaterial};
use rayfarm_tracer::numerics::{self, Effort, Subject};
use rayfarm_tracer::reference::Oracle;
use rayfarm_tracer::scene::{
    Attenuation, Background, Filter, FrameView, LightKind, LoadedScene, Material, Model, NormalMode, Plane,
    Quality, Scene, Sphere, TextureMap, Tiling, Triangle, Wrap, load,
};
use rayfarm_tracer::srgb;
use rayfarm_tracer::texture::{Texture, split_repeats};
use rayfarm_tracer::{CompiledScene, PreparedFrame, Primitive, render_rows};

/// A scene with its meshes and textures, as the loader returns it.
fn loaded(scene: Scene, meshes: Vec<Arc<CompiledMesh>>, textures: Vec<Arc<Texture>>) -> LoadedScene {
    LoadedScene { scene, meshes, mesh_files: vec![], textures, warnings: vec![], animation: None }
}

fn rendered(loaded: &LoadedScene, view: &FrameView) -> RgbImage {
    render_textured(&loaded.scene, &loaded.meshes, &loaded.textures, view).0
}

fn frame(loaded: &LoadedScene, view: &FrameView) -> PreparedFrame {
    let (meshes, textures) = (loaded.meshes.iter().cloned(), loaded.textures.iter().cloned());
    let compiled = CompiledScene::new(loaded.scene.clone(), meshes, textures).unwrap();
    PreparedFrame::new(Arc::new(compiled), view).unwrap()
}

/// Number of pixels that differ from the oracle's by more than a step.
fn off(loaded: &LoadedScene, view: &FrameView) -> usize {
    let picture = rendered(loaded, view);
    let expected = Oracle::new(&loaded.scene, &loaded.meshes, &loaded.textures, view).render();
    let pairs = picture.pixels.chunks_exact(3).zip(expected.pixels.chunks_exact(3));
    pairs.filter(|(a, b)| a.iter().zip(b.iter()).any(|(a, b)| a.abs_diff(*b) > 1)).count()
}

/// Asserts the same bytes for every level of SIMD, every division into rows, and adaptive frames as well.
fn assert_the_same_everywhere(what: &str, loaded: &LoadedScene, view: &FrameView) {
    let copy = LoadedScene {
        scene: loaded.scene.clone(),
        meshes: loaded.meshes.clone(),
        mesh_files: vec![],
        textures: loaded.textures.clone(),
        warnings: vec![],
        animation: None,
    };
    for outcome in numerics::levels(&Subject::new(what, copy), &Effort::default()).unwrap() {
        assert!(outcome.holds(), "{what}: {} bytes differ with {}", outcome.wrong, outcome.case);
    }
    for adaptive in [false, true] {
        let view = FrameView { samples: 4, quality: Quality { adaptive, ..view.quality }, ..*view };
        let whole = rendered(loaded, &view).pixels;
        let frame = frame(loaded, &view);
        let mut cut = vec![0; whole.len()];
        let bytes = view.width as usize * 3;
        for (from, to) in [(0, 1), (1, 6), (6, 7), (7, 30), (30, view.height)] {
            let pixels = &mut cut[from as usize * bytes..to as usize * bytes];
            render_rows(&frame, from..to, pixels, &|| false).unwrap();
        }
        assert!(whole == cut, "{what}: a cut changes the picture (adaptive: {adaptive})");
    }
}

/// A square of two triangles with corners at (0, 0), (1, 0), (1, 1), (0, 1) of its own plane.
fn square(place: impl Fn(f64, f64) -> DVec3, uvs: [[f32; 2]; 4], material: u32) -> [Triangle; 2] {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| place(x, y));
    [[0, 1, 2], [0, 2, 3]].map(|indices: [usize; 3]| Triangle {
        vertices: indices.map(|i| corners[i]),
        uvs: Some(indices.map(|i| Vec2::from_array(uvs[i]))),
        material,
    })
}

const WHOLE: [[f32; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

/// A pseudo-random picture whose alpha is above one half where `solid` is true, both coordinates from 0 to 1.
fn holes(side: u32, solid: impl Fn(f64, f64) -> bool) -> Arc<Texture> {
    let noise = |i: u32| (i.wrapping_mul(0x9e37_79b1).rotate_left(13).wrapping_mul(0x85eb_ca6b) >> 24) as u8;
    let pixels = (0..side * side * 3).map(noise).collect();
    let share = |i: u32| (f64::from(i) + 0.5) / f64::from(side);
    let alpha = (0..side * side).map(|i| {
        // Intermediate alpha as well, for the filter.
        let strength = 90 + noise(i) / 4;
        if solid(share(i % side), 1.0 - share(i / side)) { 255 - strength } else { strength }
    });
    let alpha: Vec<u8> = alpha.collect();
    Arc::new(Texture::with_alpha(&RgbImage { width: side, height: side, pixels }, &alpha).unwrap())
}

const CUBE: &str = "v -1 -1 -1 0 0 0\nv 1 -1 -1 1 0 0\nv 1 1 -1 1 1 0\nv -1 1 -1 0 1 0\n\
                    v -1 -1 1 0 0 1\nv 1 -1 1 1 0 1\nv 1 1 1 1 1 1\nv -1 1 1 0 1 1\n";

/// Writes a model and its library, and loads it through a scene without ambient light.
fn model(folder: &Path, obj: &str, mtl: &str, scene: &str) -> LoadedScene {
    std::fs::write(folder.join("m.obj"), format!("mtllib m.mtl\n{obj}")).unwrap();
    std::fs::write(folder.join("m.mtl"), mtl).unwrap();
    std::fs::write(folder.join("s.toml"), format!("{scene}\n[[model]]\nfile = \"m.obj\"\n")).unwrap();
    let loaded = load(&folder.join("s.toml")).unwrap();
    assert_eq!(loaded.warnings, [""; 0]);
    loaded
}

/// Triangles of a scene as a mesh, with whole repeats apart.
fn mesh_of(triangles: &[Triangle]) -> Arc<CompiledMesh> {
    let uvs =
        |triangle: &Triangle| split_repeats(triangle.uvs.unwrap().map(|uv: Vec2| uv.as_dvec2())).unwrap();
    let (near, repeats): (Vec<[Vec2; 3]>, Vec<Vec2>) = triangles.iter().map(uvs).unzip();
    let mesh = Mesh {
        positions: triangles.iter().flat_map(|triangle| triangle.vertices).collect(),
        triangles: (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        triangle_materials: vec![0; triangles.len()],
        uvs: near,
        uv_repeats: repeats,
        materials: vec![NamedMaterial::plain("m", Material::NEUTRAL)],
        ..Mesh::default()
    };
    Arc::new(CompiledMesh::compile(&mesh).unwrap().0)
}

const FROM_THE_FRONT: &str = "[render]\nwidth = 64\nheight = 64\n\
                              [camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\nfov = 30\n\
                              [[light]]\nkind = \"point\"\nposition = [3, 4, 6]\nshadows = true\n";

#[test]
fn illum_0_is_unlit_and_ke_emits_on_the_front() {
    let folder = tempfile::tempdir().unwrap();
    let text = "newmtl flat\nKd 0.8 0.1 0.1\nKs 1 1 1\nillum 0\nnewmtl lamp\nKd 0 0 0\nKe 1 0.6 0.1\n\
                newmtl both\nKd 0.25 0.5 0.25\nKe 0.25 0 0\nillum 0\n";
    // Three adjacent stripes; the second lamp shows its back.
    let strip = |x: i32| format!("v {x} -1 0\nv {} -1 0\nv {} 1 0\nv {x} 1 0\n", x + 1, x + 1);
    let obj = format!(
        "{}{}{}{}usemtl flat\nf 1 2 3 4\nusemtl lamp\nf 5 6 7 8\nf 12 11 10 9\nusemtl both\nf 13 14 15 16\n",
        strip(-2),
        strip(-1),
        strip(0),
        strip(1)
    );
    let wide = FROM_THE_FRONT.replace("fov = 30", "fov = 50");
    let loaded = model(folder.path(), &obj, text, &wide);
    let view = FrameView::of(&loaded.scene);
    let picture = rendered(&loaded, &view);
    let at = |x: f64| picture.pixel((32.0 + x * 64.0 / (10.0 * libm::tan(0.436_332))) as u32, 32).unwrap();
    assert_eq!(at(-1.5), srgb::encode(Vec3::new(0.8, 0.1, 0.1)));
    assert_eq!(at(-0.5), srgb::encode(Vec3::new(1.0, 0.6, 0.1)));
    assert_eq!(at(0.5), [0; 3]);
    assert_eq!(at(1.5), srgb::encode(Vec3::new(0.5, 0.5, 0.25)));
    assert_eq!(off(&loaded, &view), 0);
    let compiled = CompiledScene::new(loaded.scene.clone(), loaded.meshes.clone(), []).unwrap();
    assert!(compiled.features().unlit && compiled.features().emissive && !compiled.features().cut_out);
}

#[test]
fn emission_takes_textures_on_every_shape_and_lights_nothing() {
    let texture = holes(16, |_, _| true);
    let mut scene = empty(80, 60);
    let lamp =
        Material { diffuse: Vec3::splat(0.1), emission: Vec3::new(0.7, 0.3, 0.2), ..scene.materials[1] };
    scene.textures = vec![TextureMap::new(texture.id(), Filter::Bilinear)];
    scene.materials.extend([lamp, Material { emission_texture: Some(0), ..lamp }]);
    scene.materials.push(Material { texture: Some(0), unlit: true, ..scene.materials[0] });
    scene.spheres = vec![Sphere {
        center: DVec3::new(-0.8, 0.2, 0.5),
        radius: 0.4,
        material: 3,
        inside_out: false,
        uv_rotate: DVec3::ZERO,
    }];
    scene.planes = vec![Plane { point: DVec3::NEG_Y, normal: DVec3::NEG_Y, material: 3, size: 1.0 }];
    scene.triangles.extend(square(|x, y| DVec3::new(x * 0.8 - 0.3, y * 0.8, 0.1 + x), WHOLE, 4));
    scene.triangles.extend(square(|x, y| DVec3::new(0.4 + x * 0.8, y * 0.8 - 0.5, x - y), WHOLE, 5));
    let mut mesh = ball(8, 10);
    mesh.uvs = mesh.triangles.iter().map(|_| [Vec2::ZERO, Vec2::X, Vec2::Y]).collect();
    let mesh = Arc::new(CompiledMesh::compile(&mesh).unwrap().0);
    let model = |x: f64, scale: [f64; 3], normals, materials: [u32; 2]| Model {
        mesh: mesh.id(),
        materials: materials.to_vec(),
        normals,
        translate: DVec3::new(x, 1.0, -1.0),
        rotate: DVec3::new(10.0, 20.0, 30.0),
        scale: scale.into(),
        group: DMat3::IDENTITY,
    };
    // Nothing emits towards the inside; a mirrored sphere keeps its front outside.
    scene.models = vec![
        model(-1.0, [0.4; 3], NormalMode::Flat, [3, 1]),
        model(0.0, [-0.4, 0.4, 0.4], NormalMode::Smooth, [4, 5]),
        model(1.0, [9.0; 3], NormalMode::Flat, [3, 3]),
    ];
    scene.lights = vec![light(point(2.0, 4.0, 3.0), 0.6, Attenuation::None)];
    let loaded = loaded(scene, vec![mesh], vec![texture]);
    let view = FrameView::of(&loaded.scene);
    assert_eq!(off(&loaded, &view), 0);
    assert_the_same_everywhere("lamps", &loaded, &view);
}

#[test]
fn a_cube_with_the_corners_of_rgb_shows_them() {
    let folder = tempfile::tempdir().unwrap();
    let obj = format!("{CUBE}f 5 6 7 8\nf 2 1 4 3\nf 6 2 3 7\nf 1 5 8 4\nf 8 7 3 4\nf 1 2 6 5\n");
    let mut loaded = model(folder.path(), &obj, "", FROM_THE_FRONT);
    (loaded.scene.ambient, loaded.scene.lights) = (Vec3::ONE, vec![]);
    let view = FrameView { width: 200, height: 200, ..FrameView::of(&loaded.scene) };
    let picture = rendered(&loaded, &view);
    // The front face, z = 1, at 4 from the camera.
    let at = |x: f64, y: f64| {
        let scale = 100.0 / (4.0 * libm::tan(15_f64.to_radians()));
        picture.pixel((100.0 + x * scale) as u32, (100.0 - y * scale) as u32).unwrap()
    };
    let inside = 0.995;
    for (x, y, expected) in [
        (-inside, -inside, [0, 0, 255]),
        (inside, -inside, [255, 0, 255]),
        (inside, inside, [255, 255, 255]),
        (-inside, inside, [0, 255, 255]),
    ] {
        let fits = at(x, y).iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 30);
        assert!(fits, "{:?}, not {expected:?}", at(x, y));
    }
    assert_eq!(off(&loaded, &view), 0);
    assert_the_same_everywhere("a cube of colours", &loaded, &view);
    // The same in whole numbers up to 255, with a warning.
    let bytes: String = CUBE
        .lines()
        .map(|line| {
            let (place, color) = line.split_at(line.match_indices(' ').nth(3).unwrap().0);
            format!("{place}{}\n", color.replace('1', "255"))
        })
        .collect();
    std::fs::write(folder.path().join("bytes.obj"), obj.replace(CUBE, &bytes)).unwrap();
    std::fs::write(folder.path().join("shares.obj"), &obj).unwrap();
    let [bytes, shares] = ["bytes.obj", "shares.obj"].map(|file| load(&folder.path().join(file)).unwrap());
    assert!(bytes.warnings[0].contains("255"), "{:?}", bytes.warnings);
    assert_eq!((bytes.scene, shares.warnings), (shares.scene, vec![]));
}

#[test]
fn colours_of_vertices_are_factors_of_textures_and_lit() {
    let texture = holes(32, |_, _| true);
    let mut mesh = ball(10, 14);
    let channel = |c: f64| ((c * 0.5 + 0.5) * 255.0) as u8;
    let corner = |vertex: u32| mesh.positions[vertex as usize].to_array().map(channel);
    mesh.colors = mesh.triangles.iter().map(|triangle| triangle.map(corner)).collect();
    mesh.uvs = mesh.triangles.iter().map(|_| [Vec2::ZERO, Vec2::X * 2.5, Vec2::ONE]).collect();
    let mesh = Arc::new(CompiledMesh::compile(&mesh).unwrap().0);
    let mut scene = empty(100, 70);
    scene.textures = vec![TextureMap::new(texture.id(), Filter::Bilinear)];
    let colored = Material { vertex_colors: true, ..scene.materials[0] };
    scene.materials.extend([
        colored,
        Material { texture: Some(0), ..colored },
        Material { unlit: true, ..colored },
    ]);
    let model = |x: f64, normals, materials: [u32; 2]| Model {
        mesh: mesh.id(),
        materials: materials.to_vec(),
        normals,
        translate: DVec3::new(x, 0.0, 0.0),
        rotate: DVec3::new(10.0, 20.0, 30.0),
        scale: DVec3::splat(0.6),
        group: DMat3::IDENTITY,
    };
    scene.models = vec![
        model(-1.3, NormalMode::Smooth, [3, 1]),
        model(0.0, NormalMode::Flat, [4, 3]),
        model(1.3, NormalMode::Flat, [5, 0]),
    ];
    scene.lights = vec![light(point(2.0, 4.0, 3.0), 0.9, Attenuation::None)];
    let loaded = loaded(scene, vec![mesh], vec![texture]);
    let view = FrameView::of(&loaded.scene);
    assert_eq!(off(&loaded, &view), 0);
    assert_the_same_everywhere("balls of colours", &loaded, &view);
}

#[test]
fn options_scale_and_offset_a_texture() {
    let folder = tempfile::tempdir().unwrap();
    // Red and green above, blue and white below.
    let colors = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]];
    save(&folder.path().join("t.png"), &RgbImage { width: 2, height: 2, pixels: colors.concat() }).unwrap();
    let obj = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3 4/4\n";
    let mtl = "newmtl a\nKd 1 1 1\nillum 0\nmap_Kd -s 3 3 1 -o 0.5 0 0 t.png\n";
    let mut loaded = model(folder.path(), obj, mtl, FROM_THE_FRONT);
    loaded.scene.textures[0].filter = Filter::Nearest;
    let view = FrameView { width: 240, height: 240, ..FrameView::of(&loaded.scene) };
    let picture = rendered(&loaded, &view);
    let scale = 120.0 / (5.0 * libm::tan(15_f64.to_radians()));
    // Six by six texels fill the square: the centre of each.
    for (i, j) in (0..6).flat_map(|j| (0..6).map(move |i| (i, j))) {
        let place = |index: u32| (f64::from(index) + 0.5) / 3.0 - 1.0;
        let (x, y) = (120.0 + place(i) * scale, 120.0 - place(j) * scale);
        let (column, row) = ((i + 1) % 2, 1 - j % 2);
        let expected = colors[(row * 2 + column) as usize];
        assert_eq!(picture.pixel(x as u32, y as u32), Some(expected), "{i} {j}");
    }
}

#[test]
fn every_wrap_scale_and_offset_matches_the_oracle() {
    let picture = holes(13, |_, _| true);
    let skewed = [[-1.3, 0.2], [2.1, -0.4], [1.7, 2.3], [-0.2, 1.1]];
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        for (scale, offset) in [(Vec2::ONE, Vec2::ZERO), (Vec2::new(-1.7, 0.6), Vec2::new(0.3, -2.2))] {
            for filter in [Filter::Nearest, Filter::Bilinear] {
                let mut scene = empty(70, 50);
                let tiling = Tiling { wrap, scale, offset };
                scene.textures = vec![TextureMap { texture: picture.id(), filter, tiling }];
                scene.materials[0] = Material { texture: Some(0), ..scene.materials[1] };
                scene.triangles.extend(square(
                    |x, y| DVec3::new(x * 2.7 - 1.3, y * 2.0 - 1.0, x * 0.7),
                    skewed,
                    0,
                ));
                scene.ambient = Vec3::ONE;
                let triangles = loaded(scene.clone(), vec![], vec![Arc::clone(&picture)]);
                // The same as a mesh, with its whole repeats.
                let mesh = mesh_of(&scene.triangles);
                let model = Model {
                    mesh: mesh.id(),
                    materials: vec![0],
                    normals: NormalMode::Flat,
                    translate: DVec3::ZERO,
                    rotate: DVec3::ZERO,
                    scale: DVec3::ONE,
                    group: DMat3::IDENTITY,
                };
                (scene.models, scene.triangles) = (vec![model], vec![]);
                let instance = loaded(scene, vec![mesh], vec![Arc::clone(&picture)]);
                let view = FrameView::of(&instance.scene);
                // Between two texels without a filter, rounding decides.
                let allowed = if filter == Filter::Nearest { 2 } else { 0 };
                for case in [&triangles, &instance] {
                    let off = off(case, &view);
                    assert!(off <= allowed, "{wrap:?} {scale} {filter:?}: {off} pixels differ");
                }
                let expected = Oracle::new(&triangles.scene, &[], &triangles.textures, &view).render();
                let found = rendered(&instance, &view);
                let pairs = expected.pixels.chunks_exact(3).zip(found.pixels.chunks_exact(3));
                let differ =
                    pairs.filter(|(a, b)| a.iter().zip(b.iter()).any(|(a, b)| a.abs_diff(*b) > 1)).count();
                assert!(
                    differ <= allowed + 2,
                    "{wrap:?} {scale} {filter:?}: {differ} pixels differ from the triangles'"
                );
            }
        }
    }
}
