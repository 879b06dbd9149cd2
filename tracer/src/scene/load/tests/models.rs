//! Models: shared files, compiled ones, up axes, crease angles, own materials.

use super::*;

#[test]
fn a_missing_model_is_reported_at_its_name() {
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
fn other_files_are_refused_as_models() {
    let folder = Folder::with(&[
        ("gltf.toml", &format!("{CAMERA}[[model]]\nfile = \"a.glb\"\n")),
        ("a.glb", "glTF"),
        ("scene.toml", &format!("{CAMERA}[[model]]\nfile = \"gltf.toml\"\n")),
        ("broken.rfm", "RFMESH and more"),
    ]);
    assert!(folder.refusal("gltf.toml").contains("a.glb: "));
    assert!(folder.refusal("scene.toml").contains("gltf.toml: "));
    let message = folder.refusal("broken.rfm");
    assert!(message.starts_with("broken.rfm: not a compiled model"), "{message}");
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
    let LoadedScene { scene, meshes, mesh_files, textures, warnings, .. } = folder.load("s.toml");
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
    // A mesh with flat instances only has no normals.
    let with_normals = |model: &Model| meshes.iter().find(|m| m.id() == model.mesh).unwrap().has_normals();
    assert!(with_normals(own) && !with_normals(copy));
}

#[test]
fn compiled_models_are_loaded_unchanged() {
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
fn each_model_has_its_crease_angle() {
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
fn options_of_bare_models_are_refused_elsewhere() {
    let up = LoadOptions { up: Some(Up::Z), ..LoadOptions::default() };
    let crease = LoadOptions { crease_angle: Some(60.0), ..LoadOptions::default() };
    let scene = format!("{CAMERA}[[model]]\nfile = \"a.rfm\"\ncrease_angle = 60\n");
    let folder = Folder::with(&[("a.obj", RIDGE), ("s.toml", &scene)]);
    let (mesh, _) =
        compile_model(&folder.path("a.obj"), &folder.path(""), CompileOptions::default()).unwrap();
    std::fs::write(folder.path("a.rfm"), mesh.bytes()).unwrap();
    let message = |file: &str, options| load_with(&folder.path(file), options).unwrap_err().to_string();
    assert!(message("s.toml", up).contains("write `up = \"z\"` in [[model]] of the scene file"));
    assert!(message("s.toml", crease).contains("`crease_angle` in [[model]]"));
    assert!(message("a.rfm", crease).contains("--crease-angle"));
    let warnings = folder.load("s.toml").warnings;
    assert_eq!(warnings.len(), 1);
    assert!(
        ["s.toml:6:16: ", "`crease_angle`", "[[model]]"].iter().all(|fact| warnings[0].contains(fact)),
        "{warnings:?}"
    );
}

#[test]
fn a_z_up_model_is_upright_from_its_file_and_compiled() {
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
    let upright = (DVec3::new(-1.0, 0.0, -1.0), DVec3::new(1.0, 6.0, 1.0));
    assert_eq!(bounds("a.obj", up), upright);
    std::fs::write(folder.path("z_up.rfm"), compile(LoadOptions::default()).bytes()).unwrap();
    assert_eq!(bounds("z_up.rfm", up), upright);
    std::fs::write(folder.path("y_up.rfm"), compile(up).bytes()).unwrap();
    assert_eq!(bounds("y_up.rfm", LoadOptions::default()), upright);
}

#[test]
fn models_without_smooth_groups_are_flat() {
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

#[test]
fn vertex_colours_belong_to_the_materials_of_the_file() {
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
fn compiled_models_find_their_textures_from_other_folders() {
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
    // A compiled model can be moved by compiling it again.
    let (again, _) =
        compile_model(&folder.path("out/deep/b.rfm"), &folder.path("m"), CompileOptions::default()).unwrap();
    std::fs::write(folder.path("m/c.rfm"), again.bytes()).unwrap();
    assert_eq!(own("m/c.rfm"), own("m/a.obj"));
    // Texture coordinates are kept for textures that only a scene assigns.
    let (bare, _) =
        compile_model(&folder.path("m/bare.obj"), &folder.path("m"), CompileOptions::default()).unwrap();
    assert!(mesh.has_uvs() && !bare.has_uvs());
}

#[test]
fn a_compiled_model_reads_pictures_in_its_folder_or_below_only() {
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
    assert!(warnings.len() == 1 && warnings[0].contains("--allow-parent-textures"), "{warnings:?}");
    let allowed = LoadOptions { allow_parent_textures: true, ..LoadOptions::default() };
    let LoadedScene { textures, warnings, .. } = load_with(&folder.path("other/c.rfm"), allowed).unwrap();
    assert_eq!((textures.len(), warnings), (1, Vec::new()));
}

#[test]
fn a_model_that_bounds_a_volume_is_loaded_and_is_no_model_of_the_scene() {
    let scene = "[render]\nintegrator = \"path\"\n[[volume]]\nmodel = \"a.obj\"\ntranslate = [1, 2, 3]\n";
    let folder = Folder::with(&[
        ("s.toml", &format!("{CAMERA}{scene}")),
        ("a.obj", TRIANGLE),
        ("gone.toml", &format!("{CAMERA}{}", scene.replace("a.obj", "b.obj"))),
    ]);
    let LoadedScene { scene, meshes, mesh_files, warnings, .. } = folder.load("s.toml");
    assert_eq!(warnings, [""; 0]);
    assert!(scene.models.is_empty() && scene.materials.is_empty());
    assert_eq!((meshes.len(), mesh_files), (1, vec![PathBuf::from("a.obj")]));
    let bounding = scene.volumes[0].boundary.model().unwrap();
    assert_eq!((bounding.mesh, bounding.translate), (meshes[0].id(), DVec3::new(1.0, 2.0, 3.0)));
    assert_eq!(scene.validate(), Ok(()));
    assert!(folder.refusal("gone.toml").contains("cannot read the model b.obj"));
}
