//! `plot`: CSV tables as a plot.

use crate::app::cli::PlotArgs;
use crate::app::output::check_writable;
use crate::error::CommandError;
use crate::measure::plot::{Axis, Chart, Columns, PlotError, read_series};

/// Reads the tables and writes each output.
///
/// # Errors
/// Wrong tables or outputs; nothing to draw; a full disk.
pub(super) fn run(args: &PlotArgs) -> Result<(), CommandError> {
    args.output.iter().try_for_each(|path| check_writable(path))?;
    let chart = chart(args).map_err(CommandError::wrong_input)?;
    args.output.iter().try_for_each(|path| chart.save(path)).map_err(|error| match error {
        PlotError::Output { .. } => CommandError::failed(error),
        PlotError::Table { .. } | PlotError::Chart(_) => CommandError::wrong_input(error),
    })
}

fn chart(args: &PlotArgs) -> Result<Chart, PlotError> {
    let columns = Columns {
        x: args.x.clone(),
        y: args.y.clone(),
        series: args.series.clone(),
        label: args.label.clone(),
        only: args.only.clone(),
        scatter: args.scatter,
        dashed: args.dashed.clone(),
    };
    let axis = |label: &Option<String>, column: &String, logarithmic, from_zero| Axis {
        label: label.as_ref().unwrap_or(column).clone(),
        logarithmic,
        from_zero,
    };
    Ok(Chart {
        title: args.title.clone(),
        x: axis(&args.x_label, &args.x, args.log_x, false),
        y: axis(&args.y_label, &args.y, args.log_y, args.from_zero),
        series: read_series(&args.tables, &columns)?,
    })
}
