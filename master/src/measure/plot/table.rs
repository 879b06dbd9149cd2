//! Series from CSV files with a header line.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use csv::StringRecord;
use rayfarm_text::printable_within;
use rayfarm_tracer::files::read_within;

use super::{Line, PlotError, Point, Series};

/// Series of a plot at most: more cannot be distinguished.
const MAX_SERIES: usize = 24;
/// Points of a plot at most: far more than a picture can show.
const MAX_POINTS: usize = 1_000_000;
/// Size of a table at most.
const MAX_BYTES: u64 = 256 << 20;
/// Columns that a message lists at most, and bytes that it quotes of a field.
const MAX_LISTED: usize = 40;
const MAX_QUOTED_BYTES: usize = 60;

/// Roles of columns.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Columns {
    /// Numbers; where it is empty, the row's y is a level.
    pub(crate) x: String,
    /// Numbers; rows where it is empty are skipped.
    pub(crate) y: String,
    /// Columns of the series: rows with equal values in all of them are one series.
    pub(crate) series: Vec<String>,
    /// Text at points.
    pub(crate) label: Option<String>,
    /// Only rows where each of these columns has that text.
    pub(crate) only: Vec<(String, String)>,
    /// Whether every row is a point of its own and points are not joined.
    pub(crate) scatter: bool,
    /// Names of dashed series.
    pub(crate) dashed: Vec<String>,
}

/// Reads all rows of all tables. Series are in the order of their first rows; a column with the same text in every
/// row is not part of their names. Points of one series with the same x are repeated measurements: the point has
/// their median and keeps their spread.
///
/// # Errors
/// Unreadable files, missing columns, text in place of numbers, too many series or points.
pub(crate) fn read_series(tables: &[PathBuf], columns: &Columns) -> Result<Vec<Series>, PlotError> {
    let mut rows = Vec::new();
    for path in tables {
        read_table(path, columns, &mut rows)
            .map_err(|problem| PlotError::Table { path: path.clone(), problem })?;
    }
    let mut groups: Vec<(Vec<String>, Vec<Row>)> = Vec::new();
    for row in rows {
        match groups.iter().position(|(key, _)| *key == row.key) {
            Some(index) => groups[index].1.push(row),
            None => groups.push((row.key.clone(), vec![row])),
        }
        if groups.len() > MAX_SERIES {
            return Err(PlotError::Chart(format!(
                "more than {MAX_SERIES} series: leave some out with --where, or name other columns"
            )));
        }
    }
    let differing = differing_columns(&groups);
    Ok(groups.into_iter().map(|(key, rows)| series(&key, &differing, rows, columns)).collect())
}

struct Row {
    key: Vec<String>,
    x: Option<f64>,
    y: f64,
    label: Option<String>,
}

/// Indices of the columns in a row.
struct ColumnIndices {
    x: usize,
    y: usize,
    series: Vec<usize>,
    label: Option<usize>,
    only: Vec<(usize, String)>,
}

impl ColumnIndices {
    fn find(columns: &Columns, header: &StringRecord) -> Result<Self, String> {
        let place = |name: &String| {
            header.iter().position(|column| column == name).ok_or_else(|| {
                let known: Vec<_> = header.iter().take(MAX_LISTED).map(quoted).collect();
                let more = if header.len() > MAX_LISTED { ", ..." } else { "" };
                format!("has no column \"{name}\", but {}{more}", known.join(", "))
            })
        };
        let only = columns.only.iter().map(|(name, text)| Ok((place(name)?, text.clone())));
        Ok(Self {
            x: place(&columns.x)?,
            y: place(&columns.y)?,
            series: columns.series.iter().map(place).collect::<Result<_, _>>()?,
            label: columns.label.as_ref().map(place).transpose()?,
            only: only.collect::<Result<_, String>>()?,
        })
    }
}

fn read_table(path: &Path, columns: &Columns, rows: &mut Vec<Row>) -> Result<(), String> {
    let text = read_within(path, MAX_BYTES).map_err(|error| error.to_string())?;
    let text = text.ok_or_else(|| format!("has more than {MAX_BYTES} bytes, the limit"))?;
    // A frame log that has reached its limit ends with a comment.
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(&text[..]);
    let places = ColumnIndices::find(columns, reader.headers().map_err(|error| error.to_string())?)?;
    for record in reader.records() {
        let record = record.map_err(|error| error.to_string())?;
        let text = |place: usize| record.get(place).unwrap_or_default().trim();
        if places.only.iter().any(|(place, wanted)| text(*place) != wanted) {
            continue;
        }
        let Some(y) = number(&record, places.y, &columns.y)? else { continue };
        if rows.len() == MAX_POINTS {
            return Err(format!("more than {MAX_POINTS} rows"));
        }
        rows.push(Row {
            key: places.series.iter().map(|place| text(*place).to_owned()).collect(),
            x: number(&record, places.x, &columns.x)?,
            y,
            label: places.label.map(|place| text(place).to_owned()).filter(|label| !label.is_empty()),
        });
    }
    Ok(())
}

/// Text of a table, escaped and shortened for messages.
fn quoted(text: &str) -> Cow<'_, str> {
    printable_within(text, MAX_QUOTED_BYTES)
}

/// A finite number; `None` where the field is empty.
fn number(record: &StringRecord, place: usize, column: &str) -> Result<Option<f64>, String> {
    let text = record.get(place).unwrap_or_default().trim();
    if text.is_empty() {
        return Ok(None);
    }
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(Some(number)),
        _ => {
            let line = record.position().map_or(0, csv::Position::line);
            Err(format!("line {line}: \"{}\" in column {column} is not a number", quoted(text)))
        }
    }
}

/// For each column of the series' names, whether series differ in it.
fn differing_columns(groups: &[(Vec<String>, Vec<Row>)]) -> Vec<bool> {
    let Some((first, _)) = groups.first() else { return Vec::new() };
    (0..first.len()).map(|column| groups.iter().any(|(key, _)| key[column] != first[column])).collect()
}

fn series(key: &[String], differing: &[bool], rows: Vec<Row>, columns: &Columns) -> Series {
    let words: Vec<&str> =
        key.iter().zip(differing).filter(|(_, differs)| **differs).map(|(word, _)| &**word).collect();
    let name = if words.is_empty() { key.join(" ") } else { words.join(" ") };
    let line = match columns.scatter {
        true => Line::None,
        false if columns.dashed.contains(&name) => Line::Dashed,
        false => Line::Solid,
    };
    let levels: Vec<f64> = rows.iter().filter(|row| row.x.is_none()).map(|row| row.y).collect();
    let points = if columns.scatter { each(rows) } else { medians(rows) };
    Series { name, line, points, level: median(levels) }
}

fn each(rows: Vec<Row>) -> Vec<Point> {
    let point = |row: Row| Some(Point { x: row.x?, y: row.y, spread: None, label: row.label });
    rows.into_iter().filter_map(point).collect()
}

/// A point for each x, in ascending order.
fn medians(rows: Vec<Row>) -> Vec<Point> {
    let mut by_x: BTreeMap<u64, Vec<Row>> = BTreeMap::new();
    for row in rows {
        if let Some(x) = row.x {
            by_x.entry((x + 0.0).to_bits()).or_default().push(row); // one zero
        }
    }
    let mut points: Vec<Point> = by_x.into_values().filter_map(median_point).collect();
    points.sort_by(|a, b| a.x.total_cmp(&b.x));
    points
}

fn median_point(rows: Vec<Row>) -> Option<Point> {
    let label = rows.iter().find_map(|row| row.label.clone());
    let x = rows.first()?.x?;
    let values: Vec<f64> = rows.into_iter().map(|row| row.y).collect();
    let (least, greatest) = values.iter().fold((f64::MAX, f64::MIN), |(l, g), y| (l.min(*y), g.max(*y)));
    let spread = (least < greatest).then_some((least, greatest));
    Some(Point { x, y: median(values)?, spread, label })
}

/// The median; of an even number of values, the mean of the middle two.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let above = *values.get(values.len() / 2)?;
    let below = *values.get((values.len() - 1) / 2)?;
    Some(f64::midpoint(below, above))
}
