//! What surfaces show beside reflected light, from the file to the pixel: colours as they are, light of their own, colours of
//! vertices, textures that lie elsewhere, and holes.

use std::path::Path;
use std::sync::Arc;

use crate::common::{ball, empty, light, point, render_textured};
use ::image::{Rgba, RgbaImage};
use glam::{DVec2, DVec3, Vec2, Vec3};
use rayfarm_tracer::image::{RgbImage, save};
use rayfarm_tracer::mesh::{CompiledMesh, Mesh, NamedMaterial};
use rayfarm_tracer::numerics::{self, Effort, Subject};
use rayfarm_tracer::reference::Oracle;
use rayfarm_tracer::scene::{
    Attenuation, Background, Filter, FrameView, LightKind, LoadedScene, Material, Model, NormalMode, Plane,
    Quality, Scene, Sphere, TextureMap, Tiling, Triangle, Wrap, load,
};
use rayfarm_tracer::srgb;
use rayfarm_tracer::texture::{Texture, apart_from_repeats};
use rayfarm_tracer::{CompiledScene, PreparedFrame, Primitive, render_rows};

/// A scene with its meshes and textures, as the loader gives it.
fn loaded(scene: Scene, meshes: Vec<Arc<CompiledMesh>>, textures: Vec<Arc<Texture>>) -> LoadedScene {
    LoadedScene { scene, meshes, mesh_files: vec![], textures, warnings: vec![] }
}

fn rendered(loaded: &LoadedScene, view: &FrameView) -> RgbImage {
    render_textured(&loaded.scene, &loaded.meshes, &loaded.textures, view).0
}

fn frame(loaded: &LoadedScene, view: &FrameView) -> PreparedFrame {
    let (meshes, textures) = (loaded.meshes.iter().cloned(), loaded.textures.iter().cloned());
    let compiled = CompiledScene::new(loaded.scene.clone(), meshes, textures).unwrap();
    PreparedFrame::new(Arc::new(compiled), view).unwrap()
}

/// Pixels that differ from the oracle's by more than a step.
fn off(loaded: &LoadedScene, view: &FrameView) -> usize {
    let picture = rendered(loaded, view);
    let expected = Oracle::new(&loaded.scene, &loaded.meshes, &loaded.textures, view).render();
    let pairs = picture.pixels.chunks_exact(3).zip(expected.pixels.chunks_exact(3));
    pairs.filter(|(a, b)| a.iter().zip(b.iter()).any(|(a, b)| a.abs_diff(*b) > 1)).count()
}

/// Every level of SIMD, every cut, and adaptive frames as well, give the same bytes.
fn assert_the_same_everywhere(what: &str, loaded: &LoadedScene, view: &FrameView) {
    let copy = LoadedScene {
        scene: loaded.scene.clone(),
        meshes: loaded.meshes.clone(),
        mesh_files: vec![],
        textures: loaded.textures.clone(),
        warnings: vec![],
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

/// A picture without order whose alpha is above one half where `solid` says so, both from 0 to 1.
fn holes(side: u32, solid: impl Fn(f64, f64) -> bool) -> Arc<Texture> {
    let noise = |i: u32| (i.wrapping_mul(0x9e37_79b1).rotate_left(13).wrapping_mul(0x85eb_ca6b) >> 24) as u8;
    let pixels = (0..side * side * 3).map(noise).collect();
    let share = |i: u32| (f64::from(i) + 0.5) / f64::from(side);
    let alpha = (0..side * side).map(|i| {
        // Not only all or nothing: what lies between is found by the filter.
        let strength = 90 + noise(i) / 4;
        if solid(share(i % side), 1.0 - share(i / side)) { 255 - strength } else { strength }
    });
    let alpha: Vec<u8> = alpha.collect();
    Arc::new(Texture::with_alpha(&RgbImage { width: side, height: side, pixels }, &alpha).unwrap())
}

fn disc(x: f64, y: f64) -> bool {
    (x - 0.5).hypot(y - 0.5) < 0.4
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

const FROM_THE_FRONT: &str = "[render]\nwidth = 64\nheight = 64\n\
                              [camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\nfov = 30\n\
                              [[light]]\nkind = \"point\"\nposition = [3, 4, 6]\nshadows = true\n";

#[test]
fn illum_0_is_the_colour_itself_and_ke_glows_on_its_front() {
    let folder = tempfile::tempdir().unwrap();
    let text = "newmtl flat\nKd 0.8 0.1 0.1\nKs 1 1 1\nillum 0\nnewmtl lamp\nKd 0 0 0\nKe 1 0.6 0.1\n\
                newmtl both\nKd 0.25 0.5 0.25\nKe 0.25 0 0\nillum 0\n";
    // Three stripes beside each other; the second lamp shows its back.
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
fn lights_of_their_own_shine_through_textures_on_every_shape_and_light_nothing() {
    let texture = holes(16, |_, _| true);
    let mut scene = empty(80, 60);
    let lamp =
        Material { diffuse: Vec3::splat(0.1), emission: Vec3::new(0.7, 0.3, 0.2), ..scene.materials[1] };
    scene.textures = vec![TextureMap::new(texture.id(), Filter::Bilinear)];
    scene.materials.extend([lamp, Material { emission_texture: Some(0), ..lamp }]);
    scene.materials.push(Material { texture: Some(0), unlit: true, ..scene.materials[0] });
    scene.spheres = vec![Sphere { center: DVec3::new(-0.8, 0.2, 0.5), radius: 0.4, material: 3 }];
    scene.planes = vec![Plane { point: DVec3::NEG_Y, normal: DVec3::NEG_Y, material: 3 }];
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
    };
    // From inside nothing glows; a mirrored one keeps its front outside.
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
    // The front face, z = 1, at 4 from the eye.
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
    // The same in whole numbers up to 255, which is said.
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
    assert!(bytes.warnings[0].contains("taken to be from 0 to 255"), "{:?}", bytes.warnings);
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
fn options_lay_three_by_three_repeats_moved_by_half_a_texture() {
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
    // Six by six texels fill the square: the middle of each.
    for (i, j) in (0..6).flat_map(|j| (0..6).map(move |i| (i, j))) {
        let place = |index: u32| (f64::from(index) + 0.5) / 3.0 - 1.0;
        let (x, y) = (120.0 + place(i) * scale, 120.0 - place(j) * scale);
        let (column, row) = ((i + 1) % 2, 1 - j % 2);
        let expected = colors[(row * 2 + column) as usize];
        assert_eq!(picture.pixel(x as u32, y as u32), Some(expected), "{i} {j}");
    }
}

#[test]
fn every_wrap_scale_and_offset_is_the_oracles() {
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
                // The same as a mesh, whose whole repeats are kept apart.
                let mesh = mesh_of(&scene.triangles);
                let model = Model {
                    mesh: mesh.id(),
                    materials: vec![0],
                    normals: NormalMode::Flat,
                    translate: DVec3::ZERO,
                    rotate: DVec3::ZERO,
                    scale: DVec3::ONE,
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

/// Triangles of a scene as a mesh, with whole repeats apart.
fn mesh_of(triangles: &[Triangle]) -> Arc<CompiledMesh> {
    let uvs = |triangle: &Triangle| {
        apart_from_repeats(triangle.uvs.unwrap().map(|uv: Vec2| uv.as_dvec2())).unwrap()
    };
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

/// Leaves over a floor: of the scene file, of a smooth mesh and of one in two slots, of which one is whole.
fn leaves(width: u32, height: u32, filter: Filter) -> LoadedScene {
    let texture = holes(24, disc);
    let mut scene = empty(width, height);
    scene.textures = vec![TextureMap::new(texture.id(), filter)];
    let leaf = Material { texture: Some(0), cutout: Some(0), ..scene.materials[1] };
    scene.materials.extend([leaf, Material { texture: None, ..leaf }]);
    scene.planes = vec![Plane { point: DVec3::NEG_Y, normal: DVec3::Y, material: 2 }];
    scene.triangles.extend(square(|x, y| DVec3::new(x * 1.1 - 1.7, y * 1.2 - 0.6, 0.4 - x * 0.3), WHOLE, 3));
    scene.triangles.extend(square(|x, y| DVec3::new(x * 1.3 - 1.9, y * 1.2 - 0.7, -0.4), WHOLE, 4));
    let mut mesh = ball(8, 12);
    let uv = |p: DVec3| DVec2::new(libm::atan2(p.z, p.x) * 0.7, p.y * 1.1);
    let uvs = mesh.triangles.iter().map(|t| t.map(|vertex| uv(mesh.positions[vertex as usize])));
    (mesh.uvs, mesh.uv_repeats) = uvs.map(|uvs| apart_from_repeats(uvs).unwrap()).unzip();
    let mesh = Arc::new(CompiledMesh::compile(&mesh).unwrap().0);
    let model = |x: f64, scale: [f64; 3], normals, materials: [u32; 2]| Model {
        mesh: mesh.id(),
        materials: materials.to_vec(),
        normals,
        translate: DVec3::new(x, 0.1, 0.2),
        rotate: DVec3::new(20.0, 30.0, 10.0),
        scale: scale.into(),
    };
    scene.models = vec![
        model(0.5, [0.7, 0.9, -0.7], NormalMode::Smooth, [3, 4]),
        model(1.6, [0.5; 3], NormalMode::Flat, [3, 0]),
    ];
    let sun = LightKind::Directional { direction: DVec3::new(-0.3, -0.8, -0.4).normalize() };
    scene.lights = vec![
        light(point(2.0, 4.0, 3.0), 0.6, Attenuation::None),
        light(point(0.4, 0.2, 0.3), 0.3, Attenuation::None),
        light(sun, 0.3, Attenuation::None),
    ];
    loaded(scene, vec![mesh], vec![texture])
}

#[test]
fn cut_outs_and_their_shadows_are_the_oracles() {
    for filter in [Filter::Nearest, Filter::Bilinear] {
        let leaves = leaves(120, 90, filter);
        for samples in [1, 4] {
            let view = FrameView { samples, ..FrameView::of(&leaves.scene) };
            let off = off(&leaves, &view);
            // Along the edges of holes and texels, rounding decides.
            assert!(off <= 12, "{filter:?}, {samples} samples: {off} pixels differ");
        }
        let solid = solid(&leaves);
        let view = FrameView::of(&solid.scene);
        let (with, without) = (rendered(&leaves, &view), rendered(&solid, &view));
        let changed =
            with.pixels.chunks_exact(3).zip(without.pixels.chunks_exact(3)).filter(|(a, b)| a != b).count();
        assert!(changed > 1000, "{changed} pixels say little");
    }
}

/// The same without its holes.
fn solid(leaves: &LoadedScene) -> LoadedScene {
    let mut scene = leaves.scene.clone();
    scene.materials.iter_mut().for_each(|material| material.cutout = None);
    loaded(scene, leaves.meshes.clone(), leaves.textures.clone())
}

#[test]
fn cut_outs_are_the_same_on_every_level_in_every_cut_and_adaptively() {
    for filter in [Filter::Nearest, Filter::Bilinear] {
        let leaves = leaves(120, 90, filter);
        assert_the_same_everywhere("leaves", &leaves, &FrameView::of(&leaves.scene));
    }
}

#[test]
fn single_rays_go_through_holes_as_tiles_do() {
    let leaves = leaves(160, 120, Filter::Bilinear);
    let view = FrameView::of(&leaves.scene);
    let (with, without) = (frame(&leaves, &view), frame(&solid(&leaves), &view));
    let eye = leaves.scene.camera.position;
    let mut through = 0;
    for (i, j) in (0..60).flat_map(|j| (0..80).map(move |i| (i, j))) {
        let direction = DVec3::new(f64::from(i) * 0.02 - 0.8, f64::from(j) * 0.015 - 0.55, -1.0);
        let hit = with.closest_hit(eye, direction, f64::INFINITY);
        let solid = without.closest_hit(eye, direction, f64::INFINITY);
        let t = |hit: Option<rayfarm_tracer::RayHit>| hit.map_or(f64::INFINITY, |hit| hit.t);
        assert!(t(hit) >= t(solid));
        through += usize::from(t(hit) > t(solid));
        assert_eq!(with.any_hit(eye, direction, f64::INFINITY), hit.is_some());
        // What lies behind a hole is found again from there.
        if let Some(hit) = hit {
            let short = with.closest_hit(eye, direction, hit.t * (1.0 - 1e-9));
            assert_eq!(short.map(|hit| hit.primitive), None);
            assert!(!with.any_hit(eye, direction, hit.t * (1.0 - 1e-9)));
        }
    }
    assert!(through > 300, "{through} rays say little");
}

#[test]
fn a_leaf_is_a_green_disc_on_nothing_and_its_shadow_has_its_shape() {
    let folder = tempfile::tempdir().unwrap();
    let inside = |x: u32, y: u32| (f64::from(x) - 31.5).hypot(f64::from(y) - 31.5) < 28.0;
    // Transparent black around, as programs write it.
    let leaf =
        RgbaImage::from_fn(64, 64, |x, y| if inside(x, y) { Rgba([40, 160, 40, 255]) } else { Rgba([0; 4]) });
    leaf.save(folder.path().join("leaf.png")).unwrap();
    let obj = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3 4/4\n";
    for mtl in [
        "newmtl a\nKd 1 1 1\nillum 0\nmap_Kd leaf.png\nmap_d leaf.png\n",
        "newmtl a\nillum 0\nmap_Kd leaf.png\n",
    ] {
        let mut loaded = model(folder.path(), obj, mtl, FROM_THE_FRONT);
        loaded.scene.background = Background::Color(Vec3::new(0.0, 0.0, 1.0));
        let view = FrameView::of(&loaded.scene);
        let picture = rendered(&loaded, &view);
        let scale = 32.0 / (5.0 * libm::tan(15_f64.to_radians()));
        let mut green = 0;
        for (x, y) in (0..64).flat_map(|y| (0..64).map(move |x| (x, y))) {
            let [across, up] = [f64::from(x) - 31.5, 31.5 - f64::from(y)].map(|c| c / scale);
            let pixel = picture.pixel(x, y).unwrap();
            // No dark rim: there are two colours.
            assert!(pixel == [40, 160, 40] || pixel == [0, 0, 255], "{pixel:?} at {x}, {y}");
            let distance = across.hypot(up) - 28.0 / 32.0;
            if distance.abs() > 0.06 {
                assert_eq!(pixel == [40, 160, 40], distance < 0.0, "at {x}, {y}");
            }
            green += usize::from(pixel == [40, 160, 40]);
        }
        assert!(green > 1000, "{green}");
    }
    // From above, through the leaf on to a floor.
    let mut loaded = model(folder.path(), obj, "newmtl a\nmap_Kd leaf.png\n", FROM_THE_FRONT);
    loaded.scene.models[0].rotate = DVec3::new(-90.0, 0.0, 0.0);
    loaded.scene.materials.push(Material { diffuse: Vec3::ONE, specular: Vec3::ZERO, ..Material::NEUTRAL });
    let material = loaded.scene.materials.len() as u32 - 1;
    loaded.scene.planes = vec![Plane { point: DVec3::NEG_Y, normal: DVec3::Y, material }];
    let sun = LightKind::Directional { direction: DVec3::NEG_Y };
    loaded.scene.lights = vec![light(sun, 1.0, Attenuation::None)];
    let frame = frame(&loaded, &FrameView::of(&loaded.scene));
    for (x, z) in [(0.0, 0.0), (0.8, 0.0), (0.95, 0.95), (-0.9, 0.9), (0.0, -0.83), (0.0, -0.93)] {
        let distance = f64::hypot(x, z) - 28.0 / 32.0;
        let dark = frame.any_hit(DVec3::new(x, -0.999, z), DVec3::Y, f64::INFINITY);
        assert_eq!(dark, distance < 0.0, "{x} {z}");
        let below = frame.closest_hit(DVec3::new(x, 3.0, z), DVec3::NEG_Y, f64::INFINITY).unwrap();
        assert_eq!(matches!(below.primitive, Primitive::Plane(0)), distance > 0.0, "{x} {z}");
    }
}

#[test]
fn without_holes_a_texture_with_alpha_is_the_texture() {
    let folder = tempfile::tempdir().unwrap();
    let opaque = RgbaImage::from_fn(8, 8, |x, y| Rgba([(x * 30) as u8, (y * 30) as u8, 9, 200]));
    opaque.save(folder.path().join("a.png")).unwrap();
    let rgb = ::image::DynamicImage::ImageRgba8(opaque).into_rgb8();
    rgb.save(folder.path().join("b.png")).unwrap();
    let obj = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nusemtl a\nf 1/1 2/2 3/3\n";
    let of = |file: &str| model(folder.path(), obj, &format!("newmtl a\nmap_Kd {file}\n"), FROM_THE_FRONT);
    let (with, without) = (of("a.png"), of("b.png"));
    assert_eq!(with.textures[0].id(), without.textures[0].id());
    assert_eq!(
        (&with.scene.materials, &with.scene.textures),
        (&without.scene.materials, &without.scene.textures)
    );
    let view = FrameView::of(&with.scene);
    assert!(rendered(&with, &view) == rendered(&without, &view));
}
