//! The table of a measurement: written as CSV, read back by whoever goes by it.
//!
//! A row for each setting; what is the same for all of them is repeated in each, so that tables can be put together. Columns may stand in
//! any order, and columns that are not known are left alone; those of [`COLUMNS`] keep their names and their meaning.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use csv::StringRecord;
use rayfarm_text::printable_within;
use rayfarm_tracer::files::read_within;
use rayfarm_tracer::image::{Difference, MAX_SIDE};
use serde::Serialize;

use super::pareto;

/// Far more than there are settings, and their bytes.
const MAX_ROWS: usize = 1_000;
const MAX_BYTES: u64 = 1 << 20;
const MAX_NAME: usize = 200;

/// The columns, in the order in which they are written.
const COLUMNS: [&str; 14] = [
    "scene",
    "width",
    "height",
    "threads",
    "simd_level",
    "setting",
    "median_ms",
    "min_ms",
    "max_error",
    "rmse",
    "psnr_db",
    "ssim",
    "flip",
    "front",
];

/// What was measured, and on what.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Table {
    /// The scene's name.
    pub(crate) scene: String,
    /// Pixels per row.
    pub(crate) width: u32,
    /// Rows.
    pub(crate) height: u32,
    /// Render threads.
    pub(crate) threads: usize,
    /// The vectors that were used.
    pub(crate) simd_level: String,
    /// In the order in which settings are listed. Never empty after reading.
    pub(crate) rows: Vec<Row>,
}

/// One setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Row {
    /// Its name.
    pub(crate) setting: String,
    /// Median and least time of a frame, in milliseconds.
    pub(crate) median_ms: f64,
    /// See `median_ms`.
    pub(crate) min_ms: f64,
    /// Against the reference, as in [`Difference`]: the largest of a channel,
    pub(crate) max_error: u8,
    /// root of the mean square,
    pub(crate) rmse: f64,
    /// in decibels (infinite for equal pictures; JSON has null there),
    pub(crate) psnr_db: f64,
    /// structural similarity,
    pub(crate) ssim: f64,
    /// and the mean of FLIP.
    pub(crate) flip: f64,
}

/// Why a table cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {problem}", path = .path.display())]
pub(crate) struct TableError {
    path: PathBuf,
    /// With the line, where there is one.
    problem: String,
}

impl Row {
    /// A setting that is not timed yet.
    pub(crate) fn new(setting: String, difference: &Difference, flip: f64) -> Self {
        Self {
            setting,
            median_ms: 0.0,
            min_ms: 0.0,
            max_error: difference.max,
            rmse: rounded(difference.rmse, 4),
            psnr_db: rounded(difference.psnr, 3),
            ssim: rounded(difference.ssim, 6),
            flip: rounded(flip, 6),
        }
    }
}

impl Table {
    /// Rows worth having, from the fastest to the best: see [`pareto::front`] of the median time and FLIP.
    pub(crate) fn front(&self) -> Vec<usize> {
        let points: Vec<(f64, f64)> = self.rows.iter().map(|row| (row.median_ms, row.flip)).collect();
        pareto::front(&points)
    }

    /// As CSV.
    ///
    /// # Errors
    /// What the encoder says.
    pub(crate) fn to_csv(&self) -> Result<Vec<u8>, csv::Error> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(COLUMNS)?;
        let front = self.front();
        for (index, row) in self.rows.iter().enumerate() {
            writer.write_record(&[
                self.scene.clone(),
                self.width.to_string(),
                self.height.to_string(),
                self.threads.to_string(),
                self.simd_level.clone(),
                row.setting.clone(),
                row.median_ms.to_string(),
                row.min_ms.to_string(),
                row.max_error.to_string(),
                row.rmse.to_string(),
                row.psnr_db.to_string(),
                row.ssim.to_string(),
                row.flip.to_string(),
                u8::from(front.contains(&index)).to_string(),
            ])?;
        }
        writer.into_inner().map_err(|error| error.into_error().into())
    }

    /// Reads a table that was written before.
    ///
    /// # Errors
    /// A missing or oversized file; missing columns; a number out of its range, with the line; settings twice; rows of different scenes, sizes
    /// or machines.
    pub(crate) fn read(path: &Path) -> Result<Self, TableError> {
        let refuse = |problem: String| TableError { path: path.to_owned(), problem };
        let text =
            read_within(path, MAX_BYTES).map_err(|error| refuse(error.to_string()))?.ok_or_else(|| {
                refuse(format!("has more than {MAX_BYTES} bytes: no table of tradeoff is that long"))
            })?;
        Self::parse(&text).map_err(refuse)
    }

    pub(crate) fn parse(text: &[u8]) -> Result<Self, String> {
        let mut reader = csv::Reader::from_reader(text);
        let places = places(reader.headers().map_err(|error| error.to_string())?)?;
        let mut table: Option<Self> = None;
        let mut names = BTreeSet::new();
        for record in reader.records() {
            let record = record.map_err(|error| error.to_string())?;
            let line = record.position().map_or(0, csv::Position::line);
            let fields = Fields { record: &record, places: &places };
            let one = fields.table().map_err(|problem| format!("line {line}: {problem}"))?;
            let row = &one.rows[0];
            if !names.insert(row.setting.clone()) {
                return Err(format!(
                    "line {line}: setting \"{}\" is there twice",
                    printable_within(&row.setting, MAX_NAME)
                ));
            }
            match &mut table {
                None => table = Some(one),
                Some(table) if table.rows.len() == MAX_ROWS => {
                    return Err(format!("line {line}: more than {MAX_ROWS} rows"));
                }
                Some(table) if !table.is_measured_like(&one) => {
                    return Err(format!(
                        "line {line}: is of another scene, size or machine than the lines before; keep one of them"
                    ));
                }
                Some(table) => table.rows.extend(one.rows),
            }
        }
        table.ok_or_else(|| "has no rows; write it anew with rayfarm-master tradeoff".to_owned())
    }

    fn is_measured_like(&self, other: &Self) -> bool {
        (&self.scene, self.width, self.height, self.threads, &self.simd_level)
            == (&other.scene, other.width, other.height, other.threads, &other.simd_level)
    }
}

/// Where each of [`COLUMNS`] stands.
fn places(header: &StringRecord) -> Result<[usize; COLUMNS.len()], String> {
    let mut places = [0; COLUMNS.len()];
    for (place, name) in places.iter_mut().zip(COLUMNS) {
        *place = header.iter().position(|column| column.trim() == name).ok_or_else(|| {
            format!("has no column \"{name}\": is it a tradeoff.csv of rayfarm-master tradeoff?")
        })?;
    }
    Ok(places)
}

/// A line, by the names of its columns.
struct Fields<'a> {
    record: &'a StringRecord,
    places: &'a [usize; COLUMNS.len()],
}

impl Fields<'_> {
    /// A table of this line alone.
    fn table(&self) -> Result<Table, String> {
        let side = 1.0..=f64::from(MAX_SIDE);
        let error = 0.0..=255.0;
        let time = f64::MIN_POSITIVE..=1e12;
        let row = Row {
            setting: self.name("setting")?,
            median_ms: self.number("median_ms", &time)?,
            min_ms: self.number("min_ms", &time)?,
            max_error: self.whole("max_error", &error)? as u8,
            rmse: self.number("rmse", &error)?,
            psnr_db: self.number("psnr_db", &(0.0..=f64::INFINITY))?,
            ssim: self.number("ssim", &(-1.0..=1.0))?,
            flip: self.number("flip", &(0.0..=1.0))?,
        };
        Ok(Table {
            scene: self.name("scene")?,
            width: self.whole("width", &side)? as u32,
            height: self.whole("height", &side)? as u32,
            threads: self.whole("threads", &(1.0..=1e6))? as usize,
            simd_level: self.name("simd_level")?,
            rows: vec![row],
        })
    }

    fn text(&self, column: &str) -> &str {
        let place = COLUMNS.iter().position(|known| *known == column).map(|index| self.places[index]);
        place.and_then(|place| self.record.get(place)).unwrap_or_default().trim()
    }

    fn name(&self, column: &str) -> Result<String, String> {
        let text = self.text(column);
        if text.is_empty() || text.len() > MAX_NAME {
            return Err(format!("column {column}: expected a name of 1 to {MAX_NAME} bytes"));
        }
        Ok(text.to_owned())
    }

    fn number(&self, column: &str, range: &std::ops::RangeInclusive<f64>) -> Result<f64, String> {
        let text = self.text(column);
        let number = text.parse::<f64>().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| {
            let (least, most) = (range.start(), range.end());
            let least =
                if *least == f64::MIN_POSITIVE { "above 0".to_owned() } else { format!("from {least}") };
            format!(
                "column {column}: expected a number {least} to {most}, but found \"{}\"",
                printable_within(text, MAX_NAME)
            )
        })
    }

    fn whole(&self, column: &str, range: &std::ops::RangeInclusive<f64>) -> Result<f64, String> {
        self.number(column, range).and_then(|number| {
            let whole = number.fract() == 0.0;
            if whole {
                Ok(number)
            } else {
                Err(format!("column {column}: expected a whole number, but found {number}"))
            }
        })
    }
}

/// With so many digits behind the point: more would be noise.
fn rounded(value: f64, digits: i32) -> f64 {
    let scale = 10_f64.powi(digits);
    (value * scale).round() / scale
}

#[cfg(test)]
mod tests;
