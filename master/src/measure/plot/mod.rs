//! Plots of tables: columns become series, series become a picture.
//!
//! A [`Chart`] describes what to show, without pixels. [`table`] makes its series from CSV files, [`scale`] lays
//! out its axes, [`labels`] places text, and [`draw`] draws it with `plotters`. An SVG keeps text as text; a PNG
//! gets its letters from [`canvas`].

mod canvas;
mod draw;
mod labels;
mod scale;
mod table;

use std::path::{Path, PathBuf};

use plotters::backend::SVGBackend;
use rayfarm_tracer::files::write_whole;
use rayfarm_tracer::image;

use canvas::Canvas;

pub(crate) use table::{Columns, read_series};

/// Width and height of a plot in pixels.
const SIZE: (u32, u32) = (1200, 720);

/// Content of a plot.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Chart {
    /// Title; empty for none.
    pub(crate) title: String,
    /// Horizontal axis.
    pub(crate) x: Axis,
    /// Vertical axis.
    pub(crate) y: Axis,
    /// Series in the order of the legend.
    pub(crate) series: Vec<Series>,
}

/// Layout of one axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Axis {
    /// Quantity and unit.
    pub(crate) label: String,
    /// Whether the axis is logarithmic. Its values must be positive.
    pub(crate) logarithmic: bool,
    /// Whether a linear axis includes zero.
    pub(crate) from_zero: bool,
}

/// Points of one colour.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Series {
    /// Name in the legend.
    pub(crate) name: String,
    /// Lines between the points of the series.
    pub(crate) line: Line,
    /// Points in the order of the line.
    pub(crate) points: Vec<Point>,
    /// A value of y without an x, drawn across the whole width.
    pub(crate) level: Option<f64>,
}

/// Lines between the points of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Line {
    /// A solid line with marks.
    Solid,
    /// A dashed line without marks, as a baseline.
    Dashed,
    /// Marks without a line.
    None,
}

/// A point of a series.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Point {
    /// Horizontal value.
    pub(crate) x: f64,
    /// Vertical value.
    pub(crate) y: f64,
    /// Least and greatest y of repeated measurements.
    pub(crate) spread: Option<(f64, f64)>,
    /// Text at the point.
    pub(crate) label: Option<String>,
}

/// Error of reading, drawing or writing a plot.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PlotError {
    /// The table lacks a requested column or number.
    #[error("{path}: {problem}", path = .path.display())]
    Table {
        /// The table.
        path: PathBuf,
        /// Description, with the line where there is one.
        problem: String,
    },
    /// The chart cannot be drawn.
    #[error("{0}")]
    Chart(String),
    /// The picture cannot be written.
    #[error("{path}: {problem}", path = .path.display())]
    Output {
        /// The picture.
        path: PathBuf,
        /// The error of the system.
        problem: String,
    },
}

impl Chart {
    /// Writes the chart as `.svg` or `.png`, by the extension of `path`.
    ///
    /// # Errors
    /// No points; values that a logarithmic axis cannot show; another extension; a full disk.
    pub(crate) fn save(&self, path: &Path) -> Result<(), PlotError> {
        let refuse = |problem: String| PlotError::Output { path: path.to_owned(), problem };
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("svg") => {
                let text = self.to_svg()?;
                write_whole(path, text.as_bytes()).map_err(|error| refuse(error.to_string()))
            }
            Some("png") => {
                let picture = self.to_picture()?;
                image::save(path, &picture).map_err(|error| refuse(error.to_string()))
            }
            _ => Err(refuse("plots are written as .svg or .png; end the name with one of them".to_owned())),
        }
    }

    fn to_svg(&self) -> Result<String, PlotError> {
        let mut text = String::new();
        draw::draw(self, SVGBackend::with_string(&mut text, SIZE))?;
        Ok(text)
    }

    fn to_picture(&self) -> Result<image::RgbImage, PlotError> {
        let mut canvas = Canvas::new(SIZE);
        draw::draw(self, &mut canvas)?;
        Ok(canvas.into_picture())
    }
}

#[cfg(test)]
mod tests;
