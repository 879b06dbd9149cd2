//! The first reading of an OBJ text: every line is checked where its number is still known, and what remains is plain
//! geometry that the parser behind it reads without surprises: `v`, `vn` and `f` lines with positive indices that
//! exist. Materials are noted beside it. Texture coordinates are left to [`super::uvs`]: seams in them would split the
//! vertices that normals are averaged over.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::super::MAX_COORDINATE;
use super::super::warnings::Warnings;
use super::lines::{Line, lines};

/// A line that cannot be read.
#[derive(Debug, PartialEq)]
pub(super) struct LineError {
    /// Counted from 1.
    pub(super) line: usize,
    /// What is wrong and what was expected.
    pub(super) message: String,
}

/// What the parser needs, and what it is not told.
#[derive(Default)]
pub(super) struct Geometry {
    /// `v`, `vn` and `f` lines.
    pub(super) text: String,
    /// Which triangles have which material, in their order.
    pub(super) runs: Vec<MaterialRun>,
    /// Material libraries and the lines that name them.
    pub(super) libraries: Vec<(usize, String)>,
    /// Some corners have a normal and some have none.
    pub(super) uneven_normals: bool,
}

/// Triangles in a row that share a material.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MaterialRun {
    /// The line of the `usemtl`, for messages.
    pub(super) line: usize,
    /// `None` before the first `usemtl`.
    pub(super) material: Option<String>,
    /// How many, once polygons are cut into triangles.
    pub(super) triangles: usize,
}

/// Reads an OBJ text; without `normals` it is read as if it had none.
pub(super) fn read(text: &str, normals: bool, warnings: &mut Warnings) -> Result<Geometry, LineError> {
    let mut reader = Reader { normals, ..Reader::default() };
    for line in lines(text) {
        reader.line(&line, warnings).map_err(|message| LineError { line: line.number, message })?;
    }
    reader.finish(warnings)
}

#[derive(Default)]
struct Reader {
    normals: bool,
    geometry: Geometry,
    vertex_count: usize,
    normal_count: usize,
    /// Vertices out of bounds, by number counted from 1, with their lines.
    unusable: BTreeMap<usize, usize>,
    /// The largest index of a vertex, and of a normal, and the line that has it.
    largest: [(usize, usize); 2],
    corners_with_normal: usize,
    corners_without_normal: usize,
    skipped: BTreeMap<&'static str, (usize, usize)>,
}

impl Reader {
    fn line(&mut self, line: &Line<'_>, warnings: &mut Warnings) -> Result<(), String> {
        match line.keyword() {
            "v" => self.vertex(line),
            "vn" => self.normal(line),
            "f" => self.face(line),
            "usemtl" => {
                let material = Some(line.rest().to_owned()).filter(|name| !name.is_empty());
                let run = MaterialRun { line: line.number, material, triangles: 0 };
                self.geometry.runs.push(run);
                Ok(())
            }
            "mtllib" => {
                self.geometry.libraries.push((line.number, line.rest().to_owned()));
                Ok(())
            }
            "vt" | "o" | "g" | "s" | "mg" => Ok(()),
            "p" | "l" => {
                self.skip("points and lines are left out: only faces are drawn", line.number);
                Ok(())
            }
            "vp" | "cstype" | "deg" | "curv" | "curv2" | "surf" | "bmat" | "step" | "parm" | "trim"
            | "hole" | "scrv" | "sp" | "end" | "con" => {
                self.skip("curves and surfaces are not supported: only faces are drawn", line.number);
                Ok(())
            }
            keyword => {
                let keyword: String = keyword.chars().take(20).collect();
                warnings.at_line(line.number, format!("unknown statement `{keyword}` is left out"));
                Ok(())
            }
        }
    }

    fn skip(&mut self, reason: &'static str, line: usize) {
        self.skipped.entry(reason).or_insert((line, 0)).1 += 1;
    }

    /// `v x y z`, followed by a weight or a colour that nothing uses.
    fn vertex(&mut self, line: &Line<'_>) -> Result<(), String> {
        let numbers = three_numbers(line.rest()).ok_or_else(|| expected_numbers(line))?;
        self.vertex_count += 1;
        if !numbers.iter().all(|(_, number)| number.abs() <= MAX_COORDINATE) {
            self.unusable.insert(self.vertex_count, line.number);
        }
        self.write_numbers("v", numbers);
        Ok(())
    }

    fn normal(&mut self, line: &Line<'_>) -> Result<(), String> {
        let numbers = three_numbers(line.rest()).ok_or_else(|| expected_numbers(line))?;
        self.normal_count += 1;
        if self.normals {
            self.write_numbers("vn", numbers);
        }
        Ok(())
    }

    fn write_numbers(&mut self, keyword: &str, [x, y, z]: [(&str, f64); 3]) {
        let text = &mut self.geometry.text;
        // Writing to a String does not fail.
        let _ = writeln!(text, "{keyword} {} {} {}", x.0, y.0, z.0);
    }

    fn face(&mut self, line: &Line<'_>) -> Result<(), String> {
        let corners = line.rest().split_ascii_whitespace();
        let count = corners.clone().count();
        if count < 3 {
            self.skip("faces with fewer than three corners are left out", line.number);
            return Ok(());
        }
        self.geometry.text.push('f');
        for corner in corners {
            self.corner(corner, line.number)?;
        }
        self.geometry.text.push('\n');
        // A polygon is fanned from its first corner.
        self.current_run().triangles += count - 2;
        Ok(())
    }

    fn current_run(&mut self) -> &mut MaterialRun {
        let runs = &mut self.geometry.runs;
        if runs.is_empty() {
            runs.push(MaterialRun { line: 0, material: None, triangles: 0 });
        }
        let last = runs.len() - 1;
        &mut runs[last]
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`; negative ones count back from the line.
    fn corner(&mut self, corner: &str, line: usize) -> Result<(), String> {
        let mut parts = corner.split('/');
        let vertex = parts.next().unwrap_or_default();
        let texture = parts.next().unwrap_or_default();
        let normal = parts.next().unwrap_or_default();
        if parts.next().is_some() || !(texture.is_empty() || texture.parse::<i64>().is_ok()) {
            return Err(expected_corner(corner));
        }
        let vertex = resolve(vertex, self.vertex_count, "vertex", corner)?;
        note_largest(&mut self.largest[0], vertex, line);
        let _ = write!(self.geometry.text, " {vertex}");
        if !self.normals {
            return Ok(());
        }
        if normal.is_empty() {
            self.corners_without_normal += 1;
            return Ok(());
        }
        let normal = resolve(normal, self.normal_count, "normal", corner)?;
        note_largest(&mut self.largest[1], normal, line);
        self.corners_with_normal += 1;
        let _ = write!(self.geometry.text, "//{normal}");
        Ok(())
    }

    fn finish(mut self, warnings: &mut Warnings) -> Result<Geometry, LineError> {
        let counts = [("vertex", self.vertex_count), ("normal", self.normal_count)];
        for ((index, line), (what, count)) in self.largest.into_iter().zip(counts) {
            if index > count {
                let message = format!("the face names {what} {index}, but the file has {count}");
                return Err(LineError { line, message });
            }
        }
        self.check_unusable(warnings)?;
        for (reason, (line, count)) in &self.skipped {
            warnings.at_line(*line, format!("{reason} ({count} in the file)"));
        }
        self.geometry.uneven_normals = self.corners_with_normal > 0 && self.corners_without_normal > 0;
        Ok(self.geometry)
    }

    /// A vertex that is not finite is an error where a face needs it, and a curiosity where none does.
    fn check_unusable(&self, warnings: &mut Warnings) -> Result<(), LineError> {
        let Some((_, first_line)) = self.unusable.first_key_value() else { return Ok(()) };
        let faces = self.geometry.text.lines().filter_map(|line| line.strip_prefix("f "));
        let corners = faces.flat_map(|face| face.split(' '));
        let mut vertices = corners.filter_map(|corner| corner.split('/').next()?.parse::<usize>().ok());
        if let Some(line) = vertices.find_map(|vertex| self.unusable.get(&vertex)) {
            let message = "this vertex is used by a face, but is not finite or beyond 1e30".to_owned();
            return Err(LineError { line: *line, message });
        }
        let count = self.unusable.len();
        let message = format!("{count} vertices that no face uses are not finite, and are left out");
        warnings.at_line(*first_line, message);
        Ok(())
    }
}

fn three_numbers(text: &str) -> Option<[(&str, f64); 3]> {
    let mut words = text.split_ascii_whitespace().map(|word| Some((word, word.parse().ok()?)));
    Some([words.next()??, words.next()??, words.next()??])
}

fn expected_numbers(line: &Line<'_>) -> String {
    let text: String = line.text.chars().take(60).collect();
    format!("`{text}`: three numbers were expected after `{}`", line.keyword())
}

fn expected_corner(corner: &str) -> String {
    let corner: String = corner.chars().take(40).collect();
    format!(
        "`{corner}` is no corner of a face: `v`, `v/vt`, `v//vn` or `v/vt/vn` was expected, all whole numbers"
    )
}

/// An index counted from 1, as the file counts them.
fn resolve(text: &str, count: usize, what: &str, corner: &str) -> Result<usize, String> {
    let index: i64 = text.parse().map_err(|_| expected_corner(corner))?;
    if index > 0 {
        return usize::try_from(index).map_err(|_| expected_corner(corner));
    }
    if index == 0 {
        return Err(format!("`{corner}`: there is no {what} 0; they are counted from 1"));
    }
    // Counted back: -1 is the last one so far.
    let back = usize::try_from(index.unsigned_abs()).unwrap_or(usize::MAX);
    count.checked_sub(back).map(|index| index + 1).ok_or_else(|| {
        format!("`{corner}` counts {back} back, but only {count} {what} lines come before this one")
    })
}

fn note_largest(largest: &mut (usize, usize), index: usize, line: usize) {
    if index > largest.0 {
        *largest = (index, line);
    }
}
