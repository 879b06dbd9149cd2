//! Table of a measurement, written and read as CSV.
//!
//! One row per setting. Values that are the same for all rows are repeated in each, so that tables can be
//! concatenated. Columns may be in any order, and unknown ones are ignored; those of [`COLUMNS`] keep their names
//! and their meaning.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use csv::StringRecord;
use rayfarm_text::printable_within;
use rayfarm_tracer::files::read_within;
use rayfarm_tracer::image::{Difference, MAX_SIDE};
use serde::Serialize;

use super::pareto;

/// Bounds of a table that is read: rows, bytes, and bytes of a name.
const MAX_ROWS: usize = 1_000;
const MAX_BYTES: u64 = 1 << 20;
const MAX_NAME: usize = 200;

/// Columns in the order in which they are written.
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

/// The measured scene and machine, with a row for each setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Table {
    /// Name of the scene.
    pub(crate) scene: String,
    /// Pixels per row.
    pub(crate) width: u32,
    /// Rows.
    pub(crate) height: u32,
    /// Render threads.
    pub(crate) threads: usize,
    /// SIMD level.
    pub(crate) simd_level: String,
    /// Rows in the order of the settings; never empty after reading.
    pub(crate) rows: Vec<Row>,
}

/// Measurement of one setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Row {
    /// Name of the setting.
    pub(crate) setting: String,
    /// Median time of a frame, in milliseconds.
    pub(crate) median_ms: f64,
    /// Least time of a frame, in milliseconds.
    pub(crate) min_ms: f64,
    /// Largest difference of a channel against the reference, in steps of 1/255, as in [`Difference`].
    pub(crate) max_error: u8,
    /// Root mean square error, in steps of 1/255.
    pub(crate) rmse: f64,
    /// Peak signal-to-noise ratio in decibels: infinite for equal pictures, which JSON shows as null.
    pub(crate) psnr_db: f64,
    /// Structural similarity.
    pub(crate) ssim: f64,
    /// Mean of FLIP.
    pub(crate) flip: f64,
}

/// Error of reading a table.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {problem}", path = .path.display())]
pub(crate) struct TableError {
    path: PathBuf,
    /// Description, with the line where there is one.
    problem: String,
}

impl Row {
    /// A row without times.
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
    /// Indices of the rows on the front, from the fastest to the best: [`pareto::front`] of the median time and
    /// FLIP.
    pub(crate) fn front(&self) -> Vec<usize> {
        let points: Vec<(f64, f64)> = self.rows.iter().map(|row| (row.median_ms, row.flip)).collect();
        pareto::front(&points)
    }

    /// Encodes the table as CSV.
    ///
    /// # Errors
    /// An error of the encoder.
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

    /// Reads a table that [`Self::to_csv`] has written.
    ///
    /// # Errors
    /// A missing or oversized file; missing columns; a number out of its range, with the line; duplicate settings;
    /// rows of different scenes, sizes or machines.
    pub(crate) fn read(path: &Path) -> Result<Self, TableError> {
        let error = |problem: String| TableError { path: path.to_owned(), problem };
        let text =
            read_within(path, MAX_BYTES).map_err(|cause| error(cause.to_string()))?.ok_or_else(|| {
                error(format!("has more than {MAX_BYTES} bytes: a table of tradeoff is never that long"))
            })?;
        Self::parse(&text).map_err(error)
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
                    "line {line}: setting \"{}\" is a duplicate",
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
                        "line {line}: is of another scene, size or machine than the first row; keep the rows of one of them"
                    ));
                }
                Some(table) => table.rows.extend(one.rows),
            }
        }
        table.ok_or_else(|| "has no rows; write a new one with rayfarm-master tradeoff".to_owned())
    }

    fn is_measured_like(&self, other: &Self) -> bool {
        (&self.scene, self.width, self.height, self.threads, &self.simd_level)
            == (&other.scene, other.width, other.height, other.threads, &other.simd_level)
    }
}

/// Indices of [`COLUMNS`] in the header.
fn places(header: &StringRecord) -> Result<[usize; COLUMNS.len()], String> {
    let mut places = [0; COLUMNS.len()];
    for (place, name) in places.iter_mut().zip(COLUMNS) {
        *place = header.iter().position(|column| column.trim() == name).ok_or_else(|| {
            format!("has no column \"{name}\": is it a tradeoff.csv of rayfarm-master tradeoff?")
        })?;
    }
    Ok(places)
}

/// A record with access by column name.
struct Fields<'a> {
    record: &'a StringRecord,
    places: &'a [usize; COLUMNS.len()],
}

impl Fields<'_> {
    /// A table of this record alone.
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

/// Rounds to a number of decimal places; more would be noise.
fn rounded(value: f64, digits: i32) -> f64 {
    let scale = 10_f64.powi(digits);
    (value * scale).round() / scale
}

#[cfg(test)]
mod tests;
