//! Reflection and transmission of materials, and lights with a radius.

use super::*;

fn material(keys: &str) -> Material {
    read(&format!("[material.a]\n{keys}\n")).unwrap().materials[0]
}

#[test]
fn shares_are_numbers_or_colours() {
    let glass = material(
        "reflect = 0.25\ntransmit = [0.5, 0.75, 1]\nior = 1.25\nabsorption = [0.5, 1, 0.125]\ncasts_shadow = false",
    );
    assert_eq!((glass.reflect, glass.transmit), (Vec3::splat(0.25), Vec3::new(0.5, 0.75, 1.0)));
    assert_eq!((glass.ior, glass.absorption), (1.25, Vec3::new(0.5, 1.0, 0.125)));
    assert!(!glass.casts_shadow && !glass.thin && !glass.fresnel);
    let grey = material("transmit = 1\nabsorption = 0.5");
    assert_eq!((grey.transmit, grey.absorption), (Vec3::ONE, Vec3::splat(0.5)));
}

#[test]
fn absent_keys_neither_reflect_nor_transmit() {
    let plain = material("");
    let neutral = Material::NEUTRAL;
    assert!(!plain.bounces() && plain.casts_shadow && !plain.thin && !plain.fresnel);
    assert_eq!((plain.ior, plain.absorption), (neutral.ior, Vec3::ONE));
    // Fresnel shares weight all of the light, unless the file gives less.
    assert_eq!(material("fresnel = true").reflect, Vec3::ONE);
    assert_eq!(material("fresnel = true\ntransmit = 1").reflect, Vec3::ONE);
    assert_eq!(material("fresnel = true\nreflect = 0.5").reflect, Vec3::splat(0.5));
    assert_eq!(material("fresnel = false").reflect, Vec3::ZERO);
    assert!(material("thin = true\ntransmit = 0.5").thin);
}

#[test]
fn shares_out_of_range_are_refused_with_their_place() {
    let head = "[material.a]\n";
    for (key, place, words) in [
        ("reflect = 1.5", "2:11", &["`reflect` in [material.a]", "from 0 to 1, or a colour", "1.5"][..]),
        ("reflect = [0, 2, 0]", "2:11", &["a colour with channels from 0 to 1"]),
        ("transmit = -0.1", "2:12", &["`transmit` in [material.a]", "from 0 to 1"]),
        ("transmit = nan", "2:12", &["nan"]),
        ("transmit = \"all\"", "2:12", &["\"all\""]),
        ("ior = 0.001", "2:7", &["`ior` in [material.a]", "from 0.01 to 100"]),
        ("ior = 101", "2:7", &["from 0.01 to 100"]),
        ("ior = 0", "2:7", &["from 0.01 to 100"]),
        ("absorption = [1, 0, 1]", "2:14", &["`absorption`", "above 0 in each channel"]),
        ("absorption = 2", "2:14", &["from 0 to 1"]),
        ("fresnel = 1", "2:11", &["true or false"]),
        ("thin = 0", "2:8", &["true or false"]),
        ("casts_shadow = \"no\"", "2:16", &["true or false"]),
        ("transmits = 1", "2:1", &["did you mean `transmit`?"]),
    ] {
        assert_faults(&[(&format!("{head}{key}"), place, words)]);
    }
}

#[test]
fn keys_that_change_nothing_are_warned_about() {
    let of = |keys: &str| warnings(&format!("[material.a]\n{keys}\n"));
    for (keys, expected) in [
        ("ior = 1.5", "2:7 `ior` in [material.a] has no effect without `transmit` or `fresnel`"),
        ("reflect = 1\nior = 1.5", "3:7 `ior` in [material.a] has no effect without `transmit` or `fresnel`"),
        (
            "transmit = 1\nthin = true\nior = 1.5",
            "4:7 `ior` in [material.a] has no effect on a thin material",
        ),
        ("absorption = 0.5", "2:14 `absorption` in [material.a] has no effect without `transmit`"),
        (
            "transmit = 1\nthin = true\nabsorption = 0.5",
            "4:14 `absorption` in [material.a] has no effect on a thin material, which has no inside",
        ),
        ("thin = true", "2:8 `thin` in [material.a] has no effect without `transmit`"),
        (
            "fresnel = true\nreflect = 0",
            "2:11 `fresnel` in [material.a] has no effect where `reflect` and `transmit` are 0",
        ),
    ] {
        assert_eq!(of(keys), [expected], "{keys}");
    }
    for keys in [
        "transmit = 1\nior = 1.5\nabsorption = 0.5",
        "fresnel = true\nior = 1.5",
        "thin = false\nfresnel = false",
        "reflect = 0\ntransmit = 0",
    ] {
        assert_eq!(of(keys), [""; 0], "{keys}");
    }
}

const POINT: &str = "[[light]]\nposition = [0, 0, 0]\n";

#[test]
fn lights_have_a_radius_and_a_number_of_points() {
    let light = |keys: &str| read(&format!("{POINT}{keys}\n")).unwrap().lights[0];
    assert_eq!((light("").radius, light("").shadow_samples), (0.0, None));
    let soft = light("radius = 0.25\nshadow_samples = 64");
    assert_eq!((soft.radius, soft.shadow_samples), (0.25, Some(64)));
    let directional = "[[light]]\nkind = \"directional\"\ndirection = [0, -1, 0]\nradius = 0.5\n";
    assert_eq!(read(directional).unwrap().lights[0].radius, 0.0);
    assert_eq!(warnings(directional), ["4:10 `radius` in [[light]] has no effect on a directional light"]);
    for (keys, expected) in [
        (
            "shadow_samples = 4",
            "3:18 `shadow_samples` in [[light]] has no effect without a `radius` and shadows",
        ),
        (
            "radius = 1\nshadows = false",
            "3:10 `radius` in [[light]] has no effect on a light without shadows",
        ),
    ] {
        assert_eq!(warnings(&format!("{POINT}{keys}\n")), [expected]);
    }
    assert_eq!(warnings(&format!("{POINT}radius = 0\n")), [""; 0]);
    for (keys, words) in [
        ("radius = nan", "from 0 to 1e30"),
        ("radius = 1e31", "from 0 to 1e30"),
        ("shadow_samples = 0", "from 1 to 1024"),
        ("shadow_samples = 1025", "from 1 to 1024"),
        ("shadow_samples = 2.5", "a whole number"),
    ] {
        let message = fault(&format!("{POINT}{keys}\n"));
        assert!(message.starts_with("3:") && message.contains(words), "{message}");
    }
}
