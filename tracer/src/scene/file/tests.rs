//! Every class of fault, with its place and the words that help.

use glam::{DVec3, Vec2};
use proptest::prelude::*;

use super::*;
use crate::scene::{Attenuation, Filter, LightKind, NormalMode, Tiling, Wrap};

/// A scene with one of everything, as the format's page shows it.
const WHOLE: &str = r#"
ambient = [0.05, 0.05, 0.05]
[render]
width = 640
height = 480
samples = 9
max_depth = 5
min_contribution = 0.004
[camera]
kind = "pinhole"
position = [0.0, 1.0, 4.0]
look_at = [0.0, 1.0, 0.0]
up = [0.0, 1.0, 0.0]
fov = 35.0
zoom = 2
[background]
gradient = { bottom = [0.1, 0.1, 0.1], top = [1, 1, 1] }
[[light]]
kind = "spot"
position = [3, 6, 4]
look_at = [3, 0, 4]
color = [1.0, 0.5, 0.25]
intensity = 4.0
attenuation = { constant = 1, linear = 0.1, quadratic = 0.01 }
beam_angle = 60
penumbra = 10
radius = 0.0
shadows = false
[[light]]
kind = "directional"
direction = [0, -10, 0]
[material.marble]
diffuse = [0.8, 0.78, 0.75]
specular = [0.3, 0.3, 0.3]
exponent = 20
reflect = 0.0
transmit = 0
ior = 1.5
[[model]]
file = "bust.obj"
material = "marble"
normals = "flat"
translate = [1, 2, 3]
rotate = [0.0, 30.0, 0.0]
scale = [1, -2, 1]
[[model]]
file = "bust.obj"
scale = 0.5
[[sphere]]
center = [0.0, 1.0, 0.0]
radius = 1.0
material = "marble"
[[plane]]
point = [0.0, 0.0, 0.0]
normal = [0.0, 3.0, 4.0]
[[triangle]]
vertices = [[0,0,0], [1,0,0], [0,1,0]]
material = "marble"
"#;

#[test]
fn models_may_be_turned_upright_and_have_a_crease_angle() {
    let text = "[[model]]\nfile = \"a.obj\"\nup = \"z\"\nscale = [1, 2, 3]\nrotate = [10, 20, 30]\n\
                [[model]]\nfile = \"a.obj\"\nup = \"y\"\ncrease_angle = 25\n\
                [[model]]\nfile = \"a.obj\"\nnormals = \"flat\"\ncrease_angle = 25\n";
    let scene = read(text).unwrap();
    let [z, y, flat] = &scene.models[..] else { panic!("three models") };
    // The file is turned before all else: about x, so that its z is what the scene calls y.
    assert_eq!((z.rotate, z.scale), (DVec3::new(-80.0, 20.0, 30.0), DVec3::new(1.0, 3.0, 2.0)));
    assert_eq!((z.crease_angle, y.crease_angle), (None, Some((25.0, text.find("25").unwrap()))));
    assert_eq!((y.rotate, y.scale), (DVec3::ZERO, DVec3::ONE));
    assert_eq!(flat.normals, NormalMode::Flat);
    assert_eq!(scene.warnings.len(), 1);
    assert!(
        scene.warnings[0].message.contains("`crease_angle` in [[model]] has no effect"),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn a_whole_scene_is_read() {
    let scene = read(WHOLE).unwrap();
    assert_eq!(scene.warnings, []);
    assert_eq!((scene.render.width, scene.render.height, scene.render.samples), (640, 480, 9));
    let camera = scene.camera.unwrap();
    assert_eq!(camera.aim, Aim::Point(DVec3::Y));
    assert_eq!((camera.fov, camera.zoom), (35.0, 2.0));
    assert_eq!(scene.background, Background::Gradient { bottom: Vec3::splat(0.1), top: Vec3::ONE });
    let spot = &scene.lights[0];
    assert_eq!(spot.color, Vec3::new(4.0, 2.0, 1.0));
    assert!(!spot.shadows);
    assert_eq!(spot.attenuation, Attenuation::Polynomial { constant: 1.0, linear: 0.1, quadratic: 0.01 });
    let (position, direction) = (DVec3::new(3.0, 6.0, 4.0), DVec3::NEG_Y);
    assert_eq!(spot.kind, LightKind::Spot { position, direction, beam_angle: 60.0, penumbra: 10.0 });
    assert_eq!(scene.lights[1].kind, LightKind::Directional { direction });
    assert_eq!(scene.models.len(), 2);
    assert_eq!(scene.models[0].material, Some(0));
    assert_eq!(scene.models[0].normals, NormalMode::Flat);
    assert_eq!(scene.models[0].scale, DVec3::new(1.0, -2.0, 1.0));
    assert_eq!(scene.models[1].material, None);
    assert_eq!(scene.models[1].scale, DVec3::splat(0.5));
    assert_eq!(scene.planes[0].normal, DVec3::new(0.0, 0.6, 0.8));
    // The plane names no material: the neutral one follows those of the file.
    assert_eq!(scene.planes[0].material, 1);
    assert_eq!(scene.materials[1], Material::NEUTRAL);
    assert_eq!(scene.triangles[0].vertices[1], DVec3::X);
}

#[test]
fn what_is_absent_has_its_default() {
    let scene =
        read("[[light]]\nposition = [1, 2, 3]\n[camera]\nposition = [0,0,0]\ndirection = [0,0,-2]").unwrap();
    assert_eq!(scene.render, RenderSettings::default());
    assert_eq!(scene.ambient, Vec3::ZERO);
    assert_eq!(scene.background, Background::Color(Vec3::ZERO));
    let camera = scene.camera.unwrap();
    assert_eq!((camera.aim, camera.up), (Aim::Direction(DVec3::NEG_Z), DVec3::Y));
    assert_eq!((camera.fov, camera.zoom), (40.0, 1.0));
    let light = &scene.lights[0];
    assert_eq!(light.kind, LightKind::Point { position: DVec3::new(1.0, 2.0, 3.0) });
    assert_eq!((light.color, light.attenuation, light.shadows), (Vec3::ONE, Attenuation::None, true));
    assert!(read("").unwrap().camera.is_none());
}

/// Reads a faulty text: "line:column: message".
fn fault(text: &str) -> String {
    let fault = read(text).expect_err(text);
    let (line, column) = place(text, fault.at);
    format!("{line}:{column}: {}", fault.message)
}

/// Asserts the place of the fault and that its message has all the words.
fn assert_faults(cases: &[(&str, &str, &[&str])]) {
    for (text, place, words) in cases {
        let message = fault(text);
        assert!(message.starts_with(&format!("{place}: ")), "{text:?} at {place}: {message}");
        for word in *words {
            assert!(message.contains(word), "{text:?} lacks {word:?}: {message}");
        }
    }
}

#[test]
fn unknown_keys_are_refused_with_the_nearest_known_one() {
    assert_faults(&[
        (
            "[[light]]\nposition = [0,0,0]\n  colour = [1,1,1]",
            "3:3",
            &["unknown key `colour` in [[light]]; did you mean `color`?"],
        ),
        ("[camra]\n", "1:2", &["unknown key `camra` in the scene file; did you mean `camera`?"]),
        ("[camera]\nlookat = [1,1,1]", "2:1", &["did you mean `look_at`?"]),
        ("[render]\nwidht = 3\nsample = 4", "2:1", &["`widht`", "did you mean `width`?"]),
        ("[render]\nquality = 3", "2:1", &["known here: `width`, `height`, `samples`"]),
        ("[material.a]\ndifuse = [0,0,0]", "2:1", &["in [material.a]", "`diffuse`"]),
        ("[[model]]\nfil = \"x\"", "2:1", &["in [[model]]; did you mean `file`?"]),
        ("[[sphere]]\ncentre = [0,0,0]", "2:1", &["in [[sphere]]; did you mean `center`?"]),
        ("[[plane]]\nnormals = [0,1,0]", "2:1", &["did you mean `normal`?"]),
        ("[[triangle]]\nvertexes = []", "2:1", &["in [[triangle]]; did you mean `vertices`?"]),
        ("[background]\ngradient = { botom = [0,0,0], top = [0,0,0] }", "2:14", &["did you mean `bottom`?"]),
        (
            "[[light]]\nposition=[0,0,0]\nattenuation = { quadric = 1 }",
            "3:17",
            &["did you mean `quadratic`?"],
        ),
        ("[render]\nambient = [0,0,0]", "2:1", &["`ambient` does not belong into [render]", "top"]),
    ]);
}

#[test]
fn values_of_the_wrong_type_are_refused() {
    assert_faults(&[
        (
            "ambient = 0.5",
            "1:11",
            &["`ambient` in the scene file must be an array of three numbers, but is 0.5"],
        ),
        ("ambient = [1, 2]", "1:11", &["three numbers, but is [1, 2]"]),
        ("ambient = [0, \"a\", 0]", "1:15", &["finite numbers", "but is \"a\""]),
        ("render = 3", "1:10", &["[render] must be a table, but is integer"]),
        ("[render]\nwidth = 10.5", "2:9", &["whole number", "1 to 16384", "10.5"]),
        ("[camera]\nposition = [0,0,0]\nlook_at=[1,1,1]\nfov = \"wide\"", "4:7", &["`fov`", "\"wide\""]),
        ("[camera]\nkind = 3", "2:8", &["\"pinhole\"", "but is 3"]),
        ("light = 3", "1:9", &["write `[[light]]`"]),
        ("[light]\nposition = [0,0,0]", "1:1", &["write `[[light]]`"]),
        ("light = [3]", "1:10", &["[[light]] must be a table"]),
        ("material = 4", "1:12", &["[material.NAME]"]),
        ("[material]\nred = [1,0,0]", "2:7", &["[material.red] must be a table"]),
        ("[[light]]\nposition=[0,0,0]\nshadows = 1", "3:11", &["`shadows`", "true or false, but is 1"]),
        ("[[model]]\nfile = [1]", "2:8", &["text in quotes"]),
        ("[[triangle]]\nvertices = [[0,0,0], [1,0,0]]", "2:12", &["three points"]),
        ("[[triangle]]\nvertices = [[0,0,0], [1,0], [0,1,0]]", "2:22", &["three numbers, but is [1, 0]"]),
        ("[[triangle]]\nvertices = [[0,0,0], 1, [0,1,0]]", "2:22", &["three points", "but is 1"]),
    ]);
}

#[test]
fn values_out_of_range_are_refused() {
    let camera = "[camera]\nposition = [0,0,0]\nlook_at = [0,0,-1]\n";
    let light = "[[light]]\nposition = [0,0,0]\n";
    let spot = "[[light]]\nkind = \"spot\"\nposition = [0,0,0]\ndirection = [0,0,-1]\n";
    let with = |head: &str, line: &str| format!("{head}{line}");
    let cases: &[(String, &str, &[&str])] = &[
        (with("", "ambient = [-0.1, 0, 0]"), "1:11", &["`ambient`", "[-0.1, 0, 0]"]),
        (with("", "ambient = [nan, 0, 0]"), "1:12", &["finite", "nan"]),
        (with("", "ambient = [0, inf, 0]"), "1:15", &["finite", "inf"]),
        (with("[render]\n", "width = 0"), "2:9", &["1 to 16384", "but is 0"]),
        (with("[render]\n", "height = 16385"), "2:10", &["1 to 16384", "16385"]),
        (with("[render]\n", "width = -5"), "2:9", &["1 to 16384", "-5"]),
        (with("[render]\n", "width = 99999999999999999999999"), "2:9", &["1 to 16384"]),
        (with("[render]\n", "samples = 8"), "2:11", &["square", "but is 8"]),
        (with("[render]\n", "samples = 289"), "2:11", &["square from 1 to 256", "289"]),
        (with("[render]\n", "min_contribution = 2"), "2:20", &["from 0 to 1"]),
        (with("[render]\n", "max_depth = 1000"), "2:13", &["from 0 to 64"]),
        (with(camera, "fov = 180"), "4:7", &["above 0 and below 180 degrees"]),
        (with(camera, "fov = 0"), "4:7", &["above 0"]),
        (with(camera, "fov = nan"), "4:7", &["above 0", "nan"]),
        (with(camera, "fov = 1e999"), "4:7", &["1e999"]),
        (with(camera, "zoom = 0"), "4:8", &["`zoom`", "above 0"]),
        (with(camera, "up = [0, 0, 2]"), "3:11", &["`up` is not parallel"]),
        (with(camera, "up = [0, 0, 0]"), "4:6", &["`up`", "not zero"]),
        (with("[background]\n", "color = [2, 0, 0]"), "2:9", &["0 to 1"]),
        (with(light, "color = [1, -1, 1]"), "3:9", &["`color`"]),
        (with(light, "intensity = -1"), "3:13", &["`intensity`", "from 0"]),
        (with(light, "color = [1e30, 0, 0]\nintensity = 10"), "4:13", &["times `color`"]),
        (with(light, "radius = -1"), "3:10", &["`radius`", "from 0"]),
        (with(light, "attenuation = { linear = -1 }"), "3:26", &["`linear`", "from 0"]),
        (with(light, "attenuation = {}"), "3:15", &["a term above 0"]),
        (with(spot, "beam_angle = 361"), "5:14", &["at most 360"]),
        (with(spot, "beam_angle = 30\npenumbra = 16"), "6:12", &["half the `beam_angle`"]),
        (with("", "[[light]]\nkind = \"directional\"\ndirection = [0,0,0]"), "3:13", &["not zero"]),
        (with("", "[material.a]\ndiffuse = [1.5, 0, 0]"), "2:11", &["0 to 1"]),
        (with("", "[material.a]\nexponent = 1e7"), "2:12", &["from 0 to 1e6"]),
        (with("", "[material.a]\nreflect = 2"), "2:11", &["from 0 to 1"]),
        (with("", "[[model]]\nfile = \"\""), "2:8", &["name of a model file"]),
        (with("", "[[model]]\nfile = \"a.obj\"\nscale = 0"), "3:9", &["none of them 0, but is 0"]),
        (with("", "[[model]]\nfile = \"a.obj\"\ncrease_angle = 181"), "3:16", &["from 0 to 180"]),
        (with("", "[[model]]\nfile = \"a.obj\"\nscale = [1, 0, 1]"), "3:9", &["none of them 0"]),
        (with("", "[[model]]\nfile = \"a.obj\"\ntranslate = [1e31, 0, 0]"), "3:14", &["up to 1e30"]),
        (with("", "[[sphere]]\ncenter = [0,0,0]\nradius = 0"), "3:10", &["above 0"]),
        (with("", "[[plane]]\npoint = [0,0,0]\nnormal = [0,0,0]"), "3:10", &["not zero"]),
    ];
    for (text, place, words) in cases {
        assert_faults(&[(text, place, words)]);
    }
}

#[test]
fn unknown_words_and_materials_are_refused_with_the_nearest() {
    assert_faults(&[
        ("[[light]]\nkind = \"pont\"", "2:8", &["unknown word `pont`", "did you mean `point`?"]),
        ("[[light]]\nkind = \"area\"", "2:8", &["known here: `point`, `spot`, `directional`"]),
        ("[camera]\nkind = \"pinhol\"", "2:8", &["did you mean `pinhole`?"]),
        ("[[light]]\nposition=[0,0,0]\nattenuation = \"inverse\"", "3:15", &["`inverse_square`"]),
        ("[[model]]\nfile = \"a.obj\"\nnormals = \"smoth\"", "3:11", &["did you mean `smooth`?"]),
        ("[[model]]\nfile = \"a.obj\"\nup = \"x\"", "3:6", &["unknown word `x`"]),
        (
            "[material.glass]\n[[model]]\nfile = \"a.obj\"\nmaterial = \"glas\"",
            "4:12",
            &["unknown material `glas` in [[model]]; did you mean `glass`?"],
        ),
        (
            "[material.glass]\n[[sphere]]\ncenter=[0,0,0]\nradius=1\nmaterial = \"wood\"",
            "5:12",
            &["unknown material `wood` in [[sphere]]", "defines `glass`", "[material.wood]"],
        ),
        ("[[plane]]\npoint=[0,0,0]\nnormal=[0,1,0]\nmaterial = \"x\"", "4:12", &["defines none"]),
    ]);
}

#[test]
fn features_that_are_not_built_yet_are_refused_by_name() {
    let yet = "not supported yet";
    assert_faults(&[
        ("[camera]\nkind = \"orthographic\"", "2:8", &["camera", yet, "pinhole"]),
        ("[camera]\nkind = \"fisheye\"", "2:8", &["camera", yet]),
        ("[background]\ncubemap = [\"a.png\"]", "2:11", &["`cubemap`", yet]),
        ("[background]\npanorama = \"sky.hdr\"", "2:12", &["`panorama`", yet]),
        ("[[light]]\nposition=[0,0,0]\nradius = 0.5", "3:10", &["`radius`", yet]),
        ("[material.a]\nreflect = 0.1", "2:11", &["`reflect`", yet]),
        ("[material.a]\ntransmit = 1", "2:12", &["`transmit`", yet]),
    ]);
}

const WOODEN: &str = "[material.wood]\ndiffuse = { texture = \"maps/wood.png\" }\n";
const CORNERS: &str = "vertices = [[0,0,0],[1,0,0],[0,1,0]]\n";

#[test]
fn textures_and_texture_coordinates_are_read() {
    let text = format!(
        "{WOODEN}[material.pixels]\ndiffuse = {{ texture = \"a.png\", filter = \"nearest\" }}\n\
         [material.red]\ndiffuse = [1, 0, 0]\n\
         [[triangle]]\n{CORNERS}uvs = [[-7.25, 3], [1, 4.5], [-7, 5]]\nmaterial = \"wood\"\n\
         [[triangle]]\n{CORNERS}uvs = [[0, 0], [1, 0], [0, 1]]\nmaterial = \"red\"\n\
         [[model]]\nfile = \"a.obj\"\nmaterial = \"wood\"\n"
    );
    let scene = read(&text).unwrap();
    let wood = scene.triangles[0].material;
    let texture = scene.textures[&wood].diffuse.as_ref().unwrap();
    assert_eq!((texture.file.to_str(), texture.filter), (Some("maps/wood.png"), Filter::Bilinear));
    assert_eq!(place(&text, texture.at), (2, 23));
    assert_eq!(
        scene
            .textures
            .values()
            .filter_map(|texts| texts.diffuse.as_ref())
            .filter(|text| text.filter == Filter::Nearest)
            .count(),
        1
    );
    assert_eq!(scene.textures.len(), 2);
    assert_eq!(scene.materials[wood as usize].diffuse, Vec3::ONE);
    let uvs = [Vec2::new(0.75, 0.0), Vec2::new(9.0, 1.5), Vec2::new(1.0, 2.0)];
    assert_eq!(scene.triangles[0].uvs, Some(uvs));
    // Nothing asks for them there.
    assert_eq!(scene.triangles[1].uvs, None);
    assert_eq!(place(&text, scene.models[0].material_at), (17, 12));
}

#[test]
fn emission_and_the_places_of_textures_are_read() {
    let text = format!(
        "[material.lamp]\nemission = [1, 0.5, 0]\nemission_strength = 4\n\
         [material.screen]\nemission = {{ texture = \"a.png\" }}\nemission_strength = 2\n\
         [material.tiles]\ndiffuse = {{ texture = \"b.png\", wrap = \"mirror\", scale = [3, -0.5], offset = [0.5, 1] }}\n\
         [[sphere]]\ncenter = [0,0,0]\nradius = 1\nmaterial = \"lamp\"\n\
         [[triangle]]\n{CORNERS}uvs = [[-7.25, 3], [1, 4.5], [-7, 5]]\nmaterial = \"tiles\"\n\
         [[triangle]]\n{CORNERS}uvs = [[-7.25, 3], [1, 4.5], [-7, 5]]\nmaterial = \"screen\"\n"
    );
    let scene = read(&text).unwrap();
    let material = |index: u32| scene.materials[index as usize];
    assert_eq!(material(scene.spheres[0].material).emission, Vec3::new(4.0, 2.0, 0.0));
    let [tiles, screen] = [0, 1].map(|triangle: usize| scene.triangles[triangle].material);
    assert_eq!(material(screen).emission, Vec3::splat(2.0));
    assert!(scene.textures[&screen].diffuse.is_none() && scene.textures[&screen].emission.is_some());
    let tiling = scene.textures[&tiles].diffuse.as_ref().unwrap().tiling;
    let expected = Tiling { wrap: Wrap::Mirror, scale: Vec2::new(3.0, -0.5), offset: Vec2::new(0.5, 1.0) };
    assert_eq!(tiling, expected);
    // A picture that is mirrored tells whole repeats apart.
    assert_eq!(scene.triangles[0].uvs.unwrap()[0], Vec2::new(-7.25, 3.0));
    assert_eq!(scene.triangles[1].uvs.unwrap()[0], Vec2::new(0.75, 0.0));
}

#[test]
fn faults_of_textures_name_their_place() {
    let plain = "there are no texture coordinates";
    let with = |rest: &str| format!("{WOODEN}{rest}");
    let uvs = |uvs: &str| format!("[[triangle]]\n{CORNERS}uvs = {uvs}\n");
    for (text, place, words) in [
        (
            "[material.a]\ndiffuse = { filter = \"nearest\" }".to_owned(),
            "2:11",
            &["`texture` is missing"][..],
        ),
        ("[material.a]\ndiffuse = { texture = 3 }".to_owned(), "2:23", &["`texture`", "a text in quotes"]),
        ("[material.a]\ndiffuse = { texture = \"\" }".to_owned(), "2:23", &["the name of a picture"]),
        (
            "[material.a]\ndiffuse = { texture = \"a.png\", filter = \"linear\" }".to_owned(),
            "2:41",
            &["unknown word `linear`", "`filter` in `diffuse` in [material.a]", "bilinear"],
        ),
        (
            "[material.a]\ndiffuse = { texture = \"a.png\", filters = 2 }".to_owned(),
            "2:32",
            &["unknown key `filters`", "`filter`"],
        ),
        (
            "[material.a]\ndiffuse = { texture = \"a.png\", scale = 2 }".to_owned(),
            "2:40",
            &["`scale` in `diffuse` in [material.a]", "an array of two finite numbers up to 1000000", "is 2"],
        ),
        (
            "[material.a]\nemission = { texture = \"a.png\", offset = [0, 1e7] }".to_owned(),
            "2:42",
            &["`offset` in `emission` in [material.a]", "up to 1000000"],
        ),
        (
            "[material.a]\ndiffuse = { texture = \"a.png\", wrap = \"once\" }".to_owned(),
            "2:39",
            &["unknown word `once`", "`repeat`, `clamp`, `mirror`"],
        ),
        (
            "[material.a]\nemission = [1e29, 0, 0]\nemission_strength = 100".to_owned(),
            "3:21",
            &["`emission_strength` in [material.a]", "up to 1e30"],
        ),
        (
            with("[[sphere]]\ncenter=[0,0,0]\nradius=1\nmaterial=\"wood\""),
            "6:10",
            &["`material` in [[sphere]] has a texture", plain, "with a colour"],
        ),
        (
            with("[[plane]]\npoint=[0,0,0]\nnormal=[0,1,0]\nmaterial=\"wood\""),
            "6:10",
            &["[[plane]]", plain, "triangles"],
        ),
        (
            with(&format!("[[triangle]]\n{CORNERS}material=\"wood\"")),
            "5:10",
            &["[[triangle]]", plain, "`uvs`"],
        ),
        (uvs("[[0,0],[1,0]]"), "3:7", &["three pairs"]),
        (uvs("[[0,0],[1,0],[0,1,2]]"), "3:7", &["three pairs"]),
        (uvs("[[0,0],[1,0],[0,nan]]"), "3:7", &["finite numbers up to 1e6"]),
        (uvs("[[0,0],[1,0],[0,2e6]]"), "3:7", &["finite numbers up to 1e6"]),
        (uvs("7"), "3:7", &["three pairs", "but is 7"]),
    ] {
        assert_faults(&[(&text, place, words)]);
    }
}

#[test]
fn missing_and_contradicting_keys_are_refused() {
    assert_faults(&[
        ("\n[camera]\nlook_at = [0,0,0]", "2:1", &["`position` is missing in [camera]"]),
        ("[camera]\nposition = [0,0,0]", "1:1", &["`look_at` is missing", "`rotation`"]),
        (
            "[camera]\nposition = [0,0,0]\nrotation = [0,0,0]\ndirection = [0,0,1]",
            "4:13",
            &["`direction` contradicts `rotation` in [camera]"],
        ),
        ("[camera]\nposition = [1,2,3]\nlook_at = [1,2,3]", "3:11", &["somewhere else"]),
        ("[camera]\nposition = [1,2,3]\ndirection = [0,0,0]", "3:13", &["not zero"]),
        ("[camera]\nposition = [0,0,0]\nrotation = [90,0,0]\nup = [0,0,1]", "3:12", &["leave `up` out"]),
        ("[background]\n", "1:1", &["`color` is missing"]),
        ("[background]\ncolor = [0,0,0]\ngradient = {}", "3:12", &["contradicts"]),
        ("[background]\ngradient = { top = [0,0,0] }", "2:12", &["`bottom` is missing"]),
        ("[[light]]\nkind = \"spot\"\nposition=[0,0,0]", "1:1", &["`direction` is missing", "look_at"]),
        ("[[light]]\nkind = \"spot\"\nposition=[1,0,0]\nlook_at=[1,0,0]", "4:9", &["another point"]),
        ("[[light]]\n", "1:1", &["`position` is missing in [[light]]"]),
        ("[[light]]\nkind = \"directional\"", "1:1", &["`direction` is missing"]),
        ("[[model]]\n", "1:1", &["`file` is missing"]),
        ("[[sphere]]\nradius = 1", "1:1", &["`center` is missing"]),
        ("[[plane]]\npoint = [0,0,0]", "1:1", &["`normal` is missing"]),
        ("[[triangle]]\n", "1:1", &["`vertices` is missing"]),
    ]);
}

#[test]
fn text_that_is_no_toml_is_refused_with_its_place() {
    assert_faults(&[
        ("a = 1\nb = = 2", "2:5", &["not valid TOML"]),
        ("[render]\nwidth = 1\nwidth = 2", "3:1", &["duplicate key"]),
        ("[[light]]\nposition = [1, 2", "2:17", &["not valid TOML"]),
    ]);
    let nested = format!("a = {}", "[".repeat(100_000));
    assert!(fault(&nested).contains("not valid TOML"));
}

#[test]
fn the_fault_that_stands_first_is_told() {
    let message = fault("[[sphere]]\nradius = 1\n[render]\nwidth = 0\n[material.a]\nx = 1");
    assert!(message.starts_with("1:1: `center`"), "{message}");
    let message = fault("[material.a]\nx = 1\n[[sphere]]\nradius = 1\n[render]\nwidth = 0");
    assert!(message.starts_with("2:1: unknown key `x`"), "{message}");
}

#[test]
fn keys_without_effect_are_accepted_with_a_warning() {
    let text = "[camera]\nposition=[0,0,0]\nlook_at=[0,0,1]\nview_height = 2.0\n\
                [[light]]\nposition=[0,0,0]\nbeam_angle = 40.0\ndirection=[0,-1,0]\n\
                [[light]]\nkind=\"directional\"\ndirection=[0,-1,0]\nattenuation = \"inverse_square\"\n\
                [[triangle]]\nvertices=[[1,1,1],[1,1,1],[2,2,2]]\n";
    let scene = read(text).unwrap();
    let warnings: Vec<String> =
        scene.warnings.iter().map(|w| format!("{}: {}", place(text, w.at).0, w.message)).collect();
    assert_eq!(warnings.len(), 5, "{warnings:?}");
    for (line, word) in
        [(4, "view_height"), (7, "beam_angle"), (8, "direction"), (12, "attenuation"), (14, "area")]
    {
        let found = warnings.iter().any(|w| w.starts_with(&format!("{line}: ")) && w.contains(word));
        assert!(found, "{line} {word}: {warnings:?}");
    }
    assert!(scene.triangles.is_empty());
}

#[test]
fn directions_of_every_length_are_brought_to_one() {
    for factor in [1.0, 1e-300, 1e29] {
        let text = format!("[[plane]]\npoint=[0,0,0]\nnormal=[0, {:e}, {:e}]", -3.0 * factor, 4.0 * factor);
        let normal = read(&text).unwrap().planes[0].normal;
        assert!((normal - DVec3::new(0.0, -0.6, 0.8)).length() < 1e-15, "{factor}: {normal}");
    }
}

#[test]
fn rotations_turn_the_camera_and_its_up() {
    let camera = |rotation: &str| {
        let text = format!("[camera]\nposition = [0,0,0]\nrotation = {rotation}");
        let camera = read(&text).unwrap().camera.unwrap();
        let Aim::Direction(direction) = camera.aim else { panic!("a rotation gives a direction") };
        (direction, camera.up)
    };
    assert_eq!(camera("[0, 0, 0]"), (DVec3::NEG_Z, DVec3::Y));
    assert_eq!(camera("[90, 0, 0]"), (DVec3::Y, DVec3::Z));
    assert_eq!(camera("[0, 90, 0]"), (DVec3::NEG_X, DVec3::Y));
    assert_eq!(camera("[0, 0, 90]"), (DVec3::NEG_Z, DVec3::NEG_X));
    // Rolled and pitched first, then yawed: down to the left of the start, the head lies towards +Z.
    assert_eq!(camera("[-90, 90, 90]"), (DVec3::NEG_Y, DVec3::Z));
}

/// Pieces that reach deep into the reader when they meet by chance.
fn piece() -> impl Strategy<Value = String> {
    prop_oneof![
        prop::sample::select(KEYS).prop_map(|key| format!("[{key}]\n")),
        prop::sample::select(KEYS).prop_map(|key| format!("[[{key}]]\n")),
        prop::sample::select(light::LIGHT_KEYS).prop_map(str::to_owned),
        prop::sample::select(view::CAMERA_KEYS).prop_map(str::to_owned),
        prop::sample::select(objects::MODEL_KEYS).prop_map(str::to_owned),
        prop::sample::select(vec![
            "=",
            "= [0, 1e300, -1]\n",
            "= 0x10\n",
            "= \"spot\"\n",
            "= {x = 1}\n",
            "= nan\n"
        ])
        .prop_map(str::to_owned),
        any::<f64>().prop_map(|number| format!("= {number}\n")),
        "[ -~]{0,6}",
        Just("\n".to_owned()),
    ]
}

proptest! {
    #[test]
    fn any_text_is_read_or_refused_inside_the_text(text in prop::collection::vec(piece(), 0..20)) {
        let text = text.concat();
        if let Err(fault) = read(&text) {
            prop_assert!(fault.at <= text.len());
            prop_assert!(!fault.message.is_empty());
        }
    }

    #[test]
    fn any_characters_are_read_or_refused(text in any::<String>()) {
        if let Err(fault) = read(&text) {
            prop_assert!(place(&text, fault.at) >= (1, 1));
        }
    }

    #[test]
    fn a_damaged_scene_is_read_or_refused(at in 0..WHOLE.len(), byte in 0u8..128) {
        let mut bytes = WHOLE.as_bytes().to_vec();
        bytes[at] = byte;
        let text = String::from_utf8(bytes).unwrap();
        if let Err(fault) = read(&text) {
            prop_assert!(fault.at <= text.len());
        }
    }
}

#[test]
fn lists_are_counted_before_they_are_built() {
    let lights = "[[light]]\n".repeat(MAX_LIGHTS + 1);
    let fault = read(&lights).unwrap_err();
    assert_eq!(fault.message, "4097 times [[light]], at most 4096 are allowed");
    assert_eq!(place(&lights, fault.at).0, MAX_LIGHTS + 1);
    let materials: String = (0..=MAX_MATERIALS).map(|index| format!("m{index}={{}}\n")).collect();
    let fault = read(&format!("[material]\n{materials}")).unwrap_err();
    assert!(fault.message.contains("262145 materials, at most 262144"), "{}", fault.message);
}

#[test]
fn a_text_of_too_many_values_is_refused_before_it_is_parsed() {
    let text = format!("a = [{}]", "{},".repeat(MAX_VALUES / 2));
    let fault = read(&text).unwrap_err();
    assert!(fault.message.contains("more than 16777216 values"), "{}", fault.message);
}
