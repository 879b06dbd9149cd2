//! Picture files of material libraries: where they are found, and files that are no pictures.

use super::*;

#[test]
fn an_unreadable_texture_of_a_model_is_a_warning() {
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
fn pictures_with_foreign_paths_are_found_with_one_warning() {
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
fn pictures_outside_the_models_folder_need_an_option() {
    let folder = naming("../tile.png");
    let allowed = LoadOptions { allow_parent_textures: true, ..LoadOptions::default() };
    for file in ["m/a.obj", "s.toml"] {
        let LoadedScene { textures, warnings, .. } = folder.load(file);
        assert!(textures.is_empty());
        assert!(warnings.len() == 1 && warnings[0].contains("--allow-parent-textures"), "{warnings:?}");
        let LoadedScene { textures, warnings, .. } = load_with(&folder.path(file), allowed).unwrap();
        assert_eq!((textures.len(), warnings), (1, Vec::new()), "{file}");
    }
    let compiled =
        compile_model_with(&folder.path("m/a.obj"), &folder.path("m"), CompileOptions::default(), allowed);
    assert_eq!(compiled.unwrap().0.materials()[0].texture.as_ref().unwrap().file, "../tile.png");
    // A missing picture is reported as such.
    let folder = naming("../none.png");
    let LoadedScene { warnings, .. } = load_with(&folder.path("m/a.obj"), allowed).unwrap();
    assert!(warnings.len() == 1 && warnings[0].contains("cannot read"), "{warnings:?}");
}

#[test]
fn pictures_of_every_format_become_textures() {
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
        assert!(warnings[0].contains("cut.jpg: "), "{warnings:?}");
    }
}

#[test]
fn files_of_other_formats_are_named_once() {
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
