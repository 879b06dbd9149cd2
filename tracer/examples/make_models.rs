//! Writes the meshes, textures and skies of `models/`, and its scenes of many balls.
//!
//! `cargo run --release -p rayfarm-tracer --example make_models -- models`
//!
//! The output is a function of this code alone, byte for byte, on every platform; `tracer/tests/models.rs` compares
//! it with the files in the repository.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[path = "make_models/mod.rs"]
mod generator;

use generator::Content;
use rayfarm_tracer::image;

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    let (Some(folder), None) = (arguments.next(), arguments.next()) else {
        eprintln!("usage: make_models FOLDER   (the repository's models folder)");
        return ExitCode::from(2);
    };
    match write_all(&PathBuf::from(folder)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("make_models: {error}");
            ExitCode::FAILURE
        }
    }
}

fn write_all(folder: &Path) -> Result<(), String> {
    for file in generator::files() {
        let path = folder.join(&file.path);
        let told = |error: std::io::Error| format!("cannot write {}: {error}", path.display());
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).map_err(told)?;
        }
        match &file.content {
            Content::Text(text) => std::fs::write(&path, text).map_err(told)?,
            Content::Picture(picture) => image::save(&path, picture).map_err(|error| error.to_string())?,
            Content::Light(picture) => {
                generator::save_light(&path, picture).map_err(|error| error.to_string())?;
            }
        }
        println!("{:28} {:8} triangles", file.path, file.triangles);
    }
    Ok(())
}
