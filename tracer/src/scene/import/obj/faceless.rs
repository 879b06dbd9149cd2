//! Descriptions of OBJ files without faces.

use super::super::foreign::{describe_other_text, is_binary};
use super::lines::lines;

/// Numbers of statements in a file without faces.
#[derive(Default)]
struct Counts {
    vertices: usize,
    points: usize,
    lines: usize,
    curves: usize,
    short_faces: usize,
    others: usize,
}

/// A message with the content of the file and a remedy.
pub(super) fn reason(content: &[u8], text: &str) -> String {
    let counts = Counts::of(text);
    if counts.none() || is_binary(content, text) {
        return format!("no faces in the file: {}", describe_other_text(content, text));
    }
    let Counts { vertices, points, lines, curves, short_faces, .. } = counts;
    let (what, advice) = if curves > 0 {
        let what = format!("its curves and surfaces ({curves} of `curv`, `curv2` and `surf`) are not drawn");
        (what, "export the model as polygons")
    } else if lines > 0 {
        (format!("its {lines} lines (`l`) are not drawn"), "export the model as a surface of polygons")
    } else if short_faces > 0 {
        (format!("its {short_faces} faces have fewer than three corners"), "export the model as polygons")
    } else if vertices > 0 {
        let points = if points > 0 { points } else { vertices };
        let what = format!("it is a cloud of {points} points, and points are not drawn");
        (what, "make a surface of them, for example with MeshLab")
    } else {
        return "no faces in the file; a model needs at least one `f` line".into();
    };
    format!("no faces in the file: {what}; {advice}")
}

impl Counts {
    fn of(text: &str) -> Self {
        let mut counts = Self::default();
        for line in lines(text) {
            match line.keyword() {
                "v" => counts.vertices += 1,
                "p" => counts.points += line.rest().split_ascii_whitespace().count(),
                "l" => counts.lines += 1,
                "curv" | "curv2" | "surf" => counts.curves += 1,
                "f" => counts.short_faces += 1,
                "vt" | "vn" | "vp" | "o" | "g" | "s" | "mg" | "usemtl" | "mtllib" | "cstype" => {
                    counts.others += 1
                }
                _ => {}
            }
        }
        counts
    }

    fn none(&self) -> bool {
        let Self { vertices, points, lines, curves, short_faces, others } = self;
        vertices + points + lines + curves + short_faces + others == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_statements_are_counted() {
        let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
        for (text, words) in [
            (square.to_owned(), "a cloud of 4 points"),
            (format!("{square}p 1 2 3\np 4\n"), "a cloud of 4 points"),
            (format!("{square}l 1 2 3 4 1\nl 1 3\n"), "its 2 lines (`l`) are not drawn"),
            (format!("{square}f\nf 1 2\n"), "its 2 faces have fewer than three corners"),
            (format!("{square}cstype bezier\ncurv 0 1 1 2\nend\n"), "1 of `curv`"),
            ("g empty\no group\n".to_owned(), "a model needs at least one `f` line"),
            ("Not Found".to_owned(), "no line of this file is a statement of an OBJ file"),
            (String::new(), "the file is empty"),
        ] {
            let message = reason(text.as_bytes(), &text);
            assert!(message.starts_with("no faces in the file") && message.contains(words), "{message}");
        }
    }
}
