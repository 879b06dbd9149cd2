//! Mirrors and glass of material libraries, in the combinations that programs write.

use super::*;

fn material(statements: &str) -> (Material, Vec<String>) {
    let (library, warnings) = parsed(&format!("newmtl a\nKd 0.8 0.8 0.8\nKs 0.5 0.5 0.5\n{statements}\n"));
    (library["a"].material, warnings)
}

/// A material whose statements cause no warning.
fn quiet(statements: &str) -> Material {
    let (material, warnings) = material(statements);
    assert_eq!(warnings, [""; 0], "{statements}");
    material
}

#[test]
fn defaults_of_programs_remain_opaque() {
    for statements in [
        // 3ds Max and many others.
        "Ns 10\nNi 1.5\nd 1\nTr 0\nTf 1 1 1\nillum 2",
        // Maya writes this for all materials.
        "illum 4\nTf 1.00 1.00 1.00\nNi 1.00",
        "illum 4\nTf 0 0 0\nNi 1.5\nd 1.0",
        // Blender, with and without a highlight.
        "Ns 250\nKe 0 0 0\nNi 1.45\nd 1.0\nillum 2",
        "Ni 1.45\nd 1.0\nillum 1",
        "Ns 250\nNi 1.45\nd 1.0\nillum 9",
        "Ns 250\nNi 1.45\nd 1.0\nillum 6",
        // Blender's extension for physically based materials: the weight of transmission.
        "Ns 250\nNi 1.45\nd 1.0\nillum 2\nTf 0 0 0",
        // Refraction that bends nothing.
        "illum 7\nNi 1\nTf 1 1 1\nNs 0",
        "illum 6\nTf 0 0 0\nNi 1.5",
        // Rounded.
        "d 0.999",
        "Tr 0.001\nillum 4",
        "",
    ] {
        let material = quiet(statements);
        assert!(!material.bounces() && !material.thin && !material.fresnel, "{statements}: {material:?}");
        assert_eq!(material.diffuse, Vec3::splat(0.8), "{statements}");
        assert_eq!(material.ior, Material::NEUTRAL.ior, "{statements}");
    }
}

#[test]
fn mirrors_reflect_by_their_specular_colour() {
    for model in [3, 8] {
        let mirror = quiet(&format!("illum {model}\nNs 250\nNi 1.45\nd 1"));
        assert_eq!((mirror.reflect, mirror.fresnel), (Vec3::splat(0.5), false));
        assert_eq!((mirror.transmit, mirror.specular), (Vec3::ZERO, Vec3::splat(0.5)));
    }
    for (statements, ior) in
        [("illum 5\nNs 100", 1.5), ("illum 5\nNs 100\nNi 1", 1.5), ("illum 7\nNs 100\nNi 2.5", 2.5)]
    {
        let coated = quiet(statements);
        assert_eq!(
            (coated.reflect, coated.fresnel, coated.ior),
            (Vec3::splat(0.5), true, ior),
            "{statements}"
        );
        assert_eq!(coated.diffuse, Vec3::splat(0.8));
    }
    // No highlight, no mirror.
    for statements in ["illum 3\nNs 0", "illum 3\nKs 0 0 0", "illum 5\nNs 0"] {
        assert!(!quiet(statements).bounces(), "{statements}");
    }
    // Rough metals of Blender.
    let (rough, warnings) = material("illum 3\nNs 40");
    assert!(!rough.bounces());
    assert_eq!(
        warnings,
        ["a.mtl:1: `illum 3` with `Ns` below 64: a rough surface shows no mirror image, and none is drawn"]
    );
}

#[test]
fn opacity_lets_light_through_straight_on() {
    for statements in [
        "d 0.25\nillum 2\nTf 1 1 1\nNi 1.45",
        "Tr 0.75",
        "d 0.25\nTr 0.75\nillum 1",
        "illum 0\nd 0.25",
        "d 0.25\nillum 9\nNi 1.45\nNs 250",
        "d 0.25\nillum 4\nNi 1",
        "d 0.25\nillum 6",
        "d 0.25\nillum 5",
    ] {
        let sheet = quiet(statements);
        assert_eq!(sheet.transmit, Vec3::splat(0.75), "{statements}");
        assert_eq!(sheet.diffuse, Vec3::splat(0.2), "{statements}");
        assert!(sheet.thin && !sheet.fresnel && sheet.ior == 1.0, "{statements}: {sheet:?}");
        assert_eq!(sheet.reflect, Vec3::ZERO, "{statements}");
    }
    // A mirror that is half transparent reflects half.
    let mirror = quiet("d 0.5\nillum 3\nNs 100");
    assert_eq!((mirror.reflect, mirror.transmit), (Vec3::splat(0.25), Vec3::splat(0.5)));
}

#[test]
fn glass_bends_light_and_takes_its_colour_from_tf() {
    for (statements, transmit, diffuse) in [
        ("illum 6\nNi 1.5\nd 0.25", Vec3::splat(0.75), 0.2),
        ("illum 7\nNi 1.5\nd 0.5\nTf 0.5 1 1", Vec3::new(0.25, 0.5, 0.5), 0.4),
        ("illum 7\nNi 1.5\nTf 1 1 1", Vec3::ONE, 0.0),
        ("illum 7\nNi 1.5\nd 1\nTf 0.5 0.25 0.25", Vec3::new(0.5, 0.25, 0.25), 0.4),
        // Without opacity, but with reflections: this is visible.
        ("illum 6\nNi 1.5\nd 0", Vec3::ONE, 0.0),
    ] {
        let glass = quiet(statements);
        assert_eq!(glass.transmit, transmit, "{statements}");
        assert_eq!(glass.diffuse, Vec3::splat(0.8) * (diffuse / 0.8), "{statements}");
        assert!(glass.fresnel && !glass.thin && glass.ior == 1.5, "{statements}: {glass:?}");
        assert_eq!(glass.reflect, Vec3::ONE, "{statements}");
    }
    let pane = quiet("illum 4\nd 0.5\nTf 1 0.5 0.5");
    assert_eq!((pane.transmit, pane.thin), (Vec3::new(0.5, 0.25, 0.25), true));
}

#[test]
fn statements_that_mean_nothing_are_reported() {
    for (statements, words) in [
        ("d 0", "a.mtl:4: nothing of this material would be visible: drawn opaque"),
        ("Tr 1", "a.mtl:4: nothing of this material would be visible: drawn opaque"),
        ("illum 9\nd 0.0", "a.mtl:5: nothing of this material would be visible"),
        ("d 1\nTr 1", "a.mtl:5: `Tr` contradicts `d`: `d` counts"),
        ("Tf 0.5 0.5 0.5\nillum 2", "a.mtl:4: `Tf` is left out: it colours glass"),
        ("Tf 0.5 0.5 0.5\nillum 4\nNi 1", "a.mtl:4: `Tf` is left out"),
        ("illum 10", "a.mtl:4: `illum 10`: read as `illum 2`"),
        ("illum -1", "a.mtl:4: `illum -1`: read as `illum 2`"),
        ("d -0.5\nillum 2", "a.mtl:4: `d -0.5`: taken to the nearest value from 0 to 1"),
        ("Ni 1000\nillum 2", "a.mtl:4: `Ni 1000`: taken to the nearest value from 0 to 100"),
    ] {
        let (material, warnings) = material(statements);
        assert!(!material.bounces(), "{statements}");
        assert!(warnings.iter().any(|warning| warning.starts_with(words)), "{statements}: {warnings:?}");
    }
    let (halo, warnings) = material("d -halo 0.5");
    assert_eq!(halo.transmit, Vec3::splat(0.5));
    assert!(warnings.len() == 1 && warnings[0].contains("`-halo` is left out"), "{warnings:?}");
    assert_eq!(quiet("map_d a.png\nd 0").transmit, Vec3::ZERO);
}

#[test]
fn every_glass_and_mirror_is_a_valid_material() {
    let values = |keyword: &str, values: &[&str]| {
        let stated = values.iter().map(|value| format!("{keyword} {value}\n"));
        std::iter::once(String::new()).chain(stated).collect::<Vec<_>>()
    };
    let models = values("illum", &["0", "1", "2", "3", "4", "5", "6", "7", "8", "9", "10"]);
    let opacities = values("d", &["0", "0.001", "0.5", "0.9999", "1", "2"]);
    let filters = values("Tf", &["0", "1", "0.2 0.4 2", "-1"]);
    let indices = values("Ni", &["-1", "0", "1e-9", "1", "1.5", "1e9"]);
    for (model, opacity) in models.iter().flat_map(|model| opacities.iter().map(move |d| (model, d))) {
        for (filter, ior) in filters.iter().flat_map(|filter| indices.iter().map(move |ni| (filter, ni))) {
            let (material, _) = material(&format!("{model}{opacity}{filter}{ior}"));
            let in_range = |color: Vec3| color.to_array().iter().all(|c| (0.0..=1.0).contains(c));
            assert!(in_range(material.reflect) && in_range(material.transmit), "{material:?}");
            assert!(in_range(material.diffuse) && (0.01..=100.0).contains(&material.ior), "{material:?}");
            // What is neither reflected nor transmitted is never more than what arrives.
            let sum = material.transmit + material.diffuse;
            assert!(sum.max_element() <= 1.0 + 1e-6, "{model}{opacity}{filter}{ior}: {material:?}");
        }
    }
}
