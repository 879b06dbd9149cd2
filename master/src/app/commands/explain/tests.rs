use std::path::Path;

use rayfarm_tracer::scene::{Quality, Shading};

use super::*;
use crate::app::cli::ModelArgs;

fn explained(scene: &str) -> Explanation {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("quad.obj"), QUAD).unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, scene).unwrap();
    of_file(&path)
}

fn of_file(path: &Path) -> Explanation {
    of_source(&Source::load(path, ModelArgs::default(), None).unwrap())
}

fn of_source(source: &Source) -> Explanation {
    let scene = &source.scene;
    explain(source, &ViewRequest { view: FrameView::of(scene), scale: scene.render.scale }).unwrap()
}

const QUAD: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";

/// A scene that uses no feature: flat, diffuse, without shadows.
const BARE: &str = "
    render = { width = 64, height = 48 }
    camera = { position = [0, 0, 4], look_at = [0, 0, 0] }
    material = { red = { diffuse = [0.8, 0.1, 0.1], specular = [0, 0, 0] } }
    light = [{ kind = 'point', position = [1, 2, 3], shadows = false }]
    model = [{ file = 'quad.obj', material = 'red', normals = 'flat' }, { file = 'quad.obj', material = 'red', normals = 'flat' }]
";

fn asked_for(explanation: &Explanation) -> Vec<&'static str> {
    explanation.features.iter().filter(|feature| feature.asked_for).map(|feature| feature.name).collect()
}

#[test]
fn a_bare_scene_uses_no_feature_and_its_savings_are_listed() {
    let bare = explained(BARE);
    assert_eq!(asked_for(&bare), Vec::<&str>::new());
    assert_eq!((bare.things.models, bare.meshes.len(), bare.meshes[0].instances), (2, 1, 2));
    assert_eq!((bare.triangles, bare.meshes[0].triangles), (4, 2));
    assert_eq!(bare.meshes[0].file, "quad.obj");
    assert!(text::text(&bare).contains("\nquad.obj "), "{}", text::text(&bare));
    assert_eq!(bare.rays_per_frame_at_most, Rays { primary: 64 * 48, shadow: 0, secondary: 0 });
    let saved: usize = bare.features.iter().map(|feature| feature.bytes).sum();
    assert!(saved > 0 && bare.meshes[0].normal_bytes == 0, "{bare:?}");
    assert!(!bare.kernels.iter().any(|kernel| kernel.contains("shadows") || kernel.contains("texels")));
}

#[test]
fn each_key_that_uses_a_feature_is_listed() {
    let cases = [
        ("shadows = false", "shadows = true", "shadows"),
        ("specular = [0, 0, 0]", "specular = [0.1, 0, 0]", "specular term"),
        ("normals = 'flat'", "normals = 'smooth'", "smooth normals"),
        ("height = 48", "height = 48, samples = 4", "several samples per pixel"),
    ];
    for (key, more, name) in cases {
        let explanation = explained(&BARE.replace(key, more));
        assert_eq!(asked_for(&explanation), [name], "{more}");
    }
}

#[test]
fn emission_textures_vertex_colours_and_cut_outs_are_listed() {
    let lamp = explained(&BARE.replace("specular = [0, 0, 0]", "emission = [1, 1, 0]"));
    assert_eq!(asked_for(&lamp), ["emission"]);
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    let text = "mtllib m.mtl\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nvt 0 0\nvt 1 1\nusemtl photo\nf 1/1 2/2 3/1\n";
    write("m.obj", text.as_bytes());
    write("m.mtl", b"newmtl photo\nillum 0\nmap_Kd photo.ppm\nmap_d holes.ppm\n");
    write("photo.ppm", b"P6\n2 1\n255\nabcdef");
    write("holes.ppm", b"P6\n2 1\n255\n\0\0\0\xff\xff\xff");
    let photo = of_file(&folder.path().join("m.obj"));
    for name in ["textures", "vertex colours", "unlit materials", "cut-outs"] {
        assert!(asked_for(&photo).contains(&name), "{name}: {:?}", asked_for(&photo));
    }
    assert_eq!(photo.textures.iter().filter(|texture| texture.alpha).count(), 1);
    assert!(photo.meshes[0].color_bytes > 0);
    assert!(text::text(&photo).contains("with alpha"));
    assert!(photo.kernels.iter().any(|kernel| kernel.starts_with("cut-outs")));
}

#[test]
fn adaptive_samples_are_a_stage() {
    let regular = explained(&BARE.replace("height = 48", "height = 48, samples = 4"));
    let adaptive = explained(&BARE.replace("height = 48", "height = 48, samples = 4, adaptive = true"));
    let has_stage =
        |explanation: &Explanation| explanation.kernels.iter().any(|kernel| kernel.contains("corner"));
    assert_eq!((has_stage(&regular), has_stage(&adaptive)), (false, true));
    assert_eq!(asked_for(&regular), asked_for(&adaptive));
    assert!(text::text(&adaptive).contains("adaptive samples"));
}

#[test]
fn textures_are_listed_with_their_bytes() {
    let textured = of_file(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/textured.toml"));
    assert!(asked_for(&textured).contains(&"textures"));
    let feature = textured.features.iter().find(|feature| feature.name == "textures").unwrap();
    let pictures: usize = textured.textures.iter().map(|texture| texture.bytes).sum();
    let uvs: usize = textured.meshes.iter().map(|mesh| mesh.uv_bytes).sum();
    assert!(uvs > 0 && pictures > 0);
    assert_eq!((feature.bytes, textured.memory.textures), (pictures + uvs, pictures));
    assert!(textured.kernels.iter().any(|kernel| kernel.contains("texels")));
}

#[test]
fn a_feature_that_is_turned_off_is_not_in_use() {
    let more = BARE.replace("shadows = false", "shadows = true");
    let more = more.replace("specular = [0, 0, 0]", "specular = [0.1, 0, 0]");
    assert_eq!(asked_for(&explained(&more)), ["shadows", "specular term"]);
    let keys = "height = 48, shadows = false, shading = 'diffuse', pixels = 'reduced', scale = 0.5";
    let less = explained(&more.replace("height = 48", keys));
    assert_eq!(asked_for(&less), Vec::<&str>::new());
    assert_eq!((less.width, less.height), (64, 48));
    assert_eq!(less.rays_per_frame_at_most, Rays { primary: 32 * 24, shadow: 0, secondary: 0 });
    assert_eq!(less.travel.pixels_per_frame, 32 * 24 * 2);
    let text = text::text(&less);
    for words in
        ["turned off", "scale 1/2, no shadows, diffuse only, 16-bit colours", "rounded to 5, 6 and 5"]
    {
        assert!(text.contains(words), "{words} is missing in:\n{text}");
    }
}

#[test]
fn only_knobs_that_can_change_the_picture_have_an_effect() {
    assert_eq!(explained(BARE).knobs_with_effect, ["samples", "scale", "colors", "dither"]);
    let more = BARE.replace("shadows = false", "shadows = true");
    let more = more.replace("specular = [0, 0, 0]", "specular = [0.1, 0, 0], exponent = 10.5");
    let more = more.replace("height = 48", "height = 48, samples = 4");
    let expected = ["samples", "scale", "adaptive", "shadows", "shading", "exponent", "colors", "dither"];
    let explanation = explained(&more);
    assert_eq!(explanation.knobs_with_effect, expected);
    assert!(text::text(&explanation).contains(&expected.join(", ")));
}

/// [`BARE`] with shadows and these quality knobs, and mirrors.
fn mirrors(quality: Quality) -> Explanation {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("quad.obj"), QUAD).unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, BARE.replace("shadows = false", "shadows = true")).unwrap();
    let mut source = Source::load(&path, ModelArgs::default(), None).unwrap();
    source.scene.materials.iter_mut().for_each(|material| material.reflect = glam::Vec3::splat(0.5));
    source.scene.render.quality = quality;
    of_source(&source)
}

#[test]
fn bounces_count_as_secondary_rays_with_their_own_shadows() {
    let primary = 64 * 48;
    let mirrors = mirrors(Quality { max_depth: 3, ..Quality::default() });
    let most = Rays { primary, shadow: primary * 4, secondary: primary * 3 };
    assert_eq!(mirrors.rays_per_frame_at_most, most);
    assert_eq!(asked_for(&mirrors), ["shadows", "reflection, transmission"]);
    assert!(text::text(&mirrors).contains("9,216 secondary"), "{}", text::text(&mirrors));
    let expected = ["samples", "scale", "shadows", "depth", "min_contribution", "colors", "dither"];
    assert_eq!(mirrors.knobs_with_effect, expected);
    assert!(mirrors.kernels.iter().any(|kernel| kernel.contains("up to depth 3")));
}

#[test]
fn without_depth_nothing_bounces() {
    let none = mirrors(Quality { max_depth: 0, ..Quality::default() });
    assert_eq!(none.rays_per_frame_at_most.secondary, 0);
    assert_eq!(asked_for(&none), ["shadows"]);
    assert!(text::text(&none).contains("not at full quality: depth 0"));
}

#[test]
fn pictures_without_light_have_no_stage_of_light() {
    let normals = mirrors(Quality { shading: Shading::Normals, ..Quality::default() });
    let rays = Rays { primary: 64 * 48, shadow: 0, secondary: 0 };
    assert_eq!((normals.rays_per_frame_at_most, asked_for(&normals)), (rays, vec![]));
    assert_eq!(normals.knobs_with_effect, ["samples", "scale", "shading", "colors", "dither"]);
    let text = text::text(&normals);
    assert!(text.contains("normals in place of light") && !text.contains("not at full quality"), "{text}");
}

#[test]
fn the_origin_of_percentages_is_named() {
    assert!(text::text(&explained(BARE)).contains(features::MEASURED_ON));
}

#[test]
fn transfers_are_the_bytes_on_the_wire() {
    let bare = explained(BARE);
    let assets = bare.meshes.iter().map(|mesh| mesh.bytes).sum::<usize>();
    assert_eq!(bare.travel.once, bare.travel.scene_body + assets);
    // The documentation promises these bounds.
    assert!((48..256).contains(&bare.travel.per_frame), "{:?}", bare.travel);
    assert_eq!(bare.travel.pixels_per_frame, 64 * 48 * 3);
}

#[test]
fn the_text_has_every_feature_and_figure() {
    let room = of_file(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/room.toml"));
    let text = text::text(&room);
    for feature in &room.features {
        assert!(text.contains(feature.name), "{} is missing in:\n{text}", feature.name);
    }
    for words in ["209,972 triangles", "to a worker once", "786,432 primary", "and ", " more"] {
        assert!(text.contains(words), "{words} is missing in:\n{text}");
    }
}
