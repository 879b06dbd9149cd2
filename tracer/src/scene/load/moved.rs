//! A compiled model that is kept in another folder than its source: the pictures of its materials stay where they are.

use std::path::{Component, Path, PathBuf};

use crate::mesh::{CompiledMesh, MeshError};

/// The mesh with its pictures named relative to the folder `to` where they were relative to `from`: absolute where no way
/// leads from one to the other, as between drives. `None` when nothing changes.
pub(super) fn texture_names(
    mesh: &CompiledMesh,
    from: &Path,
    to: &Path,
) -> Result<Option<CompiledMesh>, MeshError> {
    let mut materials = mesh.materials();
    let (from, to) = (absolute(from), absolute(to));
    if from == to || materials.iter().all(|slot| slot.textures().next().is_none()) {
        return Ok(None);
    }
    for texture in materials.iter_mut().flat_map(|slot| slot.textures_mut()) {
        texture.file = name_from(&to, &from.join(&texture.file));
    }
    mesh.with_materials(&materials).map(Some)
}

/// Whether a picture of the mesh's materials is outside of the folder that the mesh is in.
pub(super) fn leads_out(mesh: &CompiledMesh) -> bool {
    let outside = |file: &str| file.starts_with("../") || Path::new(file).is_absolute();
    mesh.materials().iter().any(|slot| slot.textures().any(|texture| outside(&texture.file)))
}

/// With links followed, as the way back through `..` will follow them.
fn absolute(folder: &Path) -> PathBuf {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    folder.canonicalize().or_else(|_| std::path::absolute(folder)).unwrap_or_else(|_| folder.to_owned())
}

/// The way from a folder to a file, both absolute.
fn name_from(folder: &Path, file: &Path) -> String {
    let shared = folder.components().zip(file.components()).take_while(|(a, b)| a == b).count();
    if shared == 0 {
        return file.to_string_lossy().into_owned();
    }
    let up = folder.components().skip(shared).map(|_| "..".into());
    let down = file.components().skip(shared).map(Component::as_os_str).map(|part| part.to_string_lossy());
    up.chain(down).collect::<Vec<_>>().join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_goes_up_and_down_again() {
        for (folder, file, name) in [
            ("/a/b", "/a/b/c/wood.png", "c/wood.png"),
            ("/a/b", "/a/wood.png", "../wood.png"),
            ("/a/b/c", "/d/e/wood.png", "../../../d/e/wood.png"),
            ("/", "/wood.png", "wood.png"),
        ] {
            assert_eq!(name_from(Path::new(folder), Path::new(file)), name);
        }
        assert_eq!(name_from(Path::new("C:"), Path::new("/wood.png")), "/wood.png");
    }
}
