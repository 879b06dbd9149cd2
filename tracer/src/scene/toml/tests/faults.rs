//! Every class of fault, with its place and the words that help.

use super::*;

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
fn invalid_toml_is_refused_with_its_place() {
    assert_faults(&[
        ("a = 1\nb = = 2", "2:5", &["not valid TOML"]),
        ("[render]\nwidth = 1\nwidth = 2", "3:1", &["duplicate key"]),
        ("[[light]]\nposition = [1, 2", "2:17", &["not valid TOML"]),
    ]);
    let nested = format!("a = {}", "[".repeat(100_000));
    assert!(fault(&nested).contains("not valid TOML"));
}

#[test]
fn the_first_fault_in_the_text_is_reported() {
    let message = fault("[[sphere]]\nradius = 1\n[render]\nwidth = 0\n[material.a]\nx = 1");
    assert!(message.starts_with("1:1: `center`"), "{message}");
    let message = fault("[material.a]\nx = 1\n[[sphere]]\nradius = 1\n[render]\nwidth = 0");
    assert!(message.starts_with("2:1: unknown key `x`"), "{message}");
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
    assert!(fault.message.contains("16777216"), "{}", fault.message);
}
