use glam::{DVec3, Vec3};

use super::super::{Attenuation, LightKind};
use super::*;

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
    let LoadedScene { scene, meshes, warnings } = folder.load("s.toml");
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
    let (mesh, warnings) = load_model(&folder.path("a.obj")).unwrap();
    assert_eq!(warnings, [""; 0]);
    std::fs::write(folder.path("b.bin"), mesh.bytes()).unwrap();
    assert_eq!(load_model(&folder.path("b.bin")).unwrap().0.id(), mesh.id());
    assert_eq!(folder.load("b.bin").scene, folder.load("a.obj").scene);
    assert_eq!(folder.load("s.toml").scene.models[0].mesh, mesh.id());
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
