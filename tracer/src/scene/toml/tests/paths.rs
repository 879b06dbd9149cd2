//! The path integrator, lenses, tone curves and metallic-roughness materials.

use super::*;
use crate::material::MetallicRoughness;
use crate::scene::{Integrator, Lens, PathSettings, Sampler, ToneCurve, ToneMapping};

const CAMERA: &str = "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\n";
const PATH: &str = "[render]\nintegrator = \"path\"\n";

fn render(keys: &str) -> RenderSettings {
    read(&format!("[render]\n{keys}\n")).unwrap().render
}

#[test]
fn the_path_integrator_has_its_settings_and_defaults() {
    let usual = render("integrator = \"path\"");
    assert_eq!(usual.integrator, Integrator::Path(PathSettings::DEFAULT));
    assert_eq!((usual.samples, usual.quality.max_depth), (64, 8));
    let all = render(
        "integrator = \"path\"\nsamples = 1000\nmax_depth = 5\nseed = 4294967295\nmax_noise = 0.25\nclamp_indirect = 10\n\
         sampler = \"independent\"\nroulette = false",
    );
    let settings = PathSettings {
        seed: u32::MAX,
        sampler: Sampler::Independent,
        roulette: false,
        clamp_indirect: 10.0,
        max_noise: 0.25,
    };
    assert_eq!(all.integrator, Integrator::Path(settings));
    assert_eq!((all.samples, all.quality.max_depth), (1000, 5));
    for samples in [1, 2, 3, 255, 257, 65_536] {
        assert_eq!(render(&format!("integrator = \"path\"\nsamples = {samples}")).samples, samples);
    }
    assert_eq!(render("integrator = \"direct\""), RenderSettings::default());
}

#[test]
fn exposure_and_tone_are_read_with_any_integrator() {
    for integrator in ["direct", "path"] {
        let tone = render(&format!("integrator = \"{integrator}\"\nexposure = -1.5\ntone = \"aces\"")).tone;
        assert_eq!(tone, ToneMapping { exposure: -1.5, curve: ToneCurve::Aces });
    }
    assert_eq!(render("").tone, ToneMapping::default());
}

#[test]
fn a_pinhole_camera_has_a_lens() {
    let lens = |keys: &str| read(&format!("{PATH}{CAMERA}{keys}\n")).unwrap().camera.unwrap().lens;
    assert_eq!(lens(""), Lens::default());
    let thin = Lens { aperture: 0.25, focus_distance: Some(3.5) };
    assert_eq!(lens("aperture = 0.25\nfocus_distance = 3.5"), thin);
    assert_eq!(lens("aperture = 0.25"), Lens { focus_distance: None, ..thin });
}

#[test]
fn any_of_its_keys_makes_a_material_metallic_roughness() {
    let material = |keys: &str| read(&format!("{PATH}[material.a]\n{keys}\n")).unwrap().materials[0];
    let usual = MetallicRoughness {
        metallic: 0.0,
        roughness: 0.5,
        transmission: 0.0,
        specular_factor: 1.0,
        texture: None,
    };
    assert_eq!(material("diffuse = [1, 0, 0]").metallic_roughness, None);
    for (keys, model) in [
        ("metallic = 1", MetallicRoughness { metallic: 1.0, ..usual }),
        ("roughness = 0.25", MetallicRoughness { roughness: 0.25, ..usual }),
        ("transmission = 0.75", MetallicRoughness { transmission: 0.75, ..usual }),
        ("specular_factor = 0", MetallicRoughness { specular_factor: 0.0, ..usual }),
        (
            "metallic_roughness_texture = { texture = \"a.png\" }",
            MetallicRoughness { metallic: 1.0, roughness: 1.0, ..usual },
        ),
        (
            "metallic_roughness_texture = { texture = \"a.png\" }\nmetallic = 0.5\nroughness = 0.75",
            MetallicRoughness { metallic: 0.5, roughness: 0.75, ..usual },
        ),
    ] {
        assert_eq!(material(keys).metallic_roughness, Some(model), "{keys}");
    }
    let gold = material("diffuse = [1, 0.75, 0.25]\nmetallic = 1\nior = 2\nemission = [1, 1, 1]");
    assert_eq!((gold.diffuse, gold.ior, gold.emission), (Vec3::new(1.0, 0.75, 0.25), 2.0, Vec3::ONE));
    let text = "[material.a]\nmetallic_roughness_texture = { texture = \"rough.png\", wrap = \"mirror\" }\n";
    let scene = read(text).unwrap();
    let texture = scene.textures[&0].metallic_roughness.as_ref().unwrap();
    assert_eq!((texture.file.to_str(), texture.tiling.wrap), (Some("rough.png"), Wrap::Mirror));
    assert_eq!(place(text, texture.at), (2, 42));
    assert!(scene.textures[&0].distinguish_repeats());
}

#[test]
fn faults_of_paths_name_their_place() {
    let path = |key: &str| format!("{PATH}{key}");
    let material = |key: &str| format!("[material.a]\n{key}");
    let camera = |key: &str| format!("{CAMERA}{key}");
    for (text, place, words) in [
        (path("samples = 0"), "3:11", "a whole number from 1 to 65536, but is 0"),
        (path("samples = 65537"), "3:11", "a whole number from 1 to 65536"),
        (path("samples = 1.5"), "3:11", "a whole number from 1 to 65536"),
        (path("seed = -1"), "3:8", "from 0 to 4294967295, but is -1"),
        (path("seed = 4294967296"), "3:8", "from 0 to 4294967295"),
        (path("max_noise = 1.5"), "3:13", "from 0 to 1"),
        (path("max_noise = nan"), "3:13", "from 0 to 1"),
        (path("clamp_indirect = -1"), "3:18", "from 0 to 1000000"),
        (path("clamp_indirect = inf"), "3:18", "from 0 to 1000000"),
        (path("sampler = \"random\""), "3:11", "known here: `sobol`, `independent`"),
        (path("roulette = 1"), "3:12", "true or false"),
        (path("exposure = 65"), "3:12", "from -64 to 64"),
        (path("tone = \"filmic\""), "3:8", "`srgb`, `agx`, `aces`, `neutral`"),
        ("[render]\nintegrator = \"paths\"".to_owned(), "2:14", "did you mean `path`?"),
        ("[render]\nsamples = 1000".to_owned(), "2:11", "square from 1 to 256"),
        (camera("aperture = -1"), "4:12", "from 0 to 1e30"),
        (camera("aperture = inf"), "4:12", "from 0 to 1e30"),
        (camera("focus_distance = 0"), "4:18", "above 0"),
        (material("metallic = 1.5"), "2:12", "from 0 to 1"),
        (material("roughness = -0.5"), "2:13", "from 0 to 1"),
        (material("transmission = nan"), "2:16", "from 0 to 1"),
        (material("specular_factor = 2"), "2:19", "from 0 to 1"),
        (material("metallic_roughness_texture = \"a.png\""), "2:30", "must be a table"),
        (material("metallic = 1\nreflect = 2"), "3:11", "from 0 to 1"),
    ] {
        assert_faults(&[(&text, place, &[words])]);
    }
}

#[test]
fn keys_of_the_other_integrator_are_warned_about() {
    let direct = |key: &str| format!("`{key}` in [render] has no effect with the direct integrator");
    for (line, key) in [
        ("seed = 1", "seed"),
        ("max_noise = 0.1", "max_noise"),
        ("clamp_indirect = 1", "clamp_indirect"),
        ("sampler = \"sobol\"", "sampler"),
        ("roulette = true", "roulette"),
    ] {
        let found = warnings(&format!("[render]\n{line}\n"));
        assert!(found.len() == 1 && found[0].ends_with(&direct(key)), "{found:?}");
        assert_eq!(warnings(&format!("{PATH}{line}\n")), [""; 0]);
    }
    for (line, key) in [
        ("adaptive = true\nsamples = 1", "adaptive"),
        ("shadows = false", "shadows"),
        ("shadow_samples = 4", "shadow_samples"),
        ("smooth_terminator = true", "smooth_terminator"),
        ("min_contribution = 0.1", "min_contribution"),
        ("exponent = \"fast\"", "exponent"),
    ] {
        let found = warnings(&format!("{PATH}{line}\n"));
        let expected = format!("`{key}` in [render] has no effect with the path integrator");
        assert!(found.len() == 1 && found[0].ends_with(&expected), "{found:?}");
    }
    let found = warnings(&format!("{PATH}shading = \"diffuse\"\n"));
    assert!(found.len() == 1 && found[0].contains("`shading` in [render] has no effect"), "{found:?}");
    assert_eq!(warnings(&format!("{PATH}shading = \"normals\"\n")), [""; 0]);
    assert_eq!(
        warnings(&format!("ambient = [1, 1, 1]\n{PATH}")),
        ["1:11 `ambient` in the scene file has no effect with the path integrator"]
    );
    let light = "[[light]]\nposition = [0, 0, 0]\nradius = 1\nshadow_samples = 4\n";
    assert_eq!(
        warnings(&format!("{PATH}{light}{light}")),
        ["6:18 `shadow_samples` in [[light]] has no effect with the path integrator"]
    );
}

#[test]
fn keys_of_a_lens_without_effect_are_warned_about() {
    for (head, keys, expected) in [
        ("", "aperture = 1", "`aperture` in [camera] has no effect with the direct integrator"),
        ("", "focus_distance = 1", "`focus_distance` in [camera] has no effect with the direct integrator"),
        (PATH, "focus_distance = 1", "`focus_distance` in [camera] has no effect without an `aperture`"),
        (
            PATH,
            "kind = \"fisheye\"\naperture = 1",
            "`aperture` in [camera] has no effect on a fisheye camera",
        ),
        (
            PATH,
            "kind = \"orthographic\"\naperture = 1",
            "`aperture` in [camera] has no effect on an orthographic camera",
        ),
    ] {
        let found = warnings(&format!("{head}{CAMERA}{keys}\n"));
        assert!(found.len() == 1 && found[0].ends_with(expected), "{found:?}");
    }
}

#[test]
fn keys_without_effect_on_metallic_roughness_are_warned_about() {
    let of = |keys: &str| warnings(&format!("{PATH}[material.a]\n{keys}\n"));
    let model = "on a metallic-roughness material";
    for (keys, key, reason) in [
        ("metallic = 1\nspecular = [1, 1, 1]", "specular", model),
        ("metallic = 1\nexponent = 5", "exponent", model),
        ("metallic = 1\nreflect = 1", "reflect", model),
        ("metallic = 1\ntransmit = 1", "transmit", model),
        ("metallic = 1\nfresnel = true", "fresnel", model),
        ("metallic = 1\nabsorption = 0.5", "absorption", "without `transmission`"),
        ("metallic = 1\nthin = true", "thin", "without `transmission`"),
    ] {
        let expected = format!("`{key}` in [material.a] has no effect {reason}");
        let found = of(keys);
        assert!(found.len() == 1 && found[0].ends_with(&expected), "{keys}: {found:?}");
    }
    assert_eq!(of("roughness = 0.5\nior = 1.25"), [""; 0]);
    assert_eq!(of("transmission = 1\nabsorption = 0.5\nior = 1.25"), [""; 0]);
    assert_eq!(of("transmission = 1\nthin = true"), [""; 0]);
    let key = "metallic_roughness_texture";
    let textured = format!("[material.a]\n{key} = {{ texture = \"a.png\" }}\n");
    let expected = format!("2:30 `{key}` in [material.a] has no effect with the direct integrator");
    assert_eq!(warnings(&textured), [expected]);
    assert_eq!(warnings(&format!("{PATH}{textured}")), [""; 0]);
}
