//! Textures: sharing, cut-outs, tiling, bounds.

use super::*;

#[test]
fn textures_are_loaded_once_and_only_where_they_are_used() {
    let scene = "[material.unused]\ndiffuse = { texture = \"no such.png\" }\n\
                 [material.again]\ndiffuse = { texture = \"./tile.png\" }\n\
                 [material.plain]\ndiffuse = [1, 0, 0]\n\
                 [[model]]\nfile = \"m/a.obj\"\n[[model]]\nfile = \"m/a.obj\"\nmaterial = \"plain\"\n\
                 [[model]]\nfile = \"m/bare.obj\"\nmaterial = \"plain\"\n\
                 [[triangle]]\nvertices = [[0,0,0],[1,0,0],[0,1,0]]\nuvs = [[0,0],[1,0],[0,1]]\nmaterial = \"tiled\"\n\
                 [[triangle]]\nvertices = [[0,0,0],[1,0,0],[0,1,0]]\nuvs = [[0,0],[1,0],[0,1]]\nmaterial = \"again\"\n";
    let LoadedScene { scene, meshes, textures, warnings, .. } =
        wooden(&format!("{TILED}{scene}")).load("s.toml");
    assert_eq!(warnings, [""; 0]);
    assert_eq!(textures.len(), 2);
    assert_eq!(scene.textures.len(), 3, "one picture twice, with two filters");
    assert_eq!(scene.texture_ids(), textures.iter().map(|texture| texture.id()).collect());
    let texture_of = |material: u32| {
        scene.materials[material as usize].texture.map(|index| scene.textures[index as usize])
    };
    let tiled = texture_of(scene.triangles[0].material).unwrap();
    let again = texture_of(scene.triangles[1].material).unwrap();
    assert_eq!((tiled.filter, again.filter), (Filter::Nearest, Filter::Bilinear));
    assert_eq!(tiled.texture, again.texture);
    assert!(texture_of(scene.models[0].materials[0]).is_some_and(|map| map.texture != tiled.texture));
    assert_eq!(texture_of(scene.models[1].materials[0]), None);
    // A mesh has texture coordinates only where a material with a texture is assigned to it.
    let with_uvs =
        |model: usize| meshes.iter().find(|m| m.id() == scene.models[model].mesh).unwrap().has_uvs();
    assert!(with_uvs(0) && !with_uvs(2));
}

#[test]
fn a_texture_of_the_scene_needs_texture_coordinates() {
    let model = |file: &str| format!("{TILED}[[model]]\nfile = \"{file}\"\nmaterial = \"tiled\"\n");
    let LoadedScene { scene, meshes, textures, .. } = wooden(&model("m/a.obj")).load("s.toml");
    assert!(meshes[0].has_uvs());
    assert_eq!((textures.len(), scene.textures[0].filter), (1, Filter::Nearest));
    let message = wooden(&model("m/bare.obj")).refusal("s.toml");
    assert!(message.starts_with("s.toml:8:12: `material` in [[model]] has a texture"), "{message}");
    assert!(message.contains("m/bare.obj"), "{message}");
}

#[test]
fn an_unreadable_texture_is_reported_at_its_name() {
    let triangle =
        "[[triangle]]\nvertices = [[0,0,0],[1,0,0],[0,1,0]]\nuvs = [[0,0],[1,0],[0,1]]\nmaterial = \"a\"\n";
    let with =
        |file: &str| wooden(&format!("[material.a]\ndiffuse = {{ texture = \"{file}\" }}\n{triangle}"));
    let message = with("none.png").refusal("s.toml");
    assert!(message.starts_with("s.toml:5:23: the texture: cannot read none.png: "), "{message}");
    let message = with("m/a.obj").refusal("s.toml");
    assert!(message.contains("m/a.obj"), "{message}");
    let folder = with("huge.ppm");
    std::fs::write(folder.path("huge.ppm"), "P6\n16000 9000\n255\nabc").unwrap();
    let message = folder.refusal("s.toml");
    assert!(message.contains("huge.ppm: a texture of 16000 x 9000"), "{message}");
}

/// A picture with alpha: two columns, the right one transparent if `cut`.
fn save_alpha(path: &Path, cut: bool) {
    let alpha = |x: u32| if cut && x == 1 { 100 } else { 200 };
    let picture = ::image::RgbaImage::from_fn(2, 2, |x, _| ::image::Rgba([200, 100, 50, alpha(x)]));
    picture.save(path).unwrap();
}

#[test]
fn alpha_cuts_out_only_where_it_is_below_one_half() {
    let triangle = "[[triangle]]\nvertices = [[0,0,0],[1,0,0],[0,1,0]]\nuvs = [[0,0],[1,0],[0,1]]\nmaterial = \"tiled\"\n";
    for cut in [false, true] {
        let folder = wooden(&format!("{TILED}{triangle}[[model]]\nfile = \"m/a.obj\"\n"));
        let opaque = folder.load("s.toml");
        save_alpha(&folder.path("tile.png"), cut);
        save_alpha(&folder.path("m/maps/wood.png"), cut);
        let LoadedScene { scene, textures, .. } = folder.load("s.toml");
        for material in [scene.triangles[0].material, scene.models[0].materials[0]] {
            let material = &scene.materials[material as usize];
            assert_eq!(material.cutout, if cut { material.texture } else { None });
        }
        assert!(textures.iter().all(|texture| texture.has_alpha() == cut));
        assert!(opaque.scene.materials.iter().all(|material| material.cutout.is_none()));
    }
}

#[test]
fn map_d_cuts_out_by_alpha_or_by_brightness() {
    let folder = wooden("[[model]]\nfile = \"m/a.obj\"\n");
    let dark = RgbImage { width: 2, height: 1, pixels: vec![20, 20, 20, 250, 250, 250] };
    image::save(&folder.path("m/mask.png"), &dark).unwrap();
    save_alpha(&folder.path("m/alpha.png"), true);
    save_alpha(&folder.path("m/whole.png"), false);
    let cutout = |statements: &str| {
        std::fs::write(folder.path("m/a.mtl"), format!("newmtl wood\n{statements}")).unwrap();
        let LoadedScene { scene, textures, warnings, .. } = folder.load("s.toml");
        assert_eq!(warnings, [""; 0], "{statements}");
        let material = &scene.materials[scene.models[0].materials[0] as usize];
        let index = material.cutout?;
        let map = scene.textures[index as usize];
        let texture = textures.iter().find(|texture| texture.id() == map.texture).unwrap();
        Some([texture.alpha(0, 0), texture.alpha(1, 0)])
    };
    assert_eq!(cutout("map_Kd maps/wood.png\nmap_d mask.png\n"), Some([20, 250]));
    assert_eq!(cutout("map_d mask.png\n"), Some([20, 250]));
    assert_eq!(cutout("map_Kd maps/wood.png\nmap_d alpha.png\n"), Some([200, 100]));
    assert_eq!(cutout("map_Kd alpha.png\nmap_d alpha.png\n"), Some([200, 100]));
    // The brightness of the texture itself is no mask.
    assert_eq!(cutout("map_Kd mask.png\nmap_d mask.png\n"), None);
    // Another picture decides, whatever alpha the first one has. The brightness of this one is 118 of 255.
    assert_eq!(cutout("map_Kd alpha.png\nmap_d whole.png\n"), Some([118, 118]));
    assert_eq!(cutout("map_Kd whole.png\n"), None);
}

#[test]
fn options_of_statements_set_the_tiling() {
    let folder = wooden("[[model]]\nfile = \"m/a.obj\"\n");
    let load = |options: &str| {
        let text = format!("newmtl wood\nmap_Kd {options} maps/wood.png\n");
        std::fs::write(folder.path("m/a.mtl"), text).unwrap();
        folder.load("s.toml")
    };
    let repeated = |loaded: &LoadedScene| loaded.meshes[0].whole_repeats(0);
    let obj = format!("mtllib a.mtl\nusemtl wood\n{}f 1/1 2/2 3/3\n", SQUARE.replace("vt ", "vt -2."));
    std::fs::write(folder.path("m/a.obj"), obj).unwrap();
    let moved = load("-s 3 3 1 -o 0.5 0 0");
    let expected = Tiling { scale: Vec2::splat(3.0), offset: Vec2::new(0.5, 0.0), ..Tiling::default() };
    assert_eq!(moved.scene.textures[0].tiling, expected);
    // Whole repeats make no difference then.
    assert_eq!(repeated(&moved), Vec2::ZERO);
    let clamped = load("-clamp on");
    assert_eq!(clamped.scene.textures[0].tiling, Tiling { wrap: Wrap::Clamp, ..Tiling::default() });
    assert_eq!(repeated(&clamped), Vec2::new(-3.0, 0.0));
    assert_eq!(repeated(&load("-s 1.5")), Vec2::new(-3.0, 0.0));
    assert_eq!(repeated(&load("")), Vec2::ZERO);
    // A compiled model keeps them: a scene may give it any texture.
    let (mesh, _) =
        compile_model(&folder.path("m/a.obj"), &folder.path("m"), CompileOptions::default()).unwrap();
    assert_eq!(mesh.whole_repeats(0), Vec2::new(-3.0, 0.0));
}

#[test]
fn the_bytes_of_all_textures_are_bounded() {
    let folder = wooden("[[model]]\nfile = \"m/a.obj\"\n");
    let mut library = String::new();
    let mut faces = format!("mtllib a.mtl\n{SQUARE}");
    for number in 0_u8..3 {
        let picture = RgbImage { width: 700, height: 700, pixels: vec![number; 3 * 700 * 700] };
        image::save(&folder.path(&format!("m/{number}.png")), &picture).unwrap();
        library += &format!("newmtl m{number}\nmap_Kd {number}.png\n");
        faces += &format!("usemtl m{number}\nf 1/1 2/2 3/3\nv {number} 5 5\nf 1/1 2/2 -1/3\n");
    }
    std::fs::write(folder.path("m/a.mtl"), library).unwrap();
    std::fs::write(folder.path("m/a.obj"), faces).unwrap();
    let limits = LoadLimits { texture_bytes: 4 << 20, ..LoadLimits::default() };
    let loaded = load_limited(&folder.path("m/a.obj"), LoadOptions::default(), limits).unwrap();
    let LoadedScene { textures, warnings, .. } = loaded;
    let about: Vec<&String> = warnings.iter().filter(|warning| warning.contains("2.png")).collect();
    assert_eq!((textures.len(), about.len()), (2, 1), "{warnings:?}");
    assert!(about[0].contains("4 MiB"), "{about:?}");
}
