//! The options of `plot`.

use std::path::PathBuf;

use clap::Args;

use super::values::equation;

/// `plot`.
#[derive(Clone, Debug, Args)]
pub(crate) struct PlotArgs {
    /// Tables (.csv) whose first line names the columns; their rows count as those of one table.
    #[arg(required = true, value_name = "CSV")]
    pub(crate) tables: Vec<PathBuf>,
    /// The plot to write: .svg or .png; give it again for both.
    #[arg(short, long, value_name = "FILE", required = true)]
    pub(crate) output: Vec<PathBuf>,
    /// The column that goes to the right. Rows where it is empty are drawn as a level across the whole plot.
    #[arg(long, value_name = "COLUMN")]
    pub(crate) x: String,
    /// The column that goes upwards. Rows of one series with the same x are repeats: their median, least and greatest
    /// are shown.
    #[arg(long, value_name = "COLUMN")]
    pub(crate) y: String,
    /// Rows that agree in these columns are one series.
    #[arg(long, value_name = "COLUMN,...", value_delimiter = ',')]
    pub(crate) series: Vec<String>,
    /// The column whose text stands beside each point.
    #[arg(long, value_name = "COLUMN")]
    pub(crate) label: Option<String>,
    /// Only rows where that column has that text.
    #[arg(long = "where", value_name = "COLUMN=TEXT", value_parser = equation)]
    pub(crate) only: Vec<(String, String)>,
    /// Points without lines between them; each row is one.
    #[arg(long)]
    pub(crate) scatter: bool,
    /// A series, by its name in the legend, that is only there to compare with.
    #[arg(long, value_name = "SERIES")]
    pub(crate) dashed: Vec<String>,
    /// What stands above.
    #[arg(long, value_name = "TEXT", default_value = "")]
    pub(crate) title: String,
    /// What x is; without it, the column's name.
    #[arg(long, value_name = "TEXT")]
    pub(crate) x_label: Option<String>,
    /// What y is; without it, the column's name.
    #[arg(long, value_name = "TEXT")]
    pub(crate) y_label: Option<String>,
    /// Equal distances to the right are equal ratios.
    #[arg(long)]
    pub(crate) log_x: bool,
    /// Equal distances upwards are equal ratios.
    #[arg(long)]
    pub(crate) log_y: bool,
    /// Upwards from zero, however far the values are from it.
    #[arg(long, conflicts_with = "log_y")]
    pub(crate) from_zero: bool,
}
