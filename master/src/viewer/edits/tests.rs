//! Edits of scene files in a folder.

use std::path::PathBuf;

use glam::DVec3;
use proptest::prelude::*;
use rayfarm_tracer::scene::{LoadLimits, LoadOptions, Scene, SceneLoader, Up};
use serde_json::Value as Json;

use super::edit::EditCommand;
use super::editor::SceneEditor;

const SCENE: &str = r#"# A scene with objects of each kind.
ambient = [0.1, 0.1, 0.1]

[render]
width = 32
height = 24
samples = 1 # one is enough

[camera]
position = [0, 1, 5]
look_at = [0, 0, 0]

[background]
gradient = { bottom = [0, 0, 0], top = [0.2, 0.4, 0.8] } # dusk

[[light]]
position = [3, 5, 4]
intensity = 0.8 # a weak lamp

[material.red]
diffuse = [0.8, 0.1, 0.1]

[material."dark wood"]
diffuse = { texture = "wood.png" }

[[model]]
file = "a.obj" # a sheet
material = "dark wood"

[[model]]
name = "second"
file = "a.obj"
scale = [1, 2, 1]

[[sphere]]
name = "ball"
center = [0, 0.5, 0] # in the middle
radius = 0.5
material = "red"

[[triangle]]
vertices = [[0, 0, 0], [0, 0, 0], [0, 1, 0]]

[[triangle]]
name = "sail"
vertices = [[0, 0, 0], [3, 0, 0], [0, 3, 0]]

[[rectangle]]
name = "wall"
axis = "y"
at = 2.0
ranges = [[0, 2], [0, 4]]

[[box]]
name = "crate"
min = [0, 0, 0]
max = [1, 1, 1]

[[disk]]
name = "plate"
center = [0, 1, 0]
normal = [0, 1, 0]
radius = 1

[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]

[[group]]
name = "pair"
children = ["ball", "plate"]
translate = [1, 0, 0]
"#;

struct Edits {
    folder: tempfile::TempDir,
    editor: SceneEditor,
    /// The scene that is shown.
    shown: Scene,
}

impl Edits {
    fn of(scene: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("s.toml"), scene).unwrap();
        std::fs::write(
            folder.path().join("a.obj"),
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n",
        )
        .unwrap();
        let picture =
            rayfarm_tracer::image::RgbImage { width: 2, height: 1, pixels: vec![9, 60, 3, 40, 5, 6] };
        rayfarm_tracer::image::save(&folder.path().join("wood.png"), &picture).unwrap();
        Self::open(folder, "s.toml", None)
    }

    fn open(folder: tempfile::TempDir, name: &str, bare: Option<LoadOptions>) -> Self {
        let path = folder.path().join(name);
        let mut loader = SceneLoader::new(bare.unwrap_or_default(), LoadLimits::default());
        let shown = loader.load(&path).unwrap().scene;
        let editor = SceneEditor::new(&path, loader, &shown, bare).unwrap();
        Self { folder, editor, shown }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn run(&mut self, line: &str) -> Result<Json, String> {
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        let command = EditCommand::parse(word, rest).expect("a command of the editor")?;
        let shown = &mut self.shown;
        self.editor.perform(&command, line, &mut |_, loaded| {
            *shown = loaded.scene;
            Ok(())
        })
    }

    fn edit(&mut self, line: &str) -> &Scene {
        self.run(line).unwrap_or_else(|error| panic!("{line}: {error}"));
        &self.shown
    }

    /// Saves the scene and reads the file.
    fn saved(&mut self) -> String {
        let path = self.path("saved.toml");
        self.edit(&format!("save {}", path.display()));
        std::fs::read_to_string(path).unwrap()
    }

    fn reload(&mut self) -> Option<Result<(), String>> {
        let shown = &mut self.shown;
        self.editor.reload_if_changed(&mut |_, loaded| {
            *shown = loaded.scene;
            Ok(())
        })
    }
}

fn edits() -> Edits {
    Edits::of(SCENE)
}

#[test]
fn objects_of_each_kind_are_moved_turned_and_scaled() {
    let mut edits = edits();
    let ball = edits.shown.spheres[0];
    assert_eq!(
        edits.edit("object move ball 0 1 -2").spheres[0].center,
        ball.center + DVec3::new(0.0, 1.0, -2.0)
    );
    assert_eq!(edits.edit("object scale ball 3").spheres[0].radius, 1.5);
    assert_eq!(edits.edit("object move second 1, 2, 3").models[1].translate, DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(edits.edit("object rotate second 0 90 0").models[1].rotate, DVec3::Y * 90.0);
    assert_eq!(edits.edit("object scale second 2 1 1").models[1].scale, DVec3::new(2.0, 2.0, 1.0));
    assert_eq!(edits.edit("object scale second 0.5").models[1].scale, DVec3::new(1.0, 1.0, 0.5));
    let sail = edits.edit("object move sail 1 0 0").triangles[0].vertices;
    assert_eq!(sail, [DVec3::X, DVec3::X * 4.0, DVec3::new(1.0, 3.0, 0.0)]);
    let turned = edits.edit("object rotate sail 0 0 180").triangles[0].vertices;
    assert!((turned[0] - DVec3::new(3.0, 2.0, 0.0)).length() < 1e-12, "{turned:?}");
    let wall = edits.edit("object scale wall 2 1 1").triangles[1].vertices;
    assert!(wall.iter().all(|corner| corner.y == 2.0 && (-1.0..=3.0).contains(&corner.x)), "{wall:?}");
    let wall = edits.edit("object move wall 1 1 0").triangles[1].vertices;
    assert!(wall.iter().all(|corner| corner.y == 3.0 && (0.0..=4.0).contains(&corner.x)), "{wall:?}");
    let corners = |scene: &Scene| scene.triangles[3..].iter().flat_map(|it| it.vertices).collect::<Vec<_>>();
    let crate_ = corners(edits.edit("object scale crate 3"));
    assert!(crate_.iter().all(|corner| (corner - 0.5).abs() == DVec3::splat(1.5)), "{crate_:?}");
    let plate = edits.edit("object rotate plate 90 0 0").disks[0].normal;
    assert!((plate - DVec3::Z).length() < 1e-12, "{plate}");
    assert_eq!(edits.edit("object move 20 0 -1 0").planes[0].point, DVec3::NEG_Y);
    let before = edits.shown.spheres[0].center;
    assert_eq!(edits.edit("object move pair 0 0 1").spheres[0].center, before + DVec3::Z);
}

#[test]
fn objects_are_found_by_the_numbers_of_their_items() {
    let mut edits = edits();
    let listed = edits.run("object list").unwrap();
    let of = |kind: &str| {
        let all = listed["objects"].as_array().unwrap().iter();
        all.filter(|it| it["kind"] == kind)
            .map(|it| (it["item"].as_u64(), it["items"].as_u64().unwrap()))
            .collect::<Vec<_>>()
    };
    assert_eq!(of("model"), [(Some(1), 1), (Some(2), 1)]);
    assert_eq!(of("sphere"), [(Some(3), 1)]);
    assert_eq!(of("triangle"), [(Some(4), 0), (Some(4), 1)], "the first one has no area");
    assert_eq!((of("rectangle"), of("box")), (vec![(Some(5), 2)], vec![(Some(7), 12)]));
    assert_eq!((of("disk"), of("plane")), (vec![(Some(19), 1)], vec![(Some(20), 1)]));
    assert_eq!(of("group"), [(None, 0)]);
    assert_eq!(edits.edit("object move 20 0 -1 0").planes[0].point, DVec3::NEG_Y);
    assert_eq!(edits.edit("object set 19 radius 7").disks[0].radius, 7.0);
    let before = edits.shown.triangles.clone();
    assert_ne!(before[3..], edits.edit("object move 18 1 0 0").triangles[3..]);
    let error = edits.run("object move 21 1 0 0").unwrap_err();
    assert!(error.contains("21") && error.contains("object list"), "{error}");
}

#[test]
fn materials_lights_and_the_rest_are_changed() {
    let mut edits = edits();
    assert_eq!(edits.edit("material red diffuse [0, 1, 0]").materials[1].diffuse, glam::Vec3::Y);
    edits.edit("material \"dark wood\" diffuse [0.5, 0.4, 0.3]");
    assert!(edits.shown.textures.is_empty(), "the texture is replaced");
    assert_eq!(edits.edit("light 1 radius 0.2").lights[0].radius, 0.2);
    assert_eq!(edits.edit("light 1 radius default").lights[0].radius, 0.0);
    assert_eq!(edits.edit("light add kind = \"directional\", direction = [0, -1, 0]").lights.len(), 2);
    assert_eq!(edits.edit("light remove 1").lights.len(), 1);
    assert!(edits.edit("light remove 1").has_default_light);
    assert!(edits.run("light 1 color [1, 1, 1]").unwrap_err().contains("light add"));
    edits.edit("background { color = [1, 0, 0] }");
    assert_eq!(edits.shown.background, rayfarm_tracer::scene::Background::Color(glam::Vec3::X));
    assert!(!edits.edit("background visible false").background_visible);
    assert_eq!(edits.edit("render exposure 1.5").render.tone.exposure, 1.5);
    assert_eq!(edits.edit("ambient [0, 0, 1]").ambient, glam::Vec3::Z);
    let red = edits.shown.spheres[0].material;
    assert_ne!(edits.edit("object set ball material default").spheres[0].material, red);
    assert_eq!(edits.edit("object set ball material red").spheres[0].material, red);
}

#[test]
fn objects_are_added_and_removed_with_their_names() {
    let mut edits = edits();
    let scene =
        edits.edit("object add sphere name = \"moon\", center = [0, 3, 0], radius = 0.1, material = \"red\"");
    assert_eq!((scene.spheres.len(), scene.spheres[1].radius), (2, 0.1));
    assert_eq!(
        edits.edit("object add group { children = [\"moon\"], translate = [0, 1, 0] }").spheres[1].center.y,
        4.0
    );
    assert_eq!(edits.edit("object remove moon").spheres.len(), 1, "and its group, which has no other child");
    assert_eq!(edits.edit("object remove ball").spheres.len(), 0);
    assert_eq!(edits.edit("object remove plate").disks.len(), 0);
    assert!(edits.run("object move pair 1 0 0").unwrap_err().contains("pair"));
    assert!(edits.edit("object add box min = [0, 0, 0], max = [1, 1, 1]").triangles.len() > 12);
    let mut inline = Edits::of("sphere = [{ center = [0, 0, 0], radius = 1 }] # one\n");
    assert_eq!(inline.edit("object move 1 1 0 0").spheres[0].center, DVec3::X);
}

#[test]
fn wrong_values_are_refused_by_the_loader_and_change_nothing() {
    let mut edits = edits();
    let before = edits.shown.clone();
    for (line, words) in [
        ("object set ball radius -1", &["`radius`", "[[sphere]]"][..]),
        ("object set ball raduis 1", &["raduis", "radius"]),
        ("object scale ball 0", &["`radius`"]),
        ("object scale ball 1 2 1", &["sphere", "one factor"]),
        ("object scale 20 2", &["plane"]),
        ("object rotate wall 1 0 0", &["rectangle", "group"]),
        ("object add ball radius = 1", &["ball", "sphere"]),
        ("object add sphere radius = 1", &["`center`", "[[sphere]]"]),
        ("object add sphere radius", &["KEY = VALUE"]),
        ("object set ball material gold", &["gold", "red"]),
        ("object set ball name second", &["second", "twice"]),
        ("object move nothing 1 0 0", &["nothing", "object list"]),
        ("material red diffuse [2, 0, 0]", &["`diffuse`", "[material.red]"]),
        ("material rde diffuse [1, 0, 0]", &["rde", "red"]),
        ("material red diffuse [1, 0", &["[1, 0", "no value"]),
        ("light 2 color [1, 1, 1]", &["light 2", "1"]),
        ("light 1 intensity \"strong\"", &["`intensity`"]),
        ("background color [1, 0, 0]", &["`color`", "`gradient`"]),
        ("render samples 5", &["samples"]),
        ("undo", &["no change"]),
        ("redo", &["no change"]),
        ("save there.png", &[".toml"]),
    ] {
        let error = edits.run(line).unwrap_err();
        for word in words {
            assert!(error.contains(word), "{line}: {error}");
        }
        assert!(!error.contains(":1:"), "{line}: no place in a text that the user does not see: {error}");
        assert_eq!(edits.shown, before, "{line}");
    }
    assert_eq!(edits.saved(), SCENE);
}

#[test]
fn wrong_lines_are_refused() {
    let parse = |line: &str| {
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        EditCommand::parse(word, rest)
    };
    assert_eq!(parse("kick 1"), None);
    for (line, word) in [
        ("object", "add"),
        ("object fly a", "fly"),
        ("object move", "name"),
        ("object move a", "X Y Z"),
        ("object move a 1 2", "X Y Z"),
        ("object move a 1 2 inf", "X Y Z"),
        ("object scale a 1 2", "FACTOR"),
        ("object remove a b", "b"),
        ("object set a", "KEY VALUE"),
        ("object set a key", "KEY VALUE"),
        ("object add sphere", "KEY = VALUE"),
        ("object list all", "all"),
        ("material", "NAME"),
        ("material \"open", "NAME"),
        ("light", "number"),
        ("light 0 color 1", "number"),
        ("light x color 1", "number"),
        ("light add", "KEY = VALUE"),
        ("background", "KEY VALUE"),
        ("ambient", "VALUE"),
        ("undo 3", "3"),
        ("save", "file"),
    ] {
        let error = parse(line).unwrap().unwrap_err();
        assert!(error.contains(word), "{line}: {error}");
    }
}

#[test]
fn comments_and_order_remain_when_a_scene_is_edited_and_saved() {
    let mut edits = edits();
    edits.edit("object set ball center [1, 0.5, 0]");
    edits.edit("light 1 intensity 2");
    edits.edit("render samples 4");
    let expected = SCENE
        .replace("center = [0, 0.5, 0] #", "center = [1, 0.5, 0] #")
        .replace("intensity = 0.8 #", "intensity = 2 #")
        .replace("samples = 1 #", "samples = 4 #");
    assert_eq!(edits.saved(), expected);
}

#[test]
fn a_scene_that_is_saved_in_another_folder_is_the_same_there() {
    let mut edits = edits();
    edits.edit("object move ball 1 0 0");
    let elsewhere = tempfile::tempdir().unwrap();
    let path = elsewhere.path().join("copy.toml");
    edits.edit(&format!("save \"{}\"", path.display()));
    assert_eq!(rayfarm_tracer::scene::load(&path).unwrap().scene, edits.shown);
    let error =
        edits.run(&format!("save {}", elsewhere.path().join("no/such/a.toml").display())).unwrap_err();
    assert!(error.contains("a.toml"), "{error}");
}

#[test]
fn undo_and_redo_go_through_all_changes() {
    let mut edits = edits();
    let first = edits.shown.clone();
    let lines = ["object move ball 1 0 0", "material red diffuse [0, 0, 1]", "object remove crate"];
    let scenes: Vec<Scene> = lines.iter().map(|line| edits.edit(line).clone()).collect();
    for (index, line) in lines.iter().enumerate().rev() {
        assert_eq!(edits.run("undo").unwrap()["undone"], *line);
        assert_eq!(edits.shown, *index.checked_sub(1).map_or(&first, |before| &scenes[before]));
    }
    for (line, scene) in lines.iter().zip(&scenes) {
        assert_eq!(edits.run("redo").unwrap()["redone"], *line);
        assert_eq!(edits.shown, *scene);
    }
}

#[test]
fn changed_files_are_loaded_again_and_faults_keep_the_scene() {
    let mut edits = edits();
    assert!(edits.reload().is_none(), "nothing has changed");
    std::fs::write(edits.path("s.toml"), SCENE.replace("radius = 0.5", "radius = 0.75")).unwrap();
    edits.reload().unwrap().unwrap();
    assert_eq!(edits.shown.spheres[0].radius, 0.75);
    assert!(edits.reload().is_none());
    let before = edits.shown.clone();
    std::fs::write(edits.path("s.toml"), SCENE.replace("radius = 0.5", "raduis = 0.5")).unwrap();
    let fault = edits.reload().unwrap().unwrap_err();
    assert!(fault.contains("raduis") && fault.contains("s.toml:"), "{fault}");
    assert!(edits.shown == before && edits.reload().is_none(), "a fault is reported once");
    // The scene can be edited meanwhile, and a later file replaces it.
    assert_eq!(edits.edit("object set ball radius 3").spheres[0].radius, 3.0);
    std::fs::write(edits.path("s.toml"), SCENE.replace("radius = 0.5", "radius = 0.25")).unwrap();
    edits.reload().unwrap().unwrap();
    assert_eq!(edits.shown.spheres[0].radius, 0.25);
    assert_eq!(edits.run("undo").unwrap()["undone"], "the scene file has changed");
    assert_eq!(edits.shown.spheres[0].radius, 3.0);
    let path = edits.path("s.toml");
    let on_disk = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, "a fault").unwrap();
    let refused = edits.run(&format!("save {}", path.display())).unwrap_err();
    assert!(refused.contains("has changed"), "{refused}");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "a fault");
    std::fs::write(&path, on_disk).unwrap();
    // Saving over the file is no change of the scene.
    edits.edit(&format!("save {}", path.display()));
    let before = edits.shown.clone();
    assert!(edits.reload().is_none_or(|shown| shown.is_ok()) && edits.shown == before);
}

#[test]
fn a_changed_model_or_picture_is_loaded_into_the_edited_scene() {
    let mut edits = edits();
    edits.edit("object set ball radius 3");
    let (mesh, texture) = (edits.shown.models[0].mesh, edits.shown.textures[0].texture);
    let model = std::fs::read_to_string(edits.path("a.obj")).unwrap();
    std::fs::write(edits.path("a.obj"), "v").unwrap();
    assert!(edits.reload().unwrap().unwrap_err().contains("a.obj"));
    std::fs::write(edits.path("a.obj"), model.replace("v 1 0 0", "v 2 0 0")).unwrap();
    edits.reload().unwrap().unwrap();
    assert_ne!(edits.shown.models[0].mesh, mesh);
    assert_eq!((edits.shown.spheres[0].radius, edits.shown.textures[0].texture), (3.0, texture));
    let picture = rayfarm_tracer::image::RgbImage { width: 3, height: 1, pixels: vec![7; 9] };
    rayfarm_tracer::image::save(&edits.path("wood.png"), &picture).unwrap();
    edits.reload().unwrap().unwrap();
    assert_ne!(edits.shown.textures[0].texture, texture);
    std::fs::remove_file(edits.path("wood.png")).unwrap();
    assert!(edits.reload().unwrap().unwrap_err().contains("wood.png"));
}

#[test]
fn a_bare_model_becomes_a_scene_file() {
    for options in [
        LoadOptions::default(),
        LoadOptions { up: Some(Up::Z), crease_angle: Some(20.0), ..LoadOptions::default() },
    ] {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.obj"), "v 0 0 0\nv 1 0 0.3\nv 0 1 0.1\nf 1 2 3\n").unwrap();
        let mut edits = Edits::open(folder, "a.obj", Some(options));
        let bare = edits.shown.clone();
        edits.edit("object move model 1 0 0");
        assert_ne!(edits.shown, bare);
        edits.edit("undo");
        assert_eq!(edits.shown, bare, "{options:?}");
        let text = edits.saved();
        assert_eq!(rayfarm_tracer::scene::load(&edits.path("saved.toml")).unwrap().scene, bare, "{text}");
        std::fs::write(edits.path("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        edits.reload().unwrap().unwrap();
        assert_ne!(edits.shown.models[0].mesh, bare.models[0].mesh);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// For any edits: a refused edit changes nothing, and undoing all changes restores the file to the byte.
    #[test]
    fn all_changes_can_be_undone(
        steps in prop::collection::vec((0..9usize, 0..24u32, -2.0..2.0f64), 1..12),
    ) {
        let mut edits = edits();
        let first = edits.shown.clone();
        let mut changes = 0;
        for (what, object, number) in steps {
            let before = edits.shown.clone();
            let line = match what {
                0 => format!("object move {object} {number} 0 1"),
                1 => format!("object rotate {object} 0 {number} 0"),
                2 => format!("object scale {object} {number}"),
                3 => format!("object remove {object}"),
                4 => format!("object add sphere center = [0, {number}, 0], radius = {number}"),
                5 => format!("material red exponent {number}"),
                6 => format!("light {} intensity {number}", object % 3),
                7 => format!("background strength {number}"),
                _ => format!("object set {object} material red"),
            };
            match edits.run(&line) {
                Ok(_) => changes += 1,
                Err(_) => prop_assert_eq!(&edits.shown, &before, "{}", line),
            }
        }
        let last = edits.shown.clone();
        for _ in 0..changes {
            edits.edit("undo");
        }
        prop_assert_eq!(&edits.shown, &first);
        prop_assert_eq!(edits.saved(), SCENE);
        for _ in 0..changes {
            edits.edit("redo");
        }
        prop_assert_eq!(&edits.shown, &last);
    }
}
