//! Parsing of an OBJ text. Every line is checked while its number is known, and the result is plain geometry:
//! positions, normals and texture coordinates, corners that refer to them, and polygons as triangles of corners.
//! Materials are names.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3, Vec3};

use super::super::printed::excerpt;
use super::super::warnings::Warnings;
use super::colors::Colors;
use super::corner::{self, Corner};
use super::lines::{Line, lines};
use super::numbers::{number, three_numbers};
use super::polygon;
use crate::mesh::{MAX_TRIANGLES, Smoothing};
use crate::scene::validate::MAX_COORDINATE;

/// A line that cannot be read.
#[derive(Debug, PartialEq)]
pub(super) struct LineError {
    /// Line, counted from 1.
    pub(super) line: usize,
    /// The fault and what was expected.
    pub(super) message: String,
}

/// The geometry of an OBJ text.
#[derive(Default)]
pub(super) struct Geometry {
    /// Positions, `v`, in the order of the file.
    pub(super) positions: Vec<DVec3>,
    /// Unit normals, `vn`; zero where one is no direction.
    pub(super) normals: Vec<Vec3>,
    /// Texture coordinates, `vt`; NaN where one is no number.
    pub(super) uvs: Vec<DVec2>,
    /// Corners of faces. Their vertices and normals are in range, texture coordinates may not be.
    pub(super) corners: Vec<Corner>,
    /// Faces as triangles, in the order of the file: indices into `corners`.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Averaging of missing normals.
    pub(super) smoothing: Smoothing,
    /// Runs of triangles with one material, in their order.
    pub(super) runs: Vec<MaterialRun>,
    /// Material libraries with the lines that name them.
    pub(super) libraries: Vec<(usize, String)>,
    /// Colours of the first vertices: see [`Colors::finish`].
    pub(super) colors: Vec<[u8; 3]>,
}

/// Consecutive triangles with one material.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MaterialRun {
    /// The line of the `usemtl`, for messages.
    pub(super) line: usize,
    /// `None` before the first `usemtl`.
    pub(super) material: Option<String>,
    /// Number of triangles after triangulation.
    pub(super) triangles: usize,
}

/// Parses an OBJ text. Without smoothing groups, faces that meet at less than `crease_angle` degrees are smooth.
pub(super) fn read(text: &str, crease_angle: f64, warnings: &mut Warnings) -> Result<Geometry, LineError> {
    let mut reader = Reader::default();
    for line in lines(text) {
        reader.line(&line, warnings).map_err(|message| LineError { line: line.number, message })?;
    }
    reader.finish(crease_angle, warnings)
}

/// Corners and smoothing group of a face.
struct Face {
    /// Index behind its last corner in [`Geometry::corners`].
    end: usize,
    /// Smoothing group, 0 for none; `None` before the first `s`.
    group: Option<u32>,
}

#[derive(Default)]
struct Reader {
    geometry: Geometry,
    colors: Colors,
    faces: Vec<Face>,
    /// Number of faces in each run of [`Geometry::runs`].
    faces_of_runs: Vec<usize>,
    group: Option<u32>,
    /// Vertices out of bounds by index, with their lines.
    unusable: BTreeMap<u32, usize>,
    /// The largest vertex number, counted from 1, and its line.
    largest: (usize, usize),
    skipped: BTreeMap<&'static str, (usize, usize)>,
}

impl Reader {
    fn line(&mut self, line: &Line<'_>, warnings: &mut Warnings) -> Result<(), String> {
        match line.keyword() {
            "v" => {
                self.colors.vertex(self.geometry.positions.len(), line, warnings);
                return self.vertex(line);
            }
            "vn" => self.normal(line),
            "vt" => self.texture_coordinate(line),
            "f" => return self.face(line),
            "s" => self.smoothing_group(line, warnings),
            "usemtl" => {
                let material = Some(line.rest().to_owned()).filter(|name| !name.is_empty());
                self.begin_run(MaterialRun { line: line.number, material, triangles: 0 });
            }
            "mtllib" => self.geometry.libraries.push((line.number, line.rest().to_owned())),
            "o" | "g" | "mg" => {}
            "p" | "l" => self.skip("points and lines are left out: only faces are drawn", line.number),
            "vp" | "cstype" | "deg" | "curv" | "curv2" | "surf" | "bmat" | "step" | "parm" | "trim"
            | "hole" | "scrv" | "sp" | "end" | "con" => {
                self.skip("curves and surfaces are not supported: only faces are drawn", line.number);
            }
            keyword => {
                let keyword = excerpt(keyword, 20);
                warnings.once(&keyword, line.number, format!("unknown statement `{keyword}` is left out"));
            }
        }
        Ok(())
    }

    fn skip(&mut self, reason: &'static str, line: usize) {
        self.skipped.entry(reason).or_insert((line, 0)).1 += 1;
    }

    /// `v x y z`, followed by an ignored weight or by a colour: see [`Colors`].
    fn vertex(&mut self, line: &Line<'_>) -> Result<(), String> {
        let position = three_numbers(line.rest()).ok_or_else(|| expected_numbers(line))?;
        if !(position.abs().cmple(DVec3::splat(MAX_COORDINATE)).all()) {
            self.unusable.insert(self.geometry.positions.len() as u32, line.number);
        }
        self.geometry.positions.push(position);
        Ok(())
    }

    /// `vn x y z`. A normal that is no direction counts as missing, because a shape is complete without normals.
    fn normal(&mut self, line: &Line<'_>) {
        let normal = three_numbers(line.rest()).unwrap_or(DVec3::ZERO);
        self.geometry.normals.push(normal.normalize_or_zero().as_vec3());
    }

    /// `vt u`, `vt u v` or `vt u v w`.
    fn texture_coordinate(&mut self, line: &Line<'_>) {
        let mut numbers = line.rest().split_ascii_whitespace().map(|word| number(word).unwrap_or(f64::NAN));
        let (u, v) = (numbers.next().unwrap_or(f64::NAN), numbers.next().unwrap_or(0.0));
        self.geometry.uvs.push(DVec2::new(u, v));
    }

    /// `s 1`, `s off` or `s 0`.
    fn smoothing_group(&mut self, line: &Line<'_>, warnings: &mut Warnings) {
        let word = line.rest();
        let group = match word.parse::<u64>() {
            Ok(number) => u32::try_from(number).ok(),
            Err(_) if word.eq_ignore_ascii_case("off") => Some(0),
            Err(_) if word.eq_ignore_ascii_case("on") => Some(1),
            Err(_) => None,
        };
        match group {
            Some(_) => self.group = group,
            None => warnings.once(
                "smoothing group",
                line.number,
                "a smoothing group that is no whole number up to 4294967295, `off` or `on` is left out",
            ),
        }
    }

    fn face(&mut self, line: &Line<'_>) -> Result<(), String> {
        let count = line.rest().split_ascii_whitespace().count();
        if count < 3 {
            self.skip("faces with fewer than three corners are left out", line.number);
            return Ok(());
        }
        let counts = self.geometry.counts();
        for text in line.rest().split_ascii_whitespace() {
            let corner = corner::read(text, counts)?;
            let number = corner::vertex_number(text).unwrap_or(0);
            if number > self.largest.0 {
                self.largest = (number, line.number);
            }
            self.geometry.corners.push(corner);
        }
        let end = self.geometry.corners.len();
        self.faces.push(Face { end, group: self.group });
        if end - 2 * self.faces.len() > MAX_TRIANGLES {
            return Err(format!(
                "the faces up to this one have more than {MAX_TRIANGLES} triangles, the limit"
            ));
        }
        if self.faces_of_runs.is_empty() {
            self.begin_run(MaterialRun { line: 0, material: None, triangles: 0 });
        }
        if let Some(faces) = self.faces_of_runs.last_mut() {
            *faces += 1;
        }
        Ok(())
    }

    fn begin_run(&mut self, run: MaterialRun) {
        self.geometry.runs.push(run);
        self.faces_of_runs.push(0);
    }

    fn finish(mut self, crease_angle: f64, warnings: &mut Warnings) -> Result<Geometry, LineError> {
        let (number, line) = self.largest;
        let count = self.geometry.positions.len();
        if number > count {
            let message = format!("the face names vertex {number}, but the file has {count}");
            return Err(LineError { line, message });
        }
        self.check_unusable(warnings)?;
        self.geometry.colors = std::mem::take(&mut self.colors).finish(warnings);
        for (reason, (line, count)) in &self.skipped {
            warnings.at_line(*line, format!("{reason} ({count} in the file)"));
        }
        self.geometry.remove_missing_normals(warnings);
        self.triangulate(crease_angle);
        Ok(self.geometry)
    }

    /// Refuses a vertex that is not finite where a face uses it; warns about unused ones.
    fn check_unusable(&self, warnings: &mut Warnings) -> Result<(), LineError> {
        let Some((_, first_line)) = self.unusable.first_key_value() else { return Ok(()) };
        let mut used = self.geometry.corners.iter().filter_map(|corner| self.unusable.get(&corner.vertex));
        if let Some(&line) = used.next() {
            let message = "this vertex is used by a face, but is not finite or beyond 1e30".to_owned();
            return Err(LineError { line, message });
        }
        let count = self.unusable.len();
        let message = format!("{count} vertices that no face uses are not finite, and are left out");
        warnings.at_line(*first_line, message);
        Ok(())
    }

    fn triangulate(&mut self, crease_angle: f64) {
        let Self { geometry, faces, faces_of_runs, .. } = self;
        let grouped = faces.iter().any(|face| face.group.is_some());
        let mut groups = Vec::new();
        let mut faces = faces.iter();
        let (mut start, mut points, mut cut) = (0, Vec::new(), Vec::new());
        for (run, count) in geometry.runs.iter_mut().zip(faces_of_runs) {
            for face in faces.by_ref().take(*count) {
                let first = start as u32;
                let corners = geometry.corners.get(start..face.end).unwrap_or_default();
                start = face.end;
                cut.clear();
                if corners.len() == 3 {
                    cut.push([0, 1, 2]);
                } else {
                    points.clear();
                    points.extend(corners.iter().map(|corner| geometry.positions[corner.vertex as usize]));
                    polygon::cut(&points, &mut cut);
                }
                geometry.triangles.extend(cut.iter().map(|triangle| triangle.map(|corner| first + corner)));
                if grouped {
                    // Faces before the first `s` are flat.
                    groups.extend(cut.iter().map(|_| face.group.unwrap_or(0)));
                }
                run.triangles += cut.len();
            }
        }
        geometry.smoothing =
            if grouped { Smoothing::Groups(groups) } else { Smoothing::CreaseAngle(crease_angle) };
    }
}

impl Geometry {
    /// Numbers of vertices, texture coordinates and normals so far.
    fn counts(&self) -> [usize; 3] {
        [self.positions.len(), self.uvs.len(), self.normals.len()]
    }

    /// Removes normals that are out of range or no direction from corners; they are averaged instead.
    fn remove_missing_normals(&mut self, warnings: &mut Warnings) {
        let (mut absent, mut unusable, mut without) = (0, 0, 0);
        for corner in &mut self.corners {
            match self.normals.get(corner.normal as usize) {
                _ if corner.normal == corner::NONE => without += 1,
                None => absent += 1,
                Some(&Vec3::ZERO) => unusable += 1,
                Some(_) => continue,
            }
            corner.normal = corner::NONE;
        }
        let missing = absent + unusable + without;
        let some_have_one = absent + unusable > 0 || missing < self.corners.len();
        if missing == 0 || !some_have_one {
            return;
        }
        let cases = [
            (absent, "name a normal that is not in the file"),
            (unusable, "name one that is zero or not finite"),
            (without, "have none"),
        ];
        let cases: Vec<String> = cases
            .into_iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("{count} {what}"))
            .collect();
        let all = self.corners.len();
        warnings.at_file(format!(
            "of {all} corners of faces, {}: their normals are averaged over the faces",
            cases.join(", ")
        ));
    }
}

fn expected_numbers(line: &Line<'_>) -> String {
    let text: String = line.text.chars().take(60).collect();
    format!("`{text}`: three numbers were expected after `{}`", line.keyword())
}
