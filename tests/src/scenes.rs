//! Scenes and temporary folders for tests.

use std::path::{Path, PathBuf};

use tempfile::TempDir;

use crate::require::require_file;

/// Returns the top folder of the project.
pub fn project_root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// Returns the path of a mesh or a workload in the folder `../shared` of the project, which some machines have. Where the
/// file does not exist, prints a skip and returns `None`: the test is to return then.
pub fn shared(file: &str) -> Option<PathBuf> {
    let path = project_root().join("../shared").join(file);
    require_file(&path).then_some(path)
}

/// A temporary folder with the scene `small.toml` and its mesh `bumps.obj`. Removed when it is dropped.
pub struct Scenes {
    folder: TempDir,
}

impl Scenes {
    /// Makes the folder and writes its files.
    pub fn new() -> Self {
        let scenes = Self { folder: tempfile::tempdir().unwrap() };
        scenes.write("small.toml", SMALL);
        scenes.write("bumps.obj", bumps(40));
        scenes
    }

    /// Returns the path of a file in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file in the folder and returns its path.
    pub fn write(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        std::fs::write(self.path(name), text).unwrap();
        self.path(name)
    }

    /// Reads a file of the folder.
    pub fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// Returns the names of all files in the folder.
    pub fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path()).unwrap();
        entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect()
    }
}

impl Default for Scenes {
    fn default() -> Self {
        Self::new()
    }
}

/// A scene with two models of one mesh, a plane, a sphere, a point light and a spot light.
const SMALL: &str = r#"
ambient = [0.05, 0.05, 0.05]

[render]
width = 160
height = 120

[camera]
position = [0.0, 2.0, 5.0]
look_at = [0.0, 0.3, 0.0]
fov = 45.0

[background]
gradient = { bottom = [0.3, 0.3, 0.3], top = [0.2, 0.4, 0.8] }

[[light]]
kind = "point"
position = [3.0, 5.0, 4.0]
intensity = 0.8

[[light]]
kind = "spot"
position = [-3.0, 4.0, 2.0]
look_at = [0.0, 0.0, 0.0]
beam_angle = 40.0
penumbra = 8.0
color = [1.0, 0.7, 0.4]

[material.clay]
diffuse = [0.7, 0.4, 0.3]
specular = [0.3, 0.3, 0.3]
exponent = 30.0

[[model]]
file = "bumps.obj"
material = "clay"
translate = [-1.1, 0.2, 0.0]

[[model]]
file = "bumps.obj"
material = "clay"
normals = "flat"
translate = [1.1, 0.2, -0.5]
rotate = [0.0, 40.0, 0.0]

[[sphere]]
center = [0.0, 0.5, 0.8]
radius = 0.5
material = "clay"

[[plane]]
point = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
material = "clay"
"#;

/// Returns an OBJ file with a bumpy sheet of n x n squares, two units wide.
pub fn bumps(n: u32) -> String {
    use std::fmt::Write;
    let mut obj = String::from("# a bumpy sheet\n");
    for (x, z) in (0..=n).flat_map(|z| (0..=n).map(move |x| (x, z))) {
        let [u, v] = [x, z].map(|i| f64::from(i) / f64::from(n) * 2.0 - 1.0);
        let height = 0.2 * (1.0 - u * u) * (1.0 - v * v) * f64::from((x * 5 + z * 3) % 7) / 3.0;
        writeln!(obj, "v {u:.4} {height:.4} {v:.4}").unwrap();
    }
    for (x, z) in (0..n).flat_map(|z| (0..n).map(move |x| (x, z))) {
        let at = |x: u32, z: u32| z * (n + 1) + x + 1;
        writeln!(obj, "f {} {} {} {}", at(x, z), at(x, z + 1), at(x + 1, z + 1), at(x + 1, z)).unwrap();
    }
    obj
}
