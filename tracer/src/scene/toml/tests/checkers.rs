//! Checker patterns, and where they may be laid.

use super::*;
use crate::material::{Checker, CheckerSpace};

const TWO: &str = "[material.black]\ndiffuse = [0, 0, 0]\n[material.red]\ndiffuse = [1, 0, 0]\n";

fn pattern(diffuse: &str) -> Checker {
    // The table is sorted by name: the pattern comes before the materials that it names.
    read(&format!("[material.a]\ndiffuse = {diffuse}\n{TWO}")).unwrap().materials[0].checker.unwrap()
}

#[test]
fn colours_are_given_or_those_of_materials() {
    let expected =
        Checker { colors: [Vec3::new(0.5, 0.25, 0.0), Vec3::X], size: 2.5, space: CheckerSpace::World };
    assert_eq!(pattern("{ checker = [[0.5, 0.25, 0], \"red\"], size = 2.5, space = \"world\" }"), expected);
    let usual = pattern("{ checker = [\"red\", \"black\"] }");
    assert_eq!(usual, Checker { colors: [Vec3::X, Vec3::ZERO], size: 1.0, space: CheckerSpace::Object });
    assert_eq!(pattern("{ checker = [\"red\", \"red\"], space = \"uv\" }").space, CheckerSpace::Uv);
    let scene = read(&format!("[material.a]\ndiffuse = {{ checker = [\"red\", \"red\"] }}\n{TWO}")).unwrap();
    assert_eq!((scene.materials.len(), scene.textures.len(), scene.materials[0].diffuse), (3, 0, Vec3::ONE));
}

#[test]
fn patterns_with_faults_are_refused_with_their_place() {
    let more = "[material.b]\ndiffuse = { checker = [[0,0,0], [1,1,1]] }\n\
                [material.c]\ndiffuse = { texture = \"c.png\" }\n";
    for (diffuse, place, words) in [
        ("{ checker = [[0,0,0]] }", "2:23", &["`checker` in `diffuse` in [material.a]", "two colours"][..]),
        ("{ checker = [[0,0,0], 3] }", "2:33", &["colours or names of materials", "but is 3"]),
        ("{ checker = [[0,0,0], [2,0,0]] }", "2:33", &["from 0 to 1"]),
        ("{ checker = \"red\" }", "2:23", &["two colours"]),
        ("{ checker = [\"red\", \"reed\"] }", "2:31", &["unknown material `reed`", "did you mean `red`?"]),
        ("{ checker = [\"b\", \"red\"] }", "2:24", &["the material `b`", "not one colour"]),
        ("{ checker = [\"red\", \"c\"] }", "2:31", &["the material `c`", "a texture or a pattern"]),
        ("{ checker = [\"a\", \"red\"] }", "2:24", &["the material `a`", "not one colour"]),
        ("{ checker = [\"red\", \"red\"], size = 0 }", "2:46", &["`size`", "above 0"]),
        ("{ checker = [\"red\", \"red\"], size = 1e-60 }", "2:46", &["`size`", "above 0"]),
        ("{ checker = [\"red\", \"red\"], space = \"uvs\" }", "2:47", &["did you mean `uv`?"]),
        ("{ checker = [\"red\", \"red\"], texture = \"a.png\" }", "2:39", &["unknown key `texture`"]),
    ] {
        assert_faults(&[(&format!("[material.a]\ndiffuse = {diffuse}\n{TWO}{more}"), place, words)]);
    }
}

#[test]
fn patterns_in_texture_coordinates_need_them() {
    let head = "[material.a]\ndiffuse = { checker = [[0,0,0], [1,1,1]], size = 0.5, space = \"uv\" }\n";
    let plain = "has a pattern, but there are no texture coordinates";
    assert_faults(&[
        (
            &format!("{head}[[triangle]]\nvertices = [[0,0,0],[1,0,0],[0,1,0]]\nmaterial = \"a\""),
            "5:12",
            &["`material` in [[triangle]]", plain, "`uvs`"],
        ),
        (
            &format!("{head}[[disk]]\ncenter = [0,0,0]\nnormal = [0,1,0]\nradius = 1\nmaterial = \"a\""),
            "7:12",
            &["`material` in [[disk]]", plain],
        ),
    ]);
    let uvs =
        "vertices = [[0,0,0],[1,0,0],[0,1,0]]\nuvs = [[-7.25, 3], [1, 4.5], [-7, 5]]\nmaterial = \"a\"\n";
    let scene = read(&format!("{head}[[triangle]]\n{uvs}")).unwrap();
    // Cells are counted from 0, so whole repeats count.
    assert_eq!(scene.triangles[0].uvs.unwrap()[0], Vec2::new(-7.25, 3.0));
    let object = "[material.a]\ndiffuse = { checker = [[0,0,0], [1,1,1]] }\n";
    let scene = read(&format!("{object}[[triangle]]\n{uvs}")).unwrap();
    assert_eq!(scene.triangles[0].uvs, None);
}
