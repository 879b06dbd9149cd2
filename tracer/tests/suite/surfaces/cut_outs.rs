//! Cut-outs by alpha, and their shadows.

use super::*;

fn disc(x: f64, y: f64) -> bool {
    (x - 0.5).hypot(y - 0.5) < 0.4
}

/// Leaves over a floor: of the scene file, of a smooth mesh and of one with two slots, one of them without holes.
fn leaves(width: u32, height: u32, filter: Filter) -> LoadedScene {
    let texture = holes(24, disc);
    let mut scene = empty(width, height);
    scene.textures = vec![TextureMap::new(texture.id(), filter)];
    let leaf = Material { texture: Some(0), cutout: Some(0), ..scene.materials[1] };
    scene.materials.extend([leaf, Material { texture: None, ..leaf }]);
    scene.planes = vec![Plane { point: DVec3::NEG_Y, normal: DVec3::Y, material: 2, size: 1.0 }];
    scene.triangles.extend(square(|x, y| DVec3::new(x * 1.1 - 1.7, y * 1.2 - 0.6, 0.4 - x * 0.3), WHOLE, 3));
    scene.triangles.extend(square(|x, y| DVec3::new(x * 1.3 - 1.9, y * 1.2 - 0.7, -0.4), WHOLE, 4));
    let mut mesh = ball(8, 12);
    let uv = |p: DVec3| DVec2::new(libm::atan2(p.z, p.x) * 0.7, p.y * 1.1);
    let uvs = mesh.triangles.iter().map(|t| t.map(|vertex| uv(mesh.positions[vertex as usize])));
    (mesh.uvs, mesh.uv_repeats) = uvs.map(|uvs| split_repeats(uvs).unwrap()).unzip();
    let mesh = Arc::new(CompiledMesh::compile(&mesh).unwrap().0);
    let model = |x: f64, scale: [f64; 3], normals, materials: [u32; 2]| Model {
        mesh: mesh.id(),
        materials: materials.to_vec(),
        normals,
        translate: DVec3::new(x, 0.1, 0.2),
        rotate: DVec3::new(20.0, 30.0, 10.0),
        scale: scale.into(),
        group: glam::DMat3::IDENTITY,
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
fn cut_outs_and_their_shadows_match_the_oracle() {
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

/// The same scene without holes.
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
fn single_rays_pass_holes_like_tiles() {
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
        // A surface behind a hole is hit again from the hole on.
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
    // Surrounded by transparent black, as programs write it.
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
    loaded.scene.planes = vec![Plane { point: DVec3::NEG_Y, normal: DVec3::Y, material, size: 1.0 }];
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
fn without_holes_alpha_changes_nothing() {
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
