//! Scene files: faults, warnings, defaults, bounds.

use super::*;

#[test]
fn faults_name_file_line_and_column() {
    let folder = Folder::with(&[("scene.toml", "[camera]\nposition = [0, 0, 4]\n  fof = 3\n")]);
    assert_eq!(
        folder.refusal("scene.toml"),
        "scene.toml:3:3: unknown key `fof` in [camera]; did you mean `fov`?"
    );
}

#[test]
fn invalid_utf8_is_reported_with_its_place() {
    let folder = Folder::with(&[]);
    std::fs::write(folder.path("s.toml"), b"# ok\n# \xff\n").unwrap();
    assert!(folder.refusal("s.toml").starts_with("s.toml:2:3: not valid UTF-8"));
}

#[test]
fn warnings_of_scene_and_models_are_gathered() {
    let scene = format!("{CAMERA}view_height = 3\n[[model]]\nfile = \"a.obj\"\n");
    let text = format!("{TRIANGLE}f 1 2 3\nf 1 1 2\nhello\n");
    let folder = Folder::with(&[("s.toml", &scene), ("a.obj", &text)]);
    let warnings = folder.load("s.toml").warnings;
    assert_eq!(warnings.len(), 3, "{warnings:#?}");
    assert!(
        ["s.toml:4:15: ", "view_height", "[camera]"].iter().all(|fact| warnings[0].contains(fact)),
        "{warnings:#?}"
    );
    assert!(["a.obj:7: ", "`hello`"].iter().all(|fact| warnings[1].contains(fact)), "{warnings:#?}");
    assert!(warnings[2].contains("1 without an area, 1 that repeat another, 0 not finite"), "{warnings:#?}");
}

#[test]
fn defaults_follow_from_the_scene() {
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
    // The centre of the picture, not of the sphere: the bounds are projected in perspective.
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
    assert!(warnings[0].contains("`\\u{1b}]0;x`"), "{warnings:?}");
}

/// Files of a folder next to the project; none, and a message, where it is missing.
fn shared_files(folder: &str, extension: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared").join(folder);
    let Ok(entries) = std::fs::read_dir(&folder) else {
        eprintln!("skipped: {} is missing", folder.display());
        return Vec::new();
    };
    let paths = entries.map(|entry| entry.unwrap().path());
    paths.filter(|path| path.extension().is_some_and(|e| e == extension)).collect()
}

#[test]
fn the_workloads_load_without_warnings() {
    for path in shared_files("workloads", "toml") {
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
    for path in shared_files("models", "obj") {
        let loaded = load(&path).unwrap();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let triangles = loaded.meshes[0].triangle_count();
        eprintln!("{name}: {triangles} triangles, {:?}", loaded.warnings);
        if let Some((_, expected)) = counts.iter().find(|(known, _)| *known == name) {
            // Some files have a few degenerate or duplicate triangles.
            assert!(triangles <= *expected && triangles * 100 > expected * 98, "{name}: {triangles}");
        }
    }
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
    let limits = LoadLimits { material_slots: 2_000, ..LoadLimits::default() };
    let load = |file: &str| load_limited(&folder.path(file), LoadOptions::default(), limits);
    assert_eq!(load("few.toml").unwrap().scene.models.len(), 1_000);
    let message = load("many.toml").unwrap_err().to_string();
    assert!(message.contains("many.toml:") && message.contains("2002 materials in all"), "{message}");
}
