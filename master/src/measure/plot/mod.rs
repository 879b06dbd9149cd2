//! Plots of measurements: a table becomes series, series become a picture.
//!
//! A [`Chart`] says what to show, and nothing about pixels. [`table`] makes its series from CSV files, [`scale`] lays its axes
//! out, [`labels`] finds room for text, [`draw`] draws it with `plotters`; an SVG keeps its text as text, a PNG gets its letters from [`canvas`].

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

/// Pixels of a plot, width and height.
const SIZE: (u32, u32) = (1200, 720);

/// What to show.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Chart {
    /// Above everything; empty for none.
    pub(crate) title: String,
    /// To the right.
    pub(crate) x: Axis,
    /// Upwards.
    pub(crate) y: Axis,
    /// In the order of the legend.
    pub(crate) series: Vec<Series>,
}

/// One direction.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Axis {
    /// What is measured, and in what unit.
    pub(crate) label: String,
    /// Equal distances are equal ratios. Values must be positive.
    pub(crate) logarithmic: bool,
    /// A linear axis shows zero, however far the values are from it.
    pub(crate) from_zero: bool,
}

/// What belongs together, in one colour.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Series {
    /// For the legend.
    pub(crate) name: String,
    /// How its points hang together.
    pub(crate) line: Line,
    /// In the order of the line.
    pub(crate) points: Vec<Point>,
    /// A value of y that belongs to no x: drawn across the whole width.
    pub(crate) level: Option<f64>,
}

/// How the points of a series hang together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Line {
    /// One line through all of them.
    Solid,
    /// A dashed line, without marks: something to compare with.
    Dashed,
    /// Not at all.
    None,
}

/// One mark.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Point {
    /// Where.
    pub(crate) x: f64,
    /// Where.
    pub(crate) y: f64,
    /// Least and greatest y of what was measured more than once.
    pub(crate) spread: Option<(f64, f64)>,
    /// Written beside it.
    pub(crate) label: Option<String>,
}

/// Why there is no plot.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PlotError {
    /// The table does not say what was asked for.
    #[error("{path}: {problem}", path = .path.display())]
    Table {
        /// The table.
        path: PathBuf,
        /// With the line, where there is one.
        problem: String,
    },
    /// What was asked for cannot be drawn.
    #[error("{0}")]
    Chart(String),
    /// The picture cannot be written.
    #[error("{path}: {problem}", path = .path.display())]
    Output {
        /// The picture.
        path: PathBuf,
        /// What the system says.
        problem: String,
    },
}

impl Chart {
    /// Writes the chart as `.svg` or `.png`, by the file's name.
    ///
    /// # Errors
    /// Nothing to draw, values that a logarithmic axis has no place for, another extension, a full disk.
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
