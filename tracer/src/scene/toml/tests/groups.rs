//! Groups: objects in them against matrices by hand, and faults of names.

use glam::{DMat3, DMat4, DVec4};

use super::*;
use crate::rotation;

/// The map of a group by hand: scaled, rotated about x, y and z in turn, translated.
fn map(translate: DVec3, rotate: DVec3, scale: DVec3) -> DMat4 {
    let radians = |degrees: f64| degrees.to_radians();
    DMat4::from_translation(translate)
        * DMat4::from_rotation_z(radians(rotate.z))
        * DMat4::from_rotation_y(radians(rotate.y))
        * DMat4::from_rotation_x(radians(rotate.x))
        * DMat4::from_scale(scale)
}

fn assert_near(found: DVec3, expected: DVec3) {
    assert!((found - expected).length() <= 1e-12 * (1.0 + expected.length()), "{found}, not {expected}");
}

const OBJECTS: &str = "[[model]]\nname = \"bust\"\nfile = \"bust.obj\"\ntranslate = [1, 2, 3]\nrotate = [10, 20, 30]\nscale = [1, 2, -3]\n\
                       [[sphere]]\nname = \"ball\"\ncenter = [1, 0, 0]\nradius = 2\n\
                       [[disk]]\nname = \"top\"\ncenter = [0, 1, 0]\nnormal = [0, 0.6, 0.8]\nradius = 1.5\n\
                       [[triangle]]\nname = \"flag\"\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\n\
                       [[box]]\nname = \"leg\"\nmin = [0, 0, 0]\nmax = [1, 2, 3]\n";

#[test]
fn objects_are_placed_by_all_the_groups_around_them() {
    let text = format!(
        "{OBJECTS}[[group]]\nname = \"inner\"\nrotate = [30, -40, 50]\nscale = 2\nchildren = [\"bust\", \"ball\", \"top\"]\n\
         [[group]]\ntranslate = [5, 6, 7]\nrotate = [0, 90, 0]\nscale = [0.5, 0.5, 0.5]\n\
         children = [\"inner\", \"flag\", \"leg\"]\n"
    );
    let scene = read(&text).unwrap();
    assert_eq!(scene.warnings, []);
    let outer = map(DVec3::new(5.0, 6.0, 7.0), DVec3::Y * 90.0, DVec3::splat(0.5));
    let both = outer * map(DVec3::ZERO, DVec3::new(30.0, -40.0, 50.0), DVec3::splat(2.0));
    // A point of the model: by its own scale, rotation and translation, then by its groups.
    let model = &scene.models[0];
    let own = map(DVec3::new(1.0, 2.0, 3.0), DVec3::new(10.0, 20.0, 30.0), DVec3::new(1.0, 2.0, -3.0));
    let linear = model.group * rotation::of_model(model.rotate) * DMat3::from_diagonal(model.scale);
    for point in [DVec3::ZERO, DVec3::X, DVec3::new(0.5, -2.0, 4.0)] {
        assert_near(linear * point + model.translate, (both * own).transform_point3(point));
    }
    let sphere = &scene.spheres[0];
    assert_near(sphere.center, both.transform_point3(DVec3::X));
    assert!((sphere.radius - 2.0).abs() < 1e-12, "{}", sphere.radius);
    // Texture coordinates turn with the group.
    assert_near(rotation::of_model(sphere.uv_rotate) * DVec3::X, both.transform_vector3(DVec3::X));
    assert_near(rotation::of_model(sphere.uv_rotate) * DVec3::Y, both.transform_vector3(DVec3::Y));
    let disk = &scene.disks[0];
    assert_near(disk.center, both.transform_point3(DVec3::Y));
    assert_near(disk.normal, both.transform_vector3(DVec3::new(0.0, 0.6, 0.8)));
    assert!((disk.radius - 1.5).abs() < 1e-12);
    for (vertex, from) in scene.triangles[0].vertices.into_iter().zip([DVec3::ZERO, DVec3::X, DVec3::Y]) {
        assert_near(vertex, outer.transform_point3(from));
    }
    let corners = scene.triangles[1..].iter().flat_map(|triangle| triangle.vertices);
    let highest = corners.map(|corner| corner.y).fold(f64::NEG_INFINITY, f64::max);
    assert!((highest - 7.0).abs() < 1e-12, "{highest}");
}

#[test]
fn objects_outside_of_groups_keep_every_bit() {
    let (alone, grouped) = (
        read(OBJECTS).unwrap(),
        read(&format!("{OBJECTS}[[group]]\nchildren = [\"bust\", \"ball\"]\n")).unwrap(),
    );
    assert_eq!(alone.models[0].group, DMat3::IDENTITY);
    assert_eq!((&alone.models, &alone.spheres), (&grouped.models, &grouped.spheres));
    assert_eq!((&alone.disks, &alone.triangles), (&grouped.disks, &grouped.triangles));
}

#[test]
fn a_matrix_has_rows() {
    let text = format!(
        "{OBJECTS}[[group]]\nmatrix = [[0, 0, 2, 10], [2, 0, 0, 20], [0, 2, 0, 30]]\nchildren = [\"ball\", \"flag\", \"bust\"]\n"
    );
    let scene = read(&text).unwrap();
    let rows =
        [DVec4::new(0.0, 0.0, 2.0, 10.0), DVec4::new(2.0, 0.0, 0.0, 20.0), DVec4::new(0.0, 2.0, 0.0, 30.0)];
    let by_hand = |p: DVec3| DVec3::from_array(rows.map(|row| row.dot(p.extend(1.0))));
    assert_eq!(scene.spheres[0].center, by_hand(DVec3::X));
    assert_near(DVec3::splat(scene.spheres[0].radius), DVec3::splat(4.0));
    assert_eq!(scene.triangles[0].vertices, [DVec3::ZERO, DVec3::X, DVec3::Y].map(by_hand));
    assert_eq!(scene.models[0].translate, by_hand(DVec3::new(1.0, 2.0, 3.0)));
    assert_eq!(scene.models[0].group * DVec3::X, DVec3::Y * 2.0);
}

#[test]
fn fronts_remain_fronts_in_a_mirrored_group() {
    let text = "[material.a]\ndiffuse = { texture = \"a.png\" }\n\
                [[rectangle]]\nname = \"wall\"\naxis = \"z\"\nat = 1\nranges = [[0, 1], [0, 1]]\nmaterial = \"a\"\n\
                [[disk]]\nname = \"top\"\ncenter = [0, 0, 0]\nnormal = [0, 0, 1]\nradius = 1\n\
                [[group]]\nscale = [-2, 2, 3]\nchildren = [\"wall\", \"top\"]\n";
    let scene = read(text).unwrap();
    for triangle in &scene.triangles {
        let [a, b, c] = triangle.vertices;
        assert_eq!((b - a).cross(c - a).normalize(), DVec3::Z);
        for (vertex, uv) in triangle.vertices.into_iter().zip(triangle.uvs.unwrap()) {
            // x is mirrored and doubled, and the picture with it.
            assert_eq!(vertex, DVec3::new(f64::from(uv.x) * -2.0, f64::from(uv.y) * 2.0, 3.0));
        }
    }
    // The factors along the disk are equal, the one across it does not matter.
    assert_eq!((scene.disks[0].normal, scene.disks[0].radius), (DVec3::Z, 2.0));
    let ball = "[[sphere]]\nname = \"ball\"\ncenter = [1, 0, 0]\nradius = 1\nmaterial = \"a\"\n\
                [[group]]\nscale = -1\nchildren = [\"ball\"]\n";
    let plain = read(&format!("[material.a]\ndiffuse = [1, 0, 0]\n{ball}")).unwrap();
    assert_eq!((plain.spheres[0].center, plain.spheres[0].radius), (DVec3::NEG_X, 1.0));
    let message = fault(&format!("[material.a]\ndiffuse = {{ texture = \"a.png\" }}\n{ball}"));
    assert!(message.starts_with("10:13: its groups mirror this sphere"), "{message}");
}

#[test]
fn what_cannot_be_placed_is_refused_at_its_name_in_the_group() {
    for (group, place, words) in [
        ("scale = [1, 2, 1]\nchildren = [\"ball\"]", "3:13", "scale this sphere by different factors"),
        ("matrix = [[1,1,0,0],[0,1,0,0],[0,0,1,0]]\nchildren = [\"ball\"]", "3:13", "different factors"),
        ("scale = [1, 2, 1]\nchildren = [\"top\"]", "3:13", "an ellipse of this disk"),
        ("scale = 1e29\ntranslate = [1e30, 0, 0]\nchildren = [\"bust\"]", "4:13", "beyond 1e30"),
        ("scale = 1e30\nchildren = [\"ball\"]", "3:13", "beyond 1e30"),
        ("scale = 1e30\nchildren = [\"leg\"]", "3:13", "beyond 1e30"),
    ] {
        let text = format!("[[group]]\n{group}\n{OBJECTS}");
        assert_faults(&[(&text, place, &[words])]);
    }
}

#[test]
fn faults_of_names_are_refused_with_their_place() {
    let group = |children: &str| format!("[[group]]\nname = \"g\"\nchildren = {children}\n");
    let second =
        |children: &str| format!("{}[[group]]\nname = \"h\"\nchildren = {children}\n", group("[\"ball\"]"));
    for (text, place, words) in [
        (group("[\"bal\"]"), "3:13", &["unknown child `bal` of [[group]]", "did you mean `ball`?"][..]),
        (group("[\"chair\"]"), "3:13", &["unknown child `chair`", "the file names `ball`, `bust`"]),
        (group("[\"ball\", \"ball\"]"), "3:21", &["`ball` is twice in this group"]),
        (second("[\"top\", \"ball\"]"), "6:20", &["`ball` is in another group, too", "one group at most"]),
        (group("[\"g\"]"), "3:13", &["in a circle"]),
        (second("[\"h\"]"), "6:13", &["in a circle"]),
        (group("[\"h\"]") + "[[group]]\nname = \"h\"\nchildren = [\"g\"]\n", "3:13", &["in a circle"]),
        (group("[]") + "[[group]]\nname = \"g\"\nchildren = []\n", "5:8", &["the name `g` is given twice"]),
        (
            group("[]") + "[[sphere]]\nname = \"g\"\ncenter=[0,0,0]\nradius=1\n",
            "5:8",
            &["`g` is given twice"],
        ),
        (group("\"ball\""), "3:12", &["an array of names of objects and groups"]),
        (group("[3]"), "3:13", &["a text in quotes, but is 3"]),
        ("[[group]]\nname = \"g\"\n".to_owned(), "1:1", &["`children` is missing in [[group]]"]),
        ("[[group]]\nname = \"\"\nchildren = []\n".to_owned(), "2:8", &["a name that is not empty"]),
        ("[[group]]\nname = 3\nchildren = []\n".to_owned(), "2:8", &["a text in quotes"]),
        ("[[group]]\nscale = [1, 0, 1]\nchildren = []\n".to_owned(), "2:9", &["none of them 0"]),
        (
            "[[group]]\nmatrix = [[1,0,0,0],[0,1,0,0]]\nchildren = []\n".to_owned(),
            "2:10",
            &["three rows of four"],
        ),
        (
            "[[group]]\nmatrix = [[1,0,0,0],[0,1,0,0],[0,0,1]]\nchildren = []\n".to_owned(),
            "2:31",
            &["three rows of four"],
        ),
        (
            "[[group]]\nmatrix = [[1,0,0,0],[1,0,0,0],[0,0,1,0]]\nchildren = []\n".to_owned(),
            "2:10",
            &["can be inverted"],
        ),
        (
            "[[group]]\nscale = 2\nmatrix = [[1,0,0,0],[0,1,0,0],[0,0,1,0]]\nchildren = []\n".to_owned(),
            "3:10",
            &["`matrix` contradicts `scale` in [[group]]"],
        ),
    ] {
        assert_faults(&[(&format!("{text}{OBJECTS}"), place, words)]);
    }
    assert_eq!(warnings("[[group]]\nchildren = []\n"), ["1:1 a [[group]] without children has no effect"]);
}

#[test]
fn a_left_out_triangle_may_be_in_a_group() {
    let text = "[[triangle]]\nname = \"nothing\"\nvertices = [[1,1,1],[1,1,1],[2,2,2]]\n\
                [[triangle]]\nname = \"flag\"\nvertices = [[0,0,0],[1,0,0],[0,1,0]]\n\
                [[group]]\ntranslate = [0, 0, 5]\nchildren = [\"nothing\"]\n";
    let scene = read(text).unwrap();
    assert_eq!((scene.triangles.len(), scene.warnings.len()), (1, 1));
    assert_eq!(scene.triangles[0].vertices[0], DVec3::ZERO);
}

#[test]
fn a_long_chain_of_groups_is_placed() {
    const DEPTH: usize = 20_000;
    let mut text = "[[sphere]]\nname = \"0\"\ncenter = [0, 0, 0]\nradius = 1\n".to_owned();
    for depth in 1..=DEPTH {
        text += &format!(
            "[[group]]\nname = \"{depth}\"\ntranslate = [1, 0, 0]\nchildren = [\"{}\"]\n",
            depth - 1
        );
    }
    assert_eq!(read(&text).unwrap().spheres[0].center, DVec3::X * DEPTH as f64);
}

#[test]
fn another_fault_is_reported_before_the_children_that_it_hides() {
    let text =
        "[[group]]\nchildren = [\"ball\"]\n[[sphere]]\nname = \"ball\"\ncenter = [0, 0, 0]\nradius = 0\n";
    assert!(fault(text).starts_with("6:10: `radius` in [[sphere]]"), "{}", fault(text));
}
