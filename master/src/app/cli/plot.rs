//! Options of `plot`.

use std::path::PathBuf;

use clap::Args;

use super::values::equation;

/// Options of `plot`.
#[derive(Clone, Debug, Args)]
pub(crate) struct PlotArgs {
    /// Tables (.csv) whose first line names the columns; their rows are combined.
    #[arg(required = true, value_name = "CSV")]
    pub(crate) tables: Vec<PathBuf>,
    /// Plot to write: .svg or .png; repeat the option for both.
    #[arg(short, long, value_name = "FILE", required = true)]
    pub(crate) output: Vec<PathBuf>,
    /// Column of x. Rows where it is empty are drawn as a horizontal line across the plot.
    #[arg(long, value_name = "COLUMN")]
    pub(crate) x: String,
    /// Column of y. Rows of one series with the same x are repeats: median, minimum and maximum are drawn.
    #[arg(long, value_name = "COLUMN")]
    pub(crate) y: String,
    /// Columns whose values distinguish the series.
    #[arg(long, value_name = "COLUMN,...", value_delimiter = ',')]
    pub(crate) series: Vec<String>,
    /// Column with a label for each point.
    #[arg(long, value_name = "COLUMN")]
    pub(crate) label: Option<String>,
    /// Use only rows in which this column has this text.
    #[arg(long = "where", value_name = "COLUMN=TEXT", value_parser = equation)]
    pub(crate) only: Vec<(String, String)>,
    /// Draw each row as a point, without lines.
    #[arg(long)]
    pub(crate) scatter: bool,
    /// Draw a series dashed, by its name in the legend, as a baseline.
    #[arg(long, value_name = "SERIES")]
    pub(crate) dashed: Vec<String>,
    /// Title above the plot.
    #[arg(long, value_name = "TEXT", default_value = "")]
    pub(crate) title: String,
    /// Label of x; without it, the name of the column.
    #[arg(long, value_name = "TEXT")]
    pub(crate) x_label: Option<String>,
    /// Label of y; without it, the name of the column.
    #[arg(long, value_name = "TEXT")]
    pub(crate) y_label: Option<String>,
    /// Logarithmic x.
    #[arg(long)]
    pub(crate) log_x: bool,
    /// Logarithmic y.
    #[arg(long)]
    pub(crate) log_y: bool,
    /// Begin y at zero.
    #[arg(long, conflicts_with = "log_y")]
    pub(crate) from_zero: bool,
}
