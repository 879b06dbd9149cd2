//! Vertex colours of OBJ, `v x y z r g b`. Like texture coordinates they belong to the corners of triangles.

use super::super::warnings::Warnings;
use super::geometry::Geometry;
use super::lines::Line;

/// Colour of a vertex without one: larger than any byte.
const WHITE: [f32; 3] = [f32::INFINITY; 3];

/// Vertex colours under construction, line by line.
#[derive(Default)]
pub(super) struct Colors {
    /// Colours of the first vertices as in the file; empty before the first colour.
    vertices: Vec<[f32; 3]>,
    /// Number of the first line with a colour.
    first: usize,
    largest: f32,
}

impl Colors {
    /// Reads the colour of a vertex line; `before` is the number of earlier vertices.
    pub(super) fn vertex(&mut self, before: usize, line: &Line<'_>, warnings: &mut Warnings) {
        let Some(color) = color(line, warnings) else { return };
        if self.vertices.is_empty() {
            self.first = line.number;
        }
        self.vertices.resize(before, WHITE);
        self.vertices.push(color);
        self.largest = color.into_iter().fold(self.largest, f32::max);
    }

    /// The colours as sRGB bytes of the first vertices; further vertices are white.
    pub(super) fn finish(self, warnings: &mut Warnings) -> Vec<[u8; 3]> {
        let scale = if self.largest > 1.0 { 1.0 } else { 255.0 };
        if self.largest > 1.0 {
            warnings.at_line(self.first, "colours of vertices are above 1: taken to be from 0 to 255");
        }
        let code = |channel: f32| (channel * scale + 0.5).clamp(0.0, 255.0) as u8;
        self.vertices.into_iter().map(|color| color.map(code)).collect()
    }
}

/// Colours of the corners of a model's triangles; empty where all are white.
pub(super) fn of_model(geometry: &Geometry) -> Vec<[[u8; 3]; 3]> {
    if geometry.colors.is_empty() {
        return Vec::new();
    }
    let vertex = |corner: u32| geometry.corners.get(corner as usize).map_or(0, |corner| corner.vertex + 1);
    let triangles: Vec<[u32; 3]> = geometry.triangles.iter().map(|triangle| triangle.map(vertex)).collect();
    of_triangles(&geometry.colors, &triangles)
}

/// Colours of the corners of triangles, with vertices counted from 1; empty where all are white.
fn of_triangles(vertices: &[[u8; 3]], triangles: &[[u32; 3]]) -> Vec<[[u8; 3]; 3]> {
    let white = [u8::MAX; 3];
    if vertices.iter().all(|color| *color == white) {
        return Vec::new();
    }
    let find = |index: u32| vertices.get((index as usize).wrapping_sub(1)).copied().unwrap_or(white);
    let colors: Vec<[[u8; 3]; 3]> = triangles.iter().map(|corners| corners.map(find)).collect();
    if colors.iter().flatten().all(|color| *color == white) { Vec::new() } else { colors }
}

/// The numbers behind the position: three, or four with an alpha. A single number is a weight.
fn color(line: &Line<'_>, warnings: &mut Warnings) -> Option<[f32; 3]> {
    let mut words = line.rest().split_ascii_whitespace().skip(3);
    let words = [words.next()?, words.next()?, words.next()?];
    let mut color = [0.0; 3];
    for (channel, word) in color.iter_mut().zip(words) {
        let Some(number) = word.parse::<f32>().ok().filter(|number| (0.0..=255.0).contains(number)) else {
            let message = "a colour of a vertex that is no three numbers from 0 to 255 is taken for white";
            warnings.once(message, line.number, message);
            return None;
        };
        *channel = number;
    }
    Some(color)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::lines::lines;
    use super::*;

    /// Colours of the vertices, and the warnings.
    fn read(text: &str) -> (Vec<[u8; 3]>, Vec<String>) {
        let mut warnings = Warnings::about(Path::new("a.obj"));
        let mut colors = Colors::default();
        for (before, line) in lines(text).enumerate() {
            colors.vertex(before, &line, &mut warnings);
        }
        let colors = colors.finish(&mut warnings);
        (colors, warnings.into_messages())
    }

    #[test]
    fn colours_belong_to_the_corners_of_triangles() {
        let (colors, warnings) =
            read("v 0 0 0\nv 0 0 0 1 0 0\nv 1 0 0 0 0.5 0 1\nv 1 1 0\nv 0 1 0 0 0 1\nv 1 1 1 1\n");
        let [red, green, white, blue] = [[255, 0, 0], [0, 128, 0], [255; 3], [0, 0, 255]];
        assert_eq!(colors, [white, red, green, white, blue]);
        assert_eq!(warnings, [""; 0]);
        let triangles = of_triangles(&colors, &[[2, 3, 4], [5, 6, 0]]);
        assert_eq!(triangles, [[red, green, white], [blue, white, white]]);
        assert!(of_triangles(&colors, &[[1, 4, 6]]).is_empty() && of_triangles(&[], &[[1, 2, 3]]).is_empty());
    }

    #[test]
    fn bytes_are_recognised_by_a_number_above_one() {
        let (colors, warnings) = read("v 0 0 0 255 0 1\nv 1 0 0 128 1 0\nv 0 1 0 0 0 0\n");
        assert_eq!(colors, [[255, 0, 1], [128, 1, 0], [0, 0, 0]]);
        assert_eq!(warnings, ["a.obj:1: colours of vertices are above 1: taken to be from 0 to 255"]);
    }

    #[test]
    fn invalid_colours_are_white() {
        let (colors, warnings) = read("v 0 0 0 x 0 1\nv 1 0 0 -1 0 0\nv 0 1 0 0 nan 0\nv 0 0 0 0 1 300\n");
        assert_eq!(colors, [[0; 3]; 0]);
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(warnings[0].contains("4 lines"), "{warnings:?}");
        assert_eq!(read("v 0 0 0 1\nv 1 0 0 1\n"), (vec![], vec![]));
    }
}
