use glam::{DVec3, Vec2, Vec3};

use super::super::{Attenuation, Filter, LightKind, Tiling, Wrap};
use super::*;
use crate::image::{self, RgbImage};
use crate::mesh::TextureFile;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
const CAMERA: &str = "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\n";

struct Folder(tempfile::TempDir);

impl Folder {
    fn with(files: &[(&str, &str)]) -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        for (name, content) in files {
            std::fs::create_dir_all(folder.path(name).parent().unwrap()).unwrap();
            std::fs::write(folder.path(name), content).unwrap();
        }
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn load(&self, name: &str) -> LoadedScene {
        load(&self.path(name)).unwrap()
    }

    /// The message of a refusal, with paths relative to the folder.
    fn refusal(&self, name: &str) -> String {
        let message = load(&self.path(name)).unwrap_err().to_string();
        message.replace(&format!("{}{}", self.0.path().display(), std::path::MAIN_SEPARATOR), "")
    }
}

#[test]
fn faults_name_file_line_and_column() {
    let folder = Folder::with(&[("scene.toml", "[camera]\nposition = [0, 0, 4]\n  fof = 3\n")]);
    assert_eq!(
        folder.refusal("scene.toml"),
        "scene.toml:3:3: unknown key `fof` in [camera]; did you mean `fov`?"
    );
}

#[test]
fn a_missing_model_is_told_at_its_name() {
    let folder = Folder::with(&[("s.toml", &format!("{CAMERA}[[model]]\nfile = \"no/bust.obj\"\n"))]);
    let message = folder.refusal("s.toml");
    assert!(message.starts_with("s.toml:5:8: cannot read the model no/bust.obj: "), "{message}");
    assert!(message.contains("relative to the scene file"), "{message}");
}

#[test]
fn faults_of_a_model_name_the_model() {
    let scene = format!("{CAMERA}[[model]]\nfile = \"m/a.obj\"\n");
    let folder = Folder::with(&[("s.toml", &scene), ("m/a.obj", "v 0 0 0\nf 1 2 3\n")]);
    let message = folder.refusal("s.toml");
    assert!(message.starts_with("m/a.obj:2: the face names vertex 3"), "{message}");

    let flat = "v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n";
    let folder = Folder::with(&[("a.obj", flat)]);
    let message = folder.refusal("a.obj");
    assert!(message.starts_with("a.obj: the mesh has no triangle left"), "{message}");
}

#[test]
fn other_files_are_no_models() {
    let folder = Folder::with(&[
        ("gltf.toml", &format!("{CAMERA}[[model]]\nfile = \"a.glb\"\n")),
        ("a.glb", "glTF"),
        ("scene.toml", &format!("{CAMERA}[[model]]\nfile = \"gltf.toml\"\n")),
        ("broken.rfm", "RFMESH and more"),
    ]);
    assert!(folder.refusal("gltf.toml").contains("a.glb: this is a glTF model (.glb)"));
    assert!(folder.refusal("scene.toml").contains("gltf.toml: a scene file, where a model was expected"));
    let message = folder.refusal("broken.rfm");
    assert!(message.starts_with("broken.rfm: not a compiled model"), "{message}");
}

#[test]
fn text_that_is_no_utf8_is_told_with_its_place() {
    let folder = Folder::with(&[]);
    std::fs::write(folder.path("s.toml"), b"# ok\n# \xff\n").unwrap();
    assert!(folder.refusal("s.toml").starts_with("s.toml:2:3: not valid UTF-8"));
}

#[test]
fn models_that_name_one_file_share_it() {
    let scene = format!(
        "{CAMERA}[material.red]\ndiffuse = [1, 0, 0]\n\
         [[model]]\nfile = \"m/a.obj\"\n[[model]]\nfile = \"./m/../m/a.obj\"\nmaterial = \"red\"\n\
         [[model]]\nfile = \"copy.obj\"\nnormals = \"flat\"\n[[model]]\nfile = \"m/a.obj\"\nnormals = \"flat\"\n"
    );
    let green = "mtllib a.mtl\nusemtl green\n";
    let folder = Folder::with(&[
        ("s.toml", &scene),
        ("m/a.obj", &format!("{green}{TRIANGLE}")),
        ("m/a.mtl", "newmtl green\nKd 0 1 0\n"),
        ("copy.obj", &TRIANGLE.replace("0 1 0", "0 9 0")),
    ]);
    let LoadedScene { scene, meshes, mesh_files, textures, warnings } = folder.load("s.toml");
    assert_eq!(mesh_files, [PathBuf::from("m/a.obj"), PathBuf::from("copy.obj")]);
    assert!(textures.is_empty());
    assert_eq!(warnings, [""; 0]);
    assert_eq!(meshes.len(), 2);
    let [own, red, copy, again] = &scene.models[..] else { panic!("four models") };
    assert_eq!(own.mesh, red.mesh);
    assert_eq!(own.mesh, again.mesh);
    assert_ne!(own.mesh, copy.mesh);
    let diffuse = |model: &Model| scene.materials[model.materials[0] as usize].diffuse;
    assert_eq!(diffuse(own), Vec3::Y);
    assert_eq!(diffuse(red), Vec3::X);
    assert_eq!(diffuse(copy), Material::NEUTRAL.diffuse);
    assert_eq!(own.materials, again.materials);
    assert_eq!(scene.mesh_ids(), meshes.iter().map(|mesh| mesh.id()).collect());
    // A mesh that is only drawn flat carries no normals.
    let with_normals = |model: &Model| meshes.iter().find(|m| m.id() == model.mesh).unwrap().has_normals();
    assert!(with_normals(own) && !with_normals(copy));
}

#[test]
fn warnings_of_scene_and_models_are_gathered() {
    let scene = format!("{CAMERA}view_height = 3\n[[model]]\nfile = \"a.obj\"\n");
    let text = format!("{TRIANGLE}f 1 2 3\nf 1 1 2\nhello\n");
    let folder = Folder::with(&[("s.toml", &scene), ("a.obj", &text)]);
    let warnings = folder.load("s.toml").warnings;
    assert_eq!(warnings.len(), 3, "{warnings:#?}");
    assert!(warnings[0].contains("s.toml:4:15: `view_height` in [camera] has no effect"), "{warnings:#?}");
    assert!(warnings[1].contains("a.obj:7: unknown statement `hello`"), "{warnings:#?}");
    assert!(warnings[2].contains("1 without an area, 1 that repeat another, 0 not finite"), "{warnings:#?}");
}

#[test]
fn what_the_file_leaves_open_is_decided() {
    let folder = Folder::with(&[
        (
            "aim.toml",
            "[camera]\nposition = [0, 0, 9]\nrotation = [0, 0, 0]\n[[sphere]]\ncenter = [1, 0, 2]\nradius = 1\n",
        ),
        ("frame.toml", "[[sphere]]\ncenter = [5, 0, 2]\nradius = 1\n"),
        ("empty.toml", "ambient = [0, 0, 0]\n"),
    ]);
    let scene = folder.load("aim.toml").scene;
    assert_eq!(scene.camera.look_at, DVec3::new(0.0, 0.0, 2.0));
    assert_eq!(scene.lights.len(), 1);
    assert_eq!(scene.lights[0].attenuation, Attenuation::None);
    let LightKind::Point { position } = scene.lights[0].kind else { panic!("a point light") };
    assert!(position.y > 0.0 && position.x < 0.0, "{position}");

    let camera = folder.load("frame.toml").scene.camera;
    // The middle of the picture, not of the sphere: its box is seen in perspective.
    assert!((camera.look_at - DVec3::new(5.0, 0.0, 2.0)).length() < 0.5, "{}", camera.look_at);
    let message = folder.refusal("empty.toml");
    assert!(message.starts_with("empty.toml: [camera] is missing"), "{message}");
}

#[test]
fn lists_beyond_their_bounds_are_refused() {
    let planes = "[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 1, 0]\n".repeat(1025);
    let folder = Folder::with(&[("s.toml", &format!("{CAMERA}{planes}"))]);
    assert_eq!(folder.refusal("s.toml"), "s.toml:3076:1: 1025 times [[plane]], at most 1024 are allowed");
}

#[test]
fn compiled_models_are_taken_as_they_are() {
    let folder =
        Folder::with(&[("a.obj", TRIANGLE), ("s.toml", &format!("{CAMERA}[[model]]\nfile = \"b.bin\"\n"))]);
    let (mesh, warnings) =
        compile_model(&folder.path("a.obj"), &folder.path(""), CompileOptions::default()).unwrap();
    assert_eq!(warnings, [""; 0]);
    std::fs::write(folder.path("b.bin"), mesh.bytes()).unwrap();
    assert_eq!(
        compile_model(&folder.path("b.bin"), &folder.path(""), CompileOptions::default()).unwrap().0.id(),
        mesh.id()
    );
    assert_eq!(folder.load("b.bin").scene, folder.load("a.obj").scene);
    assert_eq!(folder.load("s.toml").scene.models[0].mesh, mesh.id());
}

const RIDGE: &str = "v 0 0 0\nv 1 0.5 0\nv 2 0 0\nv 0 0 1\nv 1 0.5 1\nv 2 0 1\nf 1 4 5 2\nf 2 5 6 3\n";

#[test]
fn crease_angles_are_of_each_model() {
    let model = |angle: &str| format!("[[model]]\nfile = \"a.obj\"\n{angle}");
    let scene = [
        CAMERA,
        &model(""),
        &model("crease_angle = 60\n"),
        &model("crease_angle = 60\n"),
        &model("up = \"z\"\n"),
    ];
    let folder = Folder::with(&[("a.obj", RIDGE), ("s.toml", &scene.concat())]);
    let LoadedScene { scene, meshes, warnings, .. } = folder.load("s.toml");
    assert_eq!((meshes.len(), warnings), (2, vec![]));
    let [sharp, smooth, again, upright] = &scene.models[..] else { panic!("four models") };
    assert_eq!((smooth.mesh, sharp.mesh), (again.mesh, upright.mesh));
    assert_ne!(sharp.mesh, smooth.mesh);
    assert_eq!(upright.rotate, DVec3::new(-90.0, 0.0, 0.0));
    let bare = |degrees| {
        let options = LoadOptions { crease_angle: degrees, ..LoadOptions::default() };
        load_with(&folder.path("a.obj"), options).unwrap().scene.models[0].mesh
    };
    assert_eq!((bare(None), bare(Some(60.0))), (sharp.mesh, smooth.mesh));
}

#[test]
fn what_belongs_to_a_model_is_refused_for_others() {
    let up = LoadOptions { up: Some(Up::Z), ..LoadOptions::default() };
    let crease = LoadOptions { crease_angle: Some(60.0), ..LoadOptions::default() };
    let scene = format!("{CAMERA}[[model]]\nfile = \"a.rfm\"\ncrease_angle = 60\n");
    let folder = Folder::with(&[("a.obj", RIDGE), ("s.toml", &scene)]);
    let (mesh, _) =
        compile_model(&folder.path("a.obj"), &folder.path(""), CompileOptions::default()).unwrap();
    std::fs::write(folder.path("a.rfm"), mesh.bytes()).unwrap();
    let message = |file: &str, options| load_with(&folder.path(file), options).unwrap_err().to_string();
    assert!(message("s.toml", up).contains("write `up = \"z\"` in [[model]] of the scene file"));
    assert!(message("s.toml", crease).contains("write `crease_angle` in [[model]]"));
    assert!(message("a.rfm", crease).contains("give --crease-angle to `rayfarm-master compile`"));
    let warnings = folder.load("s.toml").warnings;
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].contains("s.toml:6:16: `crease_angle` in [[model]] has no effect"), "{warnings:?}");
}

#[test]
fn a_tower_stands_up_from_its_file_and_compiled() {
    let tower = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nv 0 0 6\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n";
    let folder = Folder::with(&[("a.obj", tower)]);
    let up = LoadOptions { up: Some(Up::Z), ..LoadOptions::default() };
    let bounds = |file: &str, options| {
        let LoadedScene { scene, meshes, .. } = load_with(&folder.path(file), options).unwrap();
        framing::bounds(&scene, &meshes).unwrap()
    };
    let compile = |options| {
        let (from, to) = (folder.path("a.obj"), folder.path(""));
        compile_model_with(&from, &to, CompileOptions::default(), options).unwrap().0
    };
    let standing = (DVec3::new(-1.0, 0.0, -1.0), DVec3::new(1.0, 6.0, 1.0));
    assert_eq!(bounds("a.obj", up), standing);
    std::fs::write(folder.path("lying.rfm"), compile(LoadOptions::default()).bytes()).unwrap();
    assert_eq!(bounds("lying.rfm", up), standing);
    std::fs::write(folder.path("standing.rfm"), compile(up).bytes()).unwrap();
    assert_eq!(bounds("standing.rfm", LoadOptions::default()), standing);
}

#[test]
fn models_that_are_flat_everywhere_are_drawn_flat() {
    let folder = Folder::with(&[
        ("a.obj", &format!("s off\n{RIDGE}")),
        ("s.toml", &format!("{CAMERA}[[model]]\nfile = \"a.obj\"\n")),
    ]);
    for file in ["a.obj", "s.toml"] {
        let LoadedScene { scene, meshes, .. } = folder.load(file);
        assert!(!meshes[0].has_normals());
        assert_eq!(scene.models[0].normals, NormalMode::Flat, "{file}");
    }
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n";

/// A folder with a scene, a model with a texture of its own, and pictures of two colours.
fn wooden(scene: &str) -> Folder {
    let folder = Folder::with(&[
        ("s.toml", &format!("{CAMERA}{scene}")),
        ("m/a.obj", &format!("mtllib a.mtl\nusemtl wood\n{SQUARE}f 1/1 2/2 3/3\n")),
        ("m/a.mtl", "newmtl wood\nmap_Kd maps/wood.png\n"),
        ("m/bare.obj", &format!("{SQUARE}f 1 2 3\n")),
    ]);
    for (name, color) in [("m/maps/wood.png", [90, 60, 30]), ("tile.png", [1, 2, 3])] {
        std::fs::create_dir_all(folder.path(name).parent().unwrap()).unwrap();
        let picture = RgbImage { width: 2, height: 1, pixels: [color, color].concat() };
        image::save(&folder.path(name), &picture).unwrap();
    }
    folder
}

const TILED: &str = "[material.tiled]\ndiffuse = { texture = \"tile.png\", filter = \"nearest\" }\n";

#[test]
fn textures_are_loaded_once_and_only_where_something_has_them() {
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
    // A mesh carries texture coordinates only where a texture is laid on it.
    let with_uvs =
        |model: usize| meshes.iter().find(|m| m.id() == scene.models[model].mesh).unwrap().has_uvs();
    assert!(with_uvs(0) && !with_uvs(2));
}

#[test]
fn a_texture_of_the_scene_wants_texture_coordinates_of_the_model() {
    let model = |file: &str| format!("{TILED}[[model]]\nfile = \"{file}\"\nmaterial = \"tiled\"\n");
    let LoadedScene { scene, meshes, textures, .. } = wooden(&model("m/a.obj")).load("s.toml");
    assert!(meshes[0].has_uvs());
    assert_eq!((textures.len(), scene.textures[0].filter), (1, Filter::Nearest));
    let message = wooden(&model("m/bare.obj")).refusal("s.toml");
    assert!(message.starts_with("s.toml:8:12: `material` in [[model]] has a texture"), "{message}");
    assert!(message.contains("m/bare.obj has no texture coordinates"), "{message}");
}

#[test]
fn a_texture_that_cannot_be_read_is_told_at_its_name() {
    let triangle =
        "[[triangle]]\nvertices = [[0,0,0],[1,0,0],[0,1,0]]\nuvs = [[0,0],[1,0],[0,1]]\nmaterial = \"a\"\n";
    let with =
        |file: &str| wooden(&format!("[material.a]\ndiffuse = {{ texture = \"{file}\" }}\n{triangle}"));
    let message = with("none.png").refusal("s.toml");
    assert!(message.starts_with("s.toml:5:23: the texture: cannot read none.png: "), "{message}");
    let message = with("m/a.obj").refusal("s.toml");
    assert!(
        message.contains("cannot decode m/a.obj as PNG, JPEG, TGA, BMP, GIF, TIFF, WebP or PPM"),
        "{message}"
    );
    let folder = with("huge.ppm");
    std::fs::write(folder.path("huge.ppm"), "P6\n16000 9000\n255\nabc").unwrap();
    let message = folder.refusal("s.toml");
    assert!(message.contains("huge.ppm: a texture of 16000 x 9000 texels; at most"), "{message}");
}

#[test]
fn a_models_own_texture_that_cannot_be_read_costs_a_warning() {
    let folder = wooden("[[model]]\nfile = \"m/a.obj\"\n");
    std::fs::remove_file(folder.path("m/maps/wood.png")).unwrap();
    for file in ["s.toml", "m/a.obj"] {
        let LoadedScene { scene, textures, warnings, .. } = folder.load(file);
        assert!(textures.is_empty() && scene.textures.is_empty());
        assert!(scene.materials.iter().all(|material| material.texture.is_none()));
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        for words in ["m/a.obj: material `wood`: cannot read", "wood.png", "drawn without its texture"] {
            assert!(warnings[0].contains(words), "{warnings:?}");
        }
    }
}

/// A model whose material names a picture as `name`, in the folder `m`.
fn naming(name: &str) -> Folder {
    let folder = wooden("[[model]]\nfile = \"m/a.obj\"\n");
    std::fs::write(folder.path("m/a.mtl"), format!("newmtl wood\nmap_Kd {name}\n")).unwrap();
    folder
}

#[test]
fn pictures_of_other_disks_and_in_other_letters_are_found_with_one_note() {
    for name in [
        "C:\\\\Users\\\\me\\\\maps\\\\wood.png",
        "C:\\me\\wood.png",
        "/home/me/maps/Wood.PNG",
        "MAPS\\WOOD.PNG",
    ] {
        let folder = naming(name);
        std::fs::copy(folder.path("m/maps/wood.png"), folder.path("m/wood.png")).unwrap();
        let LoadedScene { textures, warnings, .. } = folder.load("m/a.obj");
        assert_eq!(textures.len(), 1, "{name}: {warnings:?}");
        assert_eq!(warnings.len(), 1, "{name}: {warnings:?}");
        assert!(
            warnings[0].contains(&format!("a.mtl:2: the picture `{name}` is not there: `")),
            "{warnings:?}"
        );
    }
    let LoadedScene { textures, warnings, .. } = naming("maps\\wood.png").load("m/a.obj");
    assert_eq!((textures.len(), warnings), (1, Vec::new()));
}

#[test]
fn pictures_above_the_models_folder_need_the_users_word() {
    let folder = naming("../tile.png");
    let allowed = LoadOptions { allow_parent_textures: true, ..LoadOptions::default() };
    for file in ["m/a.obj", "s.toml"] {
        let LoadedScene { textures, warnings, .. } = folder.load(file);
        assert!(textures.is_empty());
        assert!(
            warnings.len() == 1 && warnings[0].contains("allow it with --allow-parent-textures"),
            "{warnings:?}"
        );
        let LoadedScene { textures, warnings, .. } = load_with(&folder.path(file), allowed).unwrap();
        assert_eq!((textures.len(), warnings), (1, Vec::new()), "{file}");
    }
    let compiled =
        compile_model_with(&folder.path("m/a.obj"), &folder.path("m"), CompileOptions::default(), allowed);
    assert_eq!(compiled.unwrap().0.materials()[0].texture.as_ref().unwrap().file, "../tile.png");
    // What is not there is reported as such.
    let folder = naming("../none.png");
    let LoadedScene { warnings, .. } = load_with(&folder.path("m/a.obj"), allowed).unwrap();
    assert!(warnings.len() == 1 && warnings[0].contains("cannot read"), "{warnings:?}");
}

#[test]
fn pictures_of_every_format_are_laid_on_models() {
    let picture = ::image::RgbImage::from_pixel(2, 2, ::image::Rgb([1, 2, 3]));
    for extension in ["tga", "bmp", "gif", "tif", "webp", "png", "ppm"] {
        let folder = naming(&format!("maps/tex.{extension}"));
        picture.save(folder.path(&format!("m/maps/tex.{extension}"))).unwrap();
        let LoadedScene { textures, warnings, .. } = folder.load("m/a.obj");
        assert_eq!(warnings, [""; 0], "{extension}");
        assert_eq!(textures[0].texel(0, 0), [1, 2, 3], "{extension}");
    }
}

#[test]
fn a_jpeg_without_its_end_is_reported_once() {
    let folder = naming("cut.jpg");
    let picture =
        ::image::RgbImage::from_fn(64, 64, |x, y| ::image::Rgb([x as u8 * 4, y as u8 * 4, (x * y) as u8]));
    picture.save(folder.path("m/cut.jpg")).unwrap();
    let whole = std::fs::read(folder.path("m/cut.jpg")).unwrap();
    assert_eq!(folder.load("m/a.obj").warnings, [""; 0]);
    std::fs::write(folder.path("m/cut.jpg"), &whole[..whole.len() * 2 / 3]).unwrap();
    for file in ["m/a.obj", "s.toml"] {
        let LoadedScene { warnings, .. } = folder.load(file);
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(warnings[0].contains("cut.jpg: the JPEG picture has no end"), "{warnings:?}");
    }
}

#[test]
fn pictures_that_are_none_are_named_once_for_what_they_are() {
    for (content, words) in [
        (&b"version https://git-lfs.github.com/spec/v1\n"[..], "run `git lfs pull`"),
        (b"<html>404</html>", "a web page"),
        (b"8BPS\0\x01", "a Photoshop picture (.psd)"),
        (b"DDS \x7c\0\0\0", "convert it to PNG"),
        (b"no picture", "could not be determined"),
    ] {
        let folder = naming("a.png\nnewmtl oak\nmap_Kd a.png");
        std::fs::write(
            folder.path("m/a.obj"),
            format!("mtllib a.mtl\n{SQUARE}v 0 1 0\nusemtl wood\nf 1/1 2/2 3/3\nusemtl oak\nf 1/1 3/3 4/2\n"),
        )
        .unwrap();
        std::fs::write(folder.path("m/a.png"), content).unwrap();
        let warnings = folder.load("m/a.obj").warnings;
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(warnings[0].contains("material `wood`: ") && warnings[0].contains(words), "{warnings:?}");
        assert!(warnings[0].ends_with("drawn without its texture (2 times)"), "{warnings:?}");
    }
}

#[test]
fn back_slashes_in_paths_get_a_hint_or_are_separators() {
    let refusal = |line: &str| {
        let folder = Folder::with(&[
            ("s.toml", &format!("{CAMERA}[[model]]\n{line}\n")),
            ("models/new.obj", TRIANGLE),
        ]);
        folder.refusal("s.toml")
    };
    let hint = "write / in paths, as in \"models/new.obj\", or put them in 'single quotes'";
    for (line, place) in [
        ("file = \"models\\new.obj\"", "s.toml:5:8: `file` in [[model]] is \"models\\new.obj\""),
        ("file = \"models\\textured.obj\"", "s.toml:5:8: `file` in [[model]] is \"models\\textured.obj\""),
        ("file = \"C:\\Users\\me\\box.obj\"", "s.toml:5:"),
        ("file = \"models\\old.obj\"", "s.toml:5:"),
        ("file = \"models\\\"", "s.toml:5:"),
    ] {
        let message = refusal(line);
        assert!(message.starts_with(place) && message.contains(hint), "{line}: {message}");
        assert!(!message.contains(char::is_control), "{message:?}");
    }
    assert!(!refusal("file = 5 5").contains("back slash"));
    let with = |file: &str| {
        let scene = format!("{CAMERA}[[model]]\nfile = {file}\n");
        Folder::with(&[("s.toml", &scene), ("models/new.obj", TRIANGLE)]).load("s.toml").meshes.len()
    };
    assert_eq!(
        [with("'models\\new.obj'"), with("\"models\\\\new.obj\""), with("\"models/new.obj\"")],
        [1; 3]
    );
}

#[test]
fn control_characters_of_names_are_printed_as_escapes() {
    let folder =
        Folder::with(&[("a\x1b[2J.obj", "v 0 0 0\nf 1 2 3\n"), ("b.obj", &format!("\x1b]0;x\n{TRIANGLE}"))]);
    let message = load(&folder.path("a\x1b[2J.obj")).unwrap_err().to_string();
    assert!(message.contains("a\\u{1b}[2J.obj:2: "), "{message}");
    let warnings = folder.load("b.obj").warnings;
    assert!(warnings[0].contains("unknown statement `\\u{1b}]0;x` is left out"), "{warnings:?}");
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
fn what_map_d_names_cuts_out_by_alpha_or_by_brightness() {
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
    // Its brightness says nothing where it is the picture itself.
    assert_eq!(cutout("map_Kd mask.png\nmap_d mask.png\n"), None);
    // Another picture decides, whatever alpha the first one has. This one is as bright as 118 of 255.
    assert_eq!(cutout("map_Kd alpha.png\nmap_d whole.png\n"), Some([118, 118]));
    assert_eq!(cutout("map_Kd whole.png\n"), None);
}

#[test]
fn pictures_lie_as_the_options_of_their_statements_say() {
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
    // A compiled model keeps them: a scene may lay anything on it.
    let (mesh, _) =
        compile_model(&folder.path("m/a.obj"), &folder.path("m"), CompileOptions::default()).unwrap();
    assert_eq!(mesh.whole_repeats(0), Vec2::new(-3.0, 0.0));
}

#[test]
fn colours_of_vertices_go_with_the_materials_of_the_file() {
    let colored = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nf 1 2 3\n";
    let scene = "[material.grey]\ndiffuse = [0.5, 0.5, 0.5]\n[[model]]\nfile = \"a.obj\"\n\
                 [[model]]\nfile = \"a.obj\"\nmaterial = \"grey\"\n[[model]]\nfile = \"b.obj\"\n";
    let folder =
        Folder::with(&[("s.toml", &format!("{CAMERA}{scene}")), ("a.obj", colored), ("b.obj", TRIANGLE)]);
    let LoadedScene { scene, meshes, .. } = folder.load("s.toml");
    let material = |model: usize| scene.materials[scene.models[model].materials[0] as usize];
    assert_eq!([0, 1, 2].map(|model| material(model).vertex_colors), [true, false, false]);
    assert_eq!((material(0).diffuse, material(2).diffuse), (Vec3::ONE, Material::NEUTRAL.diffuse));
    let mesh = meshes.iter().find(|mesh| mesh.id() == scene.models[0].mesh).unwrap();
    assert_eq!(mesh.corner_colors(0), Some([[255, 0, 0], [0, 255, 0], [0, 0, 255]]));
    assert_eq!(meshes.iter().filter(|mesh| mesh.has_colors()).count(), 1);
}

#[test]
fn compiled_models_keep_their_textures_wherever_they_lie() {
    let folder = wooden("[[model]]\nfile = \"out/deep/b.rfm\"\n");
    std::fs::create_dir_all(folder.path("out/deep")).unwrap();
    let allowed = LoadOptions { allow_parent_textures: true, ..LoadOptions::default() };
    let own = |file: &str| {
        let loaded = load_with(&folder.path(file), allowed).unwrap();
        assert_eq!(loaded.warnings, [""; 0]);
        loaded.textures[0].id()
    };
    let (mesh, _) =
        compile_model(&folder.path("m/a.obj"), &folder.path("m"), CompileOptions::default()).unwrap();
    assert_eq!(mesh.materials()[0].texture, Some(TextureFile::new("maps/wood.png")));
    let (mesh, _) =
        compile_model(&folder.path("m/a.obj"), &folder.path("out/deep"), CompileOptions::default()).unwrap();
    assert_eq!(mesh.materials()[0].texture, Some(TextureFile::new("../../m/maps/wood.png")));
    std::fs::write(folder.path("out/deep/b.rfm"), mesh.bytes()).unwrap();
    assert_eq!(own("s.toml"), own("m/a.obj"));
    // A compiled one can be moved by compiling it again.
    let (again, _) =
        compile_model(&folder.path("out/deep/b.rfm"), &folder.path("m"), CompileOptions::default()).unwrap();
    std::fs::write(folder.path("m/c.rfm"), again.bytes()).unwrap();
    assert_eq!(own("m/c.rfm"), own("m/a.obj"));
    // Texture coordinates are kept for a texture that only the scene will give.
    let (bare, _) =
        compile_model(&folder.path("m/bare.obj"), &folder.path("m"), CompileOptions::default()).unwrap();
    assert!(mesh.has_uvs() && !bare.has_uvs());
}

/// Files of a folder beside the project, or a message that they are not there.
fn beside(folder: &str, extension: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared").join(folder);
    let Ok(entries) = std::fs::read_dir(&folder) else {
        eprintln!("skipped: {} is not there", folder.display());
        return Vec::new();
    };
    let paths = entries.map(|entry| entry.unwrap().path());
    paths.filter(|path| path.extension().is_some_and(|e| e == extension)).collect()
}

#[test]
fn the_workloads_load_without_warnings() {
    for path in beside("workloads", "toml") {
        let loaded = load(&path).unwrap();
        assert_eq!(loaded.warnings, [""; 0], "{}", path.display());
        assert_eq!(loaded.meshes.len(), 1, "{}", path.display());
        assert_eq!(loaded.meshes[0].triangle_count(), 99_938, "{}", path.display());
        assert_eq!(loaded.scene.triangles.len(), 2);
    }
}

#[test]
fn the_test_models_load_as_scenes() {
    let counts = [("nefertiti", 99_938), ("stanford-bunny", 69_451), ("spot", 5_856), ("teapot", 6_320)];
    for path in beside("models", "obj") {
        let loaded = load(&path).unwrap();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let triangles = loaded.meshes[0].triangle_count();
        eprintln!("{name}: {triangles} triangles, {:?}", loaded.warnings);
        if let Some((_, expected)) = counts.iter().find(|(known, _)| *known == name) {
            // Some files have a few triangles without an area, or twice.
            assert!(triangles <= *expected && triangles * 100 > expected * 98, "{name}: {triangles}");
        }
    }
}

#[test]
fn textures_of_a_scene_are_bounded_in_all() {
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
    let LoadedScene { textures, warnings, .. } = folder.load("m/a.obj");
    let about: Vec<&String> = warnings.iter().filter(|warning| warning.contains("2.png")).collect();
    assert_eq!((textures.len(), about.len()), (2, 1), "{warnings:?}");
    assert!(about[0].contains("would take more than 4 MiB"), "{about:?}");
}

#[test]
fn materials_of_instances_are_counted_before_they_are_listed() {
    let model = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl a\nf 1 2 3\nusemtl b\nf 1 2 4\n";
    let scene = |count: usize| format!("{CAMERA}{}", "[[model]]\nfile = \"a.obj\"\n".repeat(count));
    let folder = Folder::with(&[
        ("a.obj", model),
        ("a.mtl", "newmtl a\nnewmtl b\nKd 1 0 0\n"),
        ("few.toml", &scene(1_000)),
        ("many.toml", &scene(1_001)),
    ]);
    assert_eq!(folder.load("few.toml").scene.models.len(), 1_000);
    let message = load(&folder.path("many.toml")).unwrap_err().to_string();
    assert!(message.contains("many.toml:") && message.contains("2002 materials in all"), "{message}");
}

#[test]
fn a_compiled_model_names_pictures_in_its_folder_or_below_only() {
    let folder = wooden("[[model]]\nfile = \"m/a.obj\"\n");
    std::fs::create_dir(folder.path("other")).unwrap();
    let compile = |into: &str| {
        let (mesh, warnings) =
            compile_model(&folder.path("m/a.obj"), &folder.path(into), CompileOptions::default()).unwrap();
        std::fs::write(folder.path(&format!("{into}/c.rfm")), mesh.bytes()).unwrap();
        warnings
    };
    assert_eq!(compile("m"), [""; 0]);
    let LoadedScene { textures, warnings, .. } = folder.load("m/c.rfm");
    assert_eq!((textures.len(), warnings), (1, Vec::new()));
    let warnings = compile("other");
    assert!(warnings.len() == 1 && warnings[0].contains("--allow-parent-textures only"), "{warnings:?}");
    let LoadedScene { textures, warnings, .. } = folder.load("other/c.rfm");
    assert!(textures.is_empty());
    assert!(
        warnings.len() == 1 && warnings[0].contains("allow it with --allow-parent-textures"),
        "{warnings:?}"
    );
    let allowed = LoadOptions { allow_parent_textures: true, ..LoadOptions::default() };
    let LoadedScene { textures, warnings, .. } = load_with(&folder.path("other/c.rfm"), allowed).unwrap();
    assert_eq!((textures.len(), warnings), (1, Vec::new()));
}
