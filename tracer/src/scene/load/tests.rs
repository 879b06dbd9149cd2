use glam::{DVec3, Vec3};

use super::super::{Attenuation, Filter, LightKind};
use super::*;
use crate::image::{self, RgbImage};

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
    assert!(folder.refusal("gltf.toml").contains("a.glb: glTF models are not supported yet"));
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
    let LoadedScene { scene, meshes, textures, warnings } = folder.load("s.toml");
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
    assert_eq!(camera.look_at, DVec3::new(5.0, 0.0, 2.0));
    let message = folder.refusal("empty.toml");
    assert!(message.starts_with("empty.toml: [camera] is missing"), "{message}");
}

#[test]
fn lists_beyond_their_bounds_are_refused() {
    let planes = "[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 1, 0]\n".repeat(1025);
    let folder = Folder::with(&[("s.toml", &format!("{CAMERA}{planes}"))]);
    assert_eq!(folder.refusal("s.toml"), "s.toml: the scene has 1025 planes; 1024 are allowed");
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
    let LoadedScene { scene, meshes, textures, warnings } = wooden(&format!("{TILED}{scene}")).load("s.toml");
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
    assert!(message.contains("cannot decode m/a.obj as PNG, JPEG or PPM"), "{message}");
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

#[test]
fn compiled_models_keep_their_textures_wherever_they_lie() {
    let folder = wooden("[[model]]\nfile = \"out/deep/b.rfm\"\n");
    std::fs::create_dir_all(folder.path("out/deep")).unwrap();
    let own = |file: &str| {
        let loaded = folder.load(file);
        assert_eq!(loaded.warnings, [""; 0]);
        loaded.textures[0].id()
    };
    let (mesh, _) =
        compile_model(&folder.path("m/a.obj"), &folder.path("m"), CompileOptions::default()).unwrap();
    assert_eq!(mesh.materials()[0].texture.as_deref(), Some("maps/wood.png"));
    let (mesh, _) =
        compile_model(&folder.path("m/a.obj"), &folder.path("out/deep"), CompileOptions::default()).unwrap();
    assert_eq!(mesh.materials()[0].texture.as_deref(), Some("../../m/maps/wood.png"));
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
