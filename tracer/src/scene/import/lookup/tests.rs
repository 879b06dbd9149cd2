use super::*;

fn folder(files: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for file in files {
        let path = folder.path().join("model").join(file);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, "x").unwrap();
    }
    folder
}

/// The name of the file that is found, and whether it is at the named path.
fn find(
    folder: &tempfile::TempDir,
    inner: &str,
    name: &str,
    may_leave: bool,
) -> Result<(String, bool), Missing> {
    let model = folder.path().join("model");
    let found = Lookup::new(&model, may_leave).find(Path::new(inner), name)?;
    assert_eq!(std::fs::read(&found.path).unwrap(), b"x");
    Ok((found.name, found.as_named))
}

#[test]
fn names_are_found_at_their_path() {
    let folder = folder(&["wood.png", "maps/two words.png", "lib/oak.png", "a #1.png", "50%25.png"]);
    for (inner, name, found) in [
        ("", "wood.png", "wood.png"),
        ("", "./maps/../wood.png", "wood.png"),
        ("", "maps\\two words.png", "maps/two words.png"),
        ("", "maps\\\\two words.png", "maps/two words.png"),
        ("lib", "oak.png", "lib/oak.png"),
        ("lib", "../wood.png", "wood.png"),
        ("lib", ".\\..\\maps\\two words.png", "maps/two words.png"),
        ("", "\"maps/two words.png\"", "maps/two words.png"),
        ("", "'wood.png' # oak", "wood.png"),
        ("", "wood.png # oak", "wood.png"),
        ("", "wood.png\t#oak", "wood.png"),
        ("", "a #1.png", "a #1.png"),
        ("", "\"a #1.png\"", "a #1.png"),
        ("", "maps/two\\ words.png", "maps/two words.png"),
        ("", "maps/two%20words.png", "maps/two words.png"),
        ("", "50%25.png", "50%25.png"),
    ] {
        assert_eq!(find(&folder, inner, name, false), Ok((found.to_owned(), true)), "{inner} {name}");
    }
}

#[test]
fn foreign_paths_are_found_by_their_last_parts() {
    let folder = folder(&["wood.png", "Maps/Oak.PNG", "lib/wood.png", "lib/pine.png", "grün.png"]);
    for (inner, name, found) in [
        ("", "WOOD.png", "wood.png"),
        ("", "maps/oak.png", "Maps/Oak.PNG"),
        ("", "GRÜN.PNG", "grün.png"),
        ("", "C:\\Users\\me\\maps\\oak.png", "Maps/Oak.PNG"),
        ("", "C:\\\\Users\\\\me\\\\wood.png", "wood.png"),
        ("", "C:wood.png", "wood.png"),
        ("", "\"D:\\my models\\wood.png\"", "wood.png"),
        ("", "/home/me/lib/pine.png", "lib/pine.png"),
        ("", "\\\\host\\share\\wood.png", "wood.png"),
        ("", "file:///C:/me/wood.png", "wood.png"),
        ("", "textures/wood.png", "wood.png"),
        ("", "../textures/wood.png", "wood.png"),
        ("lib", "/home/me/wood.png", "lib/wood.png"),
        ("lib", "/home/me/maps/oak.png", "Maps/Oak.PNG"),
        ("", "/1/2/3/4/5/6/7/8/9/10/wood.png", "wood.png"),
    ] {
        assert_eq!(find(&folder, inner, name, false), Ok((found.to_owned(), false)), "{inner} {name}");
    }
}

#[test]
fn missing_files_have_reasons() {
    let folder = folder(&["wood.png", "maps/a.png"]);
    std::fs::write(folder.path().join("oak.png"), "x").unwrap();
    for (name, missing) in [
        ("oak.png", Missing::NotThere),
        ("maps", Missing::NotThere),
        ("", Missing::NotThere),
        ("..", Missing::Above),
        ("../oak.png", Missing::Above),
        ("maps/../../oak.png", Missing::Above),
        ("\"..\\oak.png\" # outside", Missing::Above),
        ("/etc/hostname", Missing::Absolute),
        ("C:\\oak.png", Missing::Absolute),
        ("a\0b", Missing::NotThere),
    ] {
        assert_eq!(find(&folder, "", name, false), Err(missing), "{name}");
    }
    let absolute = folder.path().join("oak.png");
    assert_eq!(find(&folder, "", absolute.to_str().unwrap(), true), Err(Missing::Absolute));
}

#[test]
fn relative_names_lead_out_of_the_folder_where_that_is_allowed() {
    let folder = folder(&["source/a.obj", "wood.png"]);
    std::fs::create_dir(folder.path().join("Textures")).unwrap();
    std::fs::write(folder.path().join("Textures/oak.png"), "x").unwrap();
    for (inner, name, found, as_named) in [
        ("", "../Textures/oak.png", "../Textures/oak.png", true),
        ("source", "../../Textures/oak.png", "../Textures/oak.png", true),
        ("", "..\\textures\\OAK.png", "../Textures/oak.png", false),
        ("", "../Textures/wood.png", "wood.png", false),
    ] {
        assert_eq!(find(&folder, inner, name, true), Ok((found.to_owned(), as_named)), "{inner} {name}");
    }
    assert_eq!(find(&folder, "", "../Textures/oak.png", false), Err(Missing::Above));
}

#[cfg(unix)]
#[test]
fn links_lead_out_of_the_folder_only_where_that_is_allowed() {
    let folder = folder(&["maps/wood.png"]);
    std::fs::write(folder.path().join("oak.png"), "x").unwrap();
    let model = folder.path().join("model");
    std::os::unix::fs::symlink(folder.path().join("oak.png"), model.join("oak.png")).unwrap();
    std::os::unix::fs::symlink(model.join("maps"), model.join("inside")).unwrap();
    std::os::unix::fs::symlink(folder.path(), model.join("up")).unwrap();
    for name in ["oak.png", "OAK.png", "up/oak.png", "/a/oak.png"] {
        let missing = if name.starts_with('/') { Missing::Absolute } else { Missing::Link };
        assert_eq!(find(&folder, "", name, false), Err(missing), "{name}");
        assert!(find(&folder, "", name, true).is_ok(), "{name}");
    }
    assert!(find(&folder, "", "inside/wood.png", false).is_ok());
}

#[cfg(unix)]
#[test]
fn names_on_disk_may_be_in_an_old_encoding() {
    use std::os::unix::ffi::OsStrExt;
    let folder = folder(&["a.obj"]);
    let name = std::ffi::OsStr::from_bytes(b"gr\xfcn.png");
    std::fs::write(folder.path().join("model").join(name), "x").unwrap();
    assert_eq!(find(&folder, "", "grün.png", false), Ok(("grün.png".to_owned(), false)));
}

#[test]
fn paths_remain_inside_the_folder() {
    for (inner, name, expected) in [
        ("", "wood.png", Some("wood.png")),
        ("lib", "maps\\wood.png", Some("lib/maps/wood.png")),
        ("lib", "../wood.png", Some("wood.png")),
        ("lib", "./a/../b.png # b", Some("lib/b.png")),
        ("lib", "../../wood.png", None),
        ("", "/etc/a.png", None),
        ("", "C:\\a.png", None),
        ("", "..", None),
        ("", ".", None),
    ] {
        let way = Lookup::new(Path::new(""), false).way(Path::new(inner), name);
        assert_eq!(way.as_deref(), expected, "{inner} {name}");
    }
}

#[test]
fn very_long_names_are_not_searched() {
    let folder = folder(&["wood.png"]);
    let name = format!("{}wood.png", "../".repeat(1 << 20));
    assert_eq!(find(&folder, "", &name, true), Err(Missing::NotThere));
}
