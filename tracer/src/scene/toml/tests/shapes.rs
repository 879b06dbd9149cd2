//! Disks, rectangles and boxes.

use std::collections::BTreeMap;

use super::*;
use crate::rotation;
use crate::scene::{Disk, Triangle};

fn normal(triangle: &Triangle) -> DVec3 {
    let [a, b, c] = triangle.vertices;
    (b - a).cross(c - a).normalize()
}

/// The texture coordinates at a point of a triangle.
fn uv_at(triangle: &Triangle, point: DVec3) -> Vec2 {
    let ([a, b, c], [ta, tb, tc]) = (triangle.vertices, triangle.uvs.unwrap());
    let whole = (b - a).cross(c - a);
    let share =
        |from: DVec3, to: DVec3| ((to - from).cross(point - from).dot(whole) / whole.length_squared()) as f32;
    ta * share(b, c) + tb * share(c, a) + tc * share(a, b)
}

#[test]
fn disks_and_bubbles_are_read() {
    let text = "[[disk]]\ncenter = [1, 2, 3]\nnormal = [0, -2, 0]\nradius = 0.5\n\
                [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\ninside_out = true\n\
                [[sphere]]\ncenter = [0, 0, 0]\nradius = 2\n";
    let scene = read(text).unwrap();
    let expected = Disk { center: DVec3::new(1.0, 2.0, 3.0), normal: DVec3::NEG_Y, radius: 0.5, material: 0 };
    assert_eq!(scene.disks, [expected]);
    assert_eq!(scene.materials, [Material::NEUTRAL]);
    assert!(scene.spheres[0].inside_out && !scene.spheres[1].inside_out);
    assert_eq!(scene.spheres[1].uv_rotate, DVec3::ZERO);
}

#[test]
fn a_rectangle_faces_the_positive_side_and_shows_its_picture_upright() {
    let head = "[material.a]\ndiffuse = { texture = \"a.png\" }\n";
    // For each axis: its direction, and those to the right and upwards as seen from the front.
    for (axis, front, right, up) in [
        ("x", DVec3::X, DVec3::NEG_Z, DVec3::Y),
        ("y", DVec3::Y, DVec3::X, DVec3::NEG_Z),
        ("z", DVec3::Z, DVec3::X, DVec3::Y),
    ] {
        let text = format!(
            "{head}[[rectangle]]\naxis = \"{axis}\"\nat = 5\nranges = [[1, 3], [10, 14]]\nmaterial = \"a\"\n"
        );
        let scene = read(&text).unwrap();
        let [one, two] = &scene.triangles[..] else { panic!("two triangles") };
        for triangle in [one, two] {
            assert_eq!(normal(triangle), front, "{axis}");
            for (vertex, uv) in triangle.vertices.into_iter().zip(triangle.uvs.unwrap()) {
                // The middle of the rectangle is at u = v = 1/2.
                let from_middle = vertex - middle(&scene.triangles);
                let (u, v) = (from_middle.dot(right).signum(), from_middle.dot(up).signum());
                assert_eq!(uv, Vec2::new((u as f32 + 1.0) / 2.0, (v as f32 + 1.0) / 2.0), "{axis} {vertex}");
            }
        }
        let area: f64 = scene.triangles.iter().map(area).sum();
        assert!((area - 8.0).abs() < 1e-12, "{axis}: {area}");
        // The first range is that of the first of the other axes.
        let (lower, upper) = bounds(&scene.triangles);
        let expected = match axis {
            "x" => (DVec3::new(5.0, 1.0, 10.0), DVec3::new(5.0, 3.0, 14.0)),
            "y" => (DVec3::new(1.0, 5.0, 10.0), DVec3::new(3.0, 5.0, 14.0)),
            _ => (DVec3::new(1.0, 10.0, 5.0), DVec3::new(3.0, 14.0, 5.0)),
        };
        assert_eq!((lower, upper), expected, "{axis}");
    }
    let plain = read("[[rectangle]]\naxis = \"x\"\nat = 0\nranges = [[0, 1], [0, 1]]\n").unwrap();
    assert!(plain.triangles.iter().all(|triangle| triangle.uvs.is_none()));
}

fn bounds(triangles: &[Triangle]) -> (DVec3, DVec3) {
    let points = || triangles.iter().flat_map(|triangle| triangle.vertices);
    (points().reduce(DVec3::min).unwrap(), points().reduce(DVec3::max).unwrap())
}

fn middle(triangles: &[Triangle]) -> DVec3 {
    let (lower, upper) = bounds(triangles);
    (lower + upper) / 2.0
}

fn area(triangle: &Triangle) -> f64 {
    let [a, b, c] = triangle.vertices;
    (b - a).cross(c - a).length() / 2.0
}

#[test]
fn a_box_is_closed_and_wound_outwards() {
    for rotate in ["[0, 0, 0]", "[0, 0, 90]", "[20, 30, 40]"] {
        let text = format!("[[box]]\nmin = [1, 2, 3]\nmax = [2, 4, 7]\nrotate = {rotate}\n");
        let triangles = read(&text).unwrap().triangles;
        assert_eq!(triangles.len(), 12);
        let center = DVec3::new(1.5, 3.0, 5.0);
        // Each edge is in two triangles, in opposite directions, with corners that are equal to the bit.
        let mut edges: BTreeMap<[[u64; 3]; 2], i32> = BTreeMap::new();
        let mut volume = 0.0;
        for triangle in &triangles {
            let [a, b, c] = triangle.vertices;
            assert!(normal(triangle).dot(a - center) > 0.0, "{rotate}: {triangle:?}");
            volume += (a - center).dot((b - center).cross(c - center)) / 6.0;
            for [from, to] in [[a, b], [b, c], [c, a]] {
                let bits = |point: DVec3| point.to_array().map(f64::to_bits);
                *edges.entry([bits(from), bits(to)]).or_default() += 1;
                *edges.entry([bits(to), bits(from)]).or_default() -= 1;
            }
        }
        assert!((volume - 8.0).abs() < 1e-12, "{rotate}: {volume}");
        assert_eq!(edges.len(), 36);
        assert!(edges.values().all(|count| *count == 0), "{rotate}");
    }
    let text = "[[box]]\nmin = [0.1, 0.2, 0.3]\nmax = [0.7, 0.9, 1.1]\n";
    let corners = bounds(&read(text).unwrap().triangles);
    assert_eq!(corners, (DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.7, 0.9, 1.1)));
}

#[test]
fn a_box_turns_about_its_centre() {
    let text = "[[box]]\nmin = [0, 0, 0]\nmax = [2, 4, 6]\nrotate = [0, 90, 0]\n";
    let (lower, upper) = bounds(&read(text).unwrap().triangles);
    let expected = (DVec3::new(-2.0, 0.0, 2.0), DVec3::new(4.0, 4.0, 4.0));
    assert!(
        (lower - expected.0).length() < 1e-12 && (upper - expected.1).length() < 1e-12,
        "{lower} {upper}"
    );
    assert_eq!(rotation::of_model(DVec3::Y * 90.0) * DVec3::Z, DVec3::X);
}

#[test]
fn each_side_of_a_box_shows_the_whole_picture_upright() {
    let text = "[material.a]\ndiffuse = { texture = \"a.png\" }\n\
                [[box]]\nmin = [-1, -1, -1]\nmax = [1, 1, 1]\nmaterial = \"a\"\n";
    let triangles = read(text).unwrap().triangles;
    for (front, up) in [
        (DVec3::X, DVec3::Y),
        (DVec3::NEG_X, DVec3::Y),
        (DVec3::Y, DVec3::NEG_Z),
        (DVec3::NEG_Y, DVec3::Z),
        (DVec3::Z, DVec3::Y),
        (DVec3::NEG_Z, DVec3::Y),
    ] {
        let side: Vec<&Triangle> =
            triangles.iter().filter(|triangle| normal(triangle).dot(front) > 0.5).collect();
        assert_eq!(side.len(), 2, "{front}");
        // To the right, as seen by a camera that looks at the side.
        let right = (-front).cross(up);
        for triangle in side {
            for (u, v) in [(0.25, 0.5), (0.5, 0.75), (0.0, 1.0)] {
                let point = front + right * (2.0 * u - 1.0) + up * (2.0 * v - 1.0);
                let found = uv_at(triangle, point);
                assert!((found - Vec2::new(u as f32, v as f32)).length() < 1e-6, "{front} {u} {v}: {found}");
            }
        }
    }
}

#[test]
fn faults_of_shapes_name_their_place() {
    let rectangle = "[[rectangle]]\naxis = \"x\"\n";
    let cuboid = "[[box]]\nmin = [0, 0, 0]\n";
    for (text, place, words) in [
        ("[[rectangle]]\naxis = \"w\"".to_owned(), "2:8", "unknown word `w`"),
        ("[[rectangle]]\nat = 3".to_owned(), "1:1", "`axis` is missing in [[rectangle]]"),
        (format!("{rectangle}ranges = [[0,1],[0,1]]"), "1:1", "`at` is missing"),
        (format!("{rectangle}at = 1"), "1:1", "`ranges` is missing"),
        (format!("{rectangle}at = inf"), "3:6", "finite"),
        (format!("{rectangle}at = 0\nranges = [[0, 1]]"), "4:10", "two ranges"),
        (
            format!("{rectangle}at = 0\nranges = [[0, 1], [1, 1]]"),
            "4:19",
            "the smaller one first, but is [1, 1]",
        ),
        (
            format!("{rectangle}at = 0\nranges = [[0, 1], [2, 1]]"),
            "4:19",
            "the smaller one first, but is [2, 1]",
        ),
        (format!("{rectangle}at = 0\nranges = [[0, 1], 2]"), "4:19", "but is 2"),
        (format!("{rectangle}at = 0\nranges = [[0, nan], [0, 1]]"), "4:15", "finite"),
        ("[[box]]\nmax = [1, 1, 1]".to_owned(), "1:1", "`min` is missing in [[box]]"),
        (format!("{cuboid}max = [1, 0, 1]"), "3:7", "above `min` along each axis, but is [1, 0, 1]"),
        (format!("{cuboid}max = [1, 1]"), "3:7", "three numbers"),
        ("[[disk]]\ncenter = [0,0,0]\nradius = 1".to_owned(), "1:1", "`normal` is missing in [[disk]]"),
        ("[[disk]]\ncenter = [0,0,0]\nnormal = [0,0,0]".to_owned(), "3:10", "not zero"),
        ("[[disk]]\ncenter = [0,0,0]\nnormal = [0,1,0]\nradius = 0".to_owned(), "4:10", "above 0"),
        ("[[plane]]\npoint = [0,0,0]\nnormal = [0,1,0]\nsize = 0".to_owned(), "4:8", "above 0"),
        ("[[sphere]]\ncenter = [0,0,0]\nradius = 1\ninside_out = 1".to_owned(), "4:14", "true or false"),
        ("[[sphere]]\ncenter = [0,0,0]\nradius = 1\nuv_rotate = 1".to_owned(), "4:13", "three numbers"),
        (
            "[[box]]\nmax = [1, 1, 1]\nmin = [0, 0, 0]\nsize = 2".to_owned(),
            "4:1",
            "unknown key `size` in [[box]]",
        ),
    ] {
        assert_faults(&[(&text, place, &[words])]);
    }
}
