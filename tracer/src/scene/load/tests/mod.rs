//! Scenes and models from files to loaded scenes.

mod animated;
mod keys;
mod models;
mod pictures;
mod reloads;
mod scenes;
mod skies;
mod textures;

use glam::{DVec3, Vec2, Vec3};

use super::*;
use crate::image::{self, RgbImage};
use crate::mesh::{CompileOptions, TextureFile};
use crate::scene::{Attenuation, Filter, LightKind, Material, Model, NormalMode, Tiling, Up, Wrap};

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
