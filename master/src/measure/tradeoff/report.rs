//! Reports of a measurement: the table as Markdown, the front as a plot.

use std::fmt::Write;

use serde::Serialize;

use super::oracle::ReferenceCheck;
use super::table::{Row, Table};
use crate::measure::plot::{Axis, Chart, Line, Point, Series};

/// Everything that a measurement found; `--json` prints it as one line.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Report {
    /// Times and errors.
    #[serde(flatten)]
    pub(crate) table: Table,
    /// Number of times that each setting was timed.
    pub(crate) repeats: u32,
    /// Samples per pixel of the reference.
    pub(crate) reference_samples: u32,
    /// Check of the reference, with the direct integrator.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) reference_check: Option<ReferenceCheck>,
    /// Settings on the front, from the fastest to the best.
    pub(crate) front: Vec<String>,
}

/// The sentence about the check of the reference.
fn checked(check: &ReferenceCheck) -> String {
    let ReferenceCheck { pixels, max_error, above_one_step } = check;
    format!(
        " {pixels} pixels of that reference were checked against the oracle in double precision: \
         {above_one_step} differ by more than a step of 1/255; the largest difference is {max_error}."
    )
}

/// The page in Markdown: method, then a line for each setting, the fastest first. Settings on the front are bold.
pub(crate) fn markdown(report: &Report) -> String {
    let Table { scene, width, height, threads, simd_level, rows } = &report.table;
    let noise = if noise_chart(report).is_some() { "![error against samples](noise.png)\n\n" } else { "" };
    let check = report.reference_check.as_ref().map_or_else(String::new, checked);
    let mut text = format!(
        "# Speed against accuracy: {scene}\n\n\
         {width} x {height} pixels, {threads} render thread{}, {simd_level}, rayfarm {}. Times are milliseconds per frame in one process, {} each, \
         settings in turn.\n\n\
         Errors are against full quality with {} samples a pixel.{check}\n\n\
         ![time against error](front.png)\n\n{noise}\
         | setting | ms, median | ms, least | largest error | RMSE | PSNR, dB | SSIM | FLIP, mean |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- |\n",
        if *threads == 1 { "" } else { "s" },
        env!("CARGO_PKG_VERSION"),
        if report.repeats == 1 { "once".to_owned() } else { format!("{} times", report.repeats) },
        report.reference_samples,
    );
    for row in by_time(rows) {
        text += &line(row, report.front.contains(&row.setting));
    }
    text += "\nBold: no other setting is both faster and nearer to the reference (by FLIP). A name links to the picture, its FLIP to the \
             error map: black is no error, pale yellow the largest possible one.\n";
    text
}

fn by_time(rows: &[Row]) -> Vec<&Row> {
    let mut rows: Vec<&Row> = rows.iter().collect();
    rows.sort_by(|a, b| a.median_ms.total_cmp(&b.median_ms));
    rows
}

fn line(row: &Row, on_front: bool) -> String {
    let Row { setting, median_ms, min_ms, max_error, rmse, psnr_db, ssim, flip } = row;
    let mark = if on_front { "**" } else { "" };
    let mut text = String::new();
    // Writing to a string does not fail.
    let _ = writeln!(
        text,
        "| {mark}[{setting}]({}){mark} | {median_ms:.2} | {min_ms:.2} | {max_error} | {rmse:.2} | {psnr_db:.1} | {ssim:.4} | [{flip:.4}]({}) |",
        picture_name(setting),
        difference_name(setting),
    );
    text
}

/// Name of the file with a setting's picture.
pub(crate) fn picture_name(setting: &str) -> String {
    format!("{setting}.png")
}

/// Name of the file with a setting's FLIP error map.
pub(crate) fn difference_name(setting: &str) -> String {
    format!("{setting}-flip.png")
}

/// The plot of time (horizontal) against FLIP (vertical): the front as a line, the other settings as points.
pub(crate) fn chart(report: &Report) -> Chart {
    let Table { scene, width, height, threads, rows, .. } = &report.table;
    let point =
        |row: &Row| Point { x: row.median_ms, y: row.flip, spread: None, label: Some(row.setting.clone()) };
    let on_front = |row: &&Row| report.front.contains(&row.setting);
    let ordered = by_time(rows);
    let front = ordered.iter().copied().filter(on_front).map(point).collect();
    let others: Vec<Point> = ordered.iter().copied().filter(|row| !on_front(row)).map(point).collect();
    let series = |name: &str, line, points| Series { name: name.to_owned(), line, points, level: None };
    let mut all = vec![series("worth having", Line::Solid, front)];
    if !others.is_empty() {
        all.push(series("others", Line::None, others));
    }
    Chart {
        title: format!(
            "{scene}, {width} x {height}, {threads} thread{}",
            if *threads == 1 { "" } else { "s" }
        ),
        x: Axis { label: "milliseconds per frame".to_owned(), logarithmic: true, from_zero: false },
        // Good settings are close to zero, where only ratios distinguish them; a logarithmic axis cannot show zero
        // itself.
        y: Axis {
            label: "mean FLIP against the reference".to_owned(),
            logarithmic: rows.iter().all(|row| row.flip > 0.0),
            from_zero: true,
        },
        series: all,
    }
}

/// Settings whose error is plotted against the number of samples, by the rest of their names.
const NOISE_SERIES: [(&str, &str); 3] = [("", "Sobol"), (INDEPENDENT, INDEPENDENT), ("denoised", "denoised")];
const INDEPENDENT: &str = "independent";

/// The plot of the number of samples (horizontal) against the RMSE (vertical), for pictures of paths: those that differ in their samples
/// alone. Independent samples follow the dashed line.
pub(crate) fn noise_chart(report: &Report) -> Option<Chart> {
    let Table { scene, width, height, rows, .. } = &report.table;
    let points = |kind: &str| {
        let of_row = |row: &Row| {
            let (samples, _) = samples_of(&row.setting).filter(|(_, rest)| *rest == kind)?;
            // A logarithmic axis cannot show zero.
            (row.rmse > 0.0).then_some(Point { x: samples.into(), y: row.rmse, spread: None, label: None })
        };
        let mut points: Vec<Point> = rows.iter().filter_map(of_row).collect();
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        points
    };
    let independent = points(INDEPENDENT);
    let (first, last) = (independent.first()?.clone(), independent.last()?.clone());
    let expected = Point { y: first.y * (first.x / last.x).sqrt(), ..last };
    let series = |name: &str, line, points| Series { name: name.to_owned(), line, points, level: None };
    let measured = NOISE_SERIES.map(|(kind, name)| series(name, Line::Solid, points(kind)));
    let mut all: Vec<Series> = measured.into_iter().filter(|series| !series.points.is_empty()).collect();
    all.push(series("1 / sqrt(samples)", Line::Dashed, vec![first, expected]));
    let logarithmic = |label: &str| Axis { label: label.to_owned(), logarithmic: true, from_zero: false };
    Some(Chart {
        title: format!("{scene}, {width} x {height}, against {} samples", report.reference_samples),
        x: logarithmic("samples per pixel"),
        y: logarithmic("RMSE in steps of 1/255"),
        series: all,
    })
}

/// The number of samples of a setting, and the rest of its name; `None` for names that begin with something else.
fn samples_of(setting: &str) -> Option<(u32, &str)> {
    let (samples, rest) = match setting.split_once('+') {
        Some(parts) => parts,
        None if setting.starts_with("samples-") => (setting, ""),
        None => ("samples-1", setting),
    };
    Some((samples.strip_prefix("samples-")?.parse().ok()?, rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report() -> Report {
        let row = |setting: &str, median_ms, flip| Row {
            setting: setting.to_owned(),
            median_ms,
            min_ms: 1.0,
            max_error: 200,
            rmse: 3.456,
            psnr_db: 37.25,
            ssim: 0.98765,
            flip,
        };
        let rows = vec![row("samples-4", 40.0, 0.01), row("samples-1", 10.0, 0.05), row("worse", 20.0, 0.06)];
        let table = Table {
            scene: "room.toml".into(),
            width: 64,
            height: 48,
            threads: 2,
            simd_level: "avx2".into(),
            rows,
        };
        let front = table.front().into_iter().map(|index| table.rows[index].setting.clone()).collect();
        let reference_check = ReferenceCheck { pixels: 12, max_error: 1, above_one_step: 0 };
        Report { table, repeats: 7, reference_samples: 256, reference_check: Some(reference_check), front }
    }

    #[test]
    fn a_reference_of_paths_has_no_check() {
        let text = markdown(&Report { reference_check: None, ..report() });
        assert!(text.contains("with 256 samples a pixel.\n\n") && !text.contains("oracle"), "{text}");
    }

    #[test]
    fn the_page_has_the_fastest_first_and_the_front_in_bold() {
        let text = markdown(&report());
        let order = [
            "| **[samples-1](samples-1.png)** | 10.00 |",
            "| [worse](worse.png) | 20.00 |",
            "| **[samples-4]",
        ];
        let places: Vec<usize> = order.iter().map(|part| text.find(part).unwrap()).collect();
        assert!(places.is_sorted(), "{text}");
        for part in
            ["64 x 48", "2 render threads", "avx2", "7 times", "256 samples", "12 pixels", "(worse-flip.png)"]
        {
            assert!(text.contains(part), "{part}: {text}");
        }
    }

    #[test]
    fn the_error_of_paths_is_plotted_against_their_samples() {
        let mut paths = report();
        assert_eq!(noise_chart(&paths), None, "no paths");
        let row =
            |setting: &str, rmse| Row { setting: setting.to_owned(), rmse, ..report().table.rows[0].clone() };
        paths.table.rows = vec![
            row("samples-16", 2.0),
            row("samples-1", 9.0),
            row("independent", 10.0),
            row("diffuse+no-shadows", 1.0),
            row("samples-16+depth-3", 1.0),
            row("samples-16+independent", 2.6),
            row("samples-16+denoised", 1.5),
            row("samples-4+denoised", 0.0),
        ];
        let chart = noise_chart(&paths).unwrap();
        let lines: Vec<(&str, Vec<(f64, f64)>)> = chart
            .series
            .iter()
            .map(|series| {
                (series.name.as_str(), series.points.iter().map(|point| (point.x, point.y)).collect())
            })
            .collect();
        assert_eq!(
            lines,
            [
                ("Sobol", vec![(1.0, 9.0), (16.0, 2.0)]),
                ("independent", vec![(1.0, 10.0), (16.0, 2.6)]),
                ("denoised", vec![(16.0, 1.5)]),
                ("1 / sqrt(samples)", vec![(1.0, 10.0), (16.0, 2.5)]),
            ]
        );
        assert!(markdown(&paths).contains("(noise.png)") && !markdown(&report()).contains("noise.png"));
    }

    #[test]
    fn the_plot_joins_the_front_and_labels_all_points() {
        let chart = chart(&report());
        let names = |index: usize| {
            chart.series[index].points.iter().map(|point| point.label.clone().unwrap()).collect::<Vec<_>>()
        };
        assert_eq!(
            (chart.series[0].line, names(0)),
            (Line::Solid, vec!["samples-1".into(), "samples-4".into()])
        );
        assert_eq!((chart.series[1].line, names(1)), (Line::None, vec!["worse".to_owned()]));
        assert!(chart.y.logarithmic);
        let mut exact = report();
        exact.table.rows[0].flip = 0.0;
        assert!(!super::chart(&exact).y.logarithmic, "zero has no logarithm");
    }
}
