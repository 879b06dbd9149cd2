//! Contents of plots, read from the SVG's text and from the picture's pixels.

use std::path::PathBuf;

use proptest::prelude::*;

use super::scale::Scale;
use super::*;

const TABLE: &str = "\
policy,rows,repeat,fps,note
static,1,0,10,
static,1,1,14,
static,1,2,11,
static,4,0,20,best
smart,4,0,18,
smart,1,0,9,
adaptive,,0,22,
adaptive,,1,24,
smart,16,0,,
";

fn table(text: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("table.csv");
    std::fs::write(&path, text).unwrap();
    (folder, path)
}

fn columns() -> Columns {
    Columns {
        x: "rows".to_owned(),
        y: "fps".to_owned(),
        series: vec!["policy".to_owned()],
        ..Columns::default()
    }
}

fn read(text: &str, columns: &Columns) -> Result<Vec<Series>, String> {
    let (_folder, path) = table(text);
    read_series(&[path], columns).map_err(|error| error.to_string())
}

fn chart(series: Vec<Series>) -> Chart {
    let axis =
        |label: &str, logarithmic| Axis { label: label.to_owned(), logarithmic, from_zero: !logarithmic };
    Chart { title: "a title".to_owned(), x: axis("rows", true), y: axis("frames per second", false), series }
}

fn line_through(points: &[(f64, f64)]) -> Series {
    let point = |(x, y): &(f64, f64)| Point { x: *x, y: *y, spread: None, label: None };
    Series {
        name: "a series".to_owned(),
        line: Line::Solid,
        points: points.iter().map(point).collect(),
        level: None,
    }
}

#[test]
fn a_single_series_without_a_name_has_no_legend_and_more_room() {
    let named = chart(vec![line_through(&[(1.0, 10.0), (4.0, 20.0)])]);
    let mut nameless = named.clone();
    nameless.series[0].name.clear();
    let widths = [&named, &nameless].map(|chart| {
        let picture = chart.to_picture().unwrap();
        let blue = [0, 114, 178];
        let columns =
            (0..picture.width).filter(|&x| (0..picture.height).any(|y| picture.pixel(x, y) == Some(blue)));
        columns.collect::<Vec<_>>()
    });
    let [with_legend, without] = widths.map(|columns| *columns.last().unwrap());
    // With a legend, its mark is the last pixel of that colour, far to the right of the last point.
    assert!(without > 1100, "the curve itself goes up to {without} of 1200 pixels");
    let svgs = [&named, &nameless].map(|chart| chart.to_svg().unwrap());
    assert!(svgs[0].contains("a series") && !svgs[1].contains("a series"));
    let marks = |svg: &str| svg.matches("<circle").count();
    assert_eq!(marks(&svgs[0]), marks(&svgs[1]) + 1, "no mark without a name; {with_legend}");
}

#[test]
fn repeats_become_a_median_with_spread_and_rows_without_x_a_level() {
    let series = read(TABLE, &columns()).unwrap();
    assert_eq!(
        series.iter().map(|series| &*series.name).collect::<Vec<_>>(),
        ["static", "smart", "adaptive"]
    );
    let points =
        |index: usize| series[index].points.iter().map(|point| (point.x, point.y)).collect::<Vec<_>>();
    assert_eq!((points(0), points(1)), (vec![(1.0, 11.0), (4.0, 20.0)], vec![(1.0, 9.0), (4.0, 18.0)]));
    assert_eq!(series[0].points[0].spread, Some((10.0, 14.0)));
    assert_eq!((series[0].level, series[2].level), (None, Some(23.0)));
    assert!(series[2].points.is_empty());
}

#[test]
fn columns_choose_rows_marks_and_names() {
    let series = |columns: &Columns| read(TABLE, columns).unwrap();
    let only = vec![("rows".to_owned(), "4".to_owned())];
    let scatter = Columns { scatter: true, label: Some("note".to_owned()), only, ..columns() };
    let found = series(&scatter);
    assert_eq!(found.len(), 2);
    assert_eq!((found[0].line, found[0].points[0].label.as_deref()), (Line::None, Some("best")));
    let scatter = Columns { scatter: true, ..columns() };
    assert_eq!(series(&scatter)[0].points.len(), 4, "each row is a point");
    let both = ["repeat".to_owned(), "policy".to_owned()].to_vec();
    assert_eq!(series(&Columns { series: both.clone(), ..columns() })[0].name, "0 static");
    let only = vec![("repeat".to_owned(), "0".to_owned())];
    let dashed = vec!["smart".to_owned()];
    let found = series(&Columns { series: both, only, dashed, ..columns() });
    assert_eq!(
        (&*found[1].name, found[1].line),
        ("smart", Line::Dashed),
        "a column without differences is not in the name"
    );
}

#[test]
fn wrong_tables_are_refused_with_the_line() {
    let refusal = |text: &str| read(text, &columns()).unwrap_err();
    assert!(refusal("policy,rows\n").contains("no column \"fps\", but policy, rows"));
    assert!(refusal("policy,rows,fps\na,1,2\na,one,2\n").contains("line 3: \"one\" in column rows"));
    assert!(refusal("policy,rows,fps\na,1,NaN\n").contains("line 2"));
    assert!(refusal("policy,rows,fps\na,1\n").contains("line: 2"));
    let many: String = (0..25).map(|index| format!("{index},1,2\n")).collect();
    assert!(refusal(&format!("policy,rows,fps\n{many}")).contains("24"));
    let missing = read_series(&[PathBuf::from("nowhere.csv")], &columns()).unwrap_err().to_string();
    assert!(missing.starts_with("nowhere.csv: "), "{missing}");
}

#[test]
fn values_outside_an_axis_are_refused() {
    let refusal = |chart: &Chart| chart.to_svg().unwrap_err().to_string();
    assert!(refusal(&chart(Vec::new())).contains("nothing to plot"));
    assert!(
        refusal(&chart(vec![line_through(&[(0.0, 1.0)])]))
            .contains("0 cannot be shown on the logarithmic axis")
    );
    assert!(refusal(&chart(vec![line_through(&[(1.0, f64::INFINITY)])])).contains("inf cannot be shown"));
}

#[test]
fn an_svg_keeps_text_as_text() {
    let svg = chart(read(TABLE, &columns()).unwrap()).to_svg().unwrap();
    for text in ["a title", "rows", "frames per second", "static", "smart", "adaptive", "\n25\n", "\n4\n"] {
        assert!(svg.contains(text), "no {text:?} in {svg}");
    }
    assert!(svg.trim_end().ends_with("</svg>"));
}

#[test]
fn svg_and_png_are_written_and_no_other_format() {
    let chart = chart(vec![line_through(&[(1.0, 2.0), (8.0, 3.0)])]);
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.svg", "a.png"] {
        chart.save(&folder.path().join(name)).unwrap();
    }
    let picture = image::load(&folder.path().join("a.png")).unwrap();
    assert_eq!((picture.width, picture.height), SIZE);
    let refusal = chart.save(&folder.path().join("a.gif")).unwrap_err().to_string();
    assert!(refusal.contains(".svg or .png"), "{refusal}");
    assert!(chart.save(&folder.path().join("missing/a.svg")).is_err());
}

/// Bounding box of the pixels of that colour; `None` if there are none.
fn extent(picture: &image::RgbImage, color: [u8; 3]) -> Option<[usize; 4]> {
    let width = picture.width as usize;
    let found = picture.pixels.chunks_exact(3).enumerate().filter(|(_, pixel)| **pixel == color);
    found.map(|(index, _)| (index % width, index / width)).fold(None, |extent, (x, y)| {
        let [left, top, right, bottom] = extent.unwrap_or([x, y, x, y]);
        Some([left.min(x), top.min(y), right.max(x), bottom.max(y)])
    })
}

#[test]
fn greater_values_are_higher_and_text_is_drawn() {
    let mut both = vec![line_through(&[(1.0, 1.0), (8.0, 1.0)]), line_through(&[(1.0, 9.0), (8.0, 9.0)])];
    for series in &mut both {
        series.name.clear(); // the legend would have the colours as well
        series.points.iter_mut().for_each(|point| point.label = None);
    }
    let picture = chart(both).to_picture().unwrap();
    let plane_only = image::RgbImage {
        pixels: picture
            .pixels
            .chunks_exact(3)
            .enumerate()
            .flat_map(|(index, pixel)| {
                let legend = index % picture.width as usize > 1100;
                if legend { [255; 3] } else { [pixel[0], pixel[1], pixel[2]] }
            })
            .collect(),
        ..picture
    };
    let [low, high] = [[0, 114, 178], [213, 94, 0]].map(|color| extent(&plane_only, color).unwrap());
    assert!(high[3] < low[1], "the box {high:?} is not above {low:?}");
    assert!(extent(&plane_only, [0; 3]).unwrap()[1] < 40, "the title is missing");
}

proptest! {
    #[test]
    fn axes_contain_all_values_and_have_ticks(
        values in prop::collection::vec(1e-6..1e9_f64, 1..20),
        logarithmic: bool,
        from_zero: bool,
    ) {
        let axis = Axis { label: String::new(), logarithmic, from_zero };
        let scale = Scale::of(&axis, values.iter().copied()).unwrap();
        prop_assert!(scale.low < scale.high);
        for value in values {
            let pixel = plotters::coord::ranged1d::Ranged::map(&scale, &value, (0, 1000));
            prop_assert!((0..=1000).contains(&pixel), "{value} is at {pixel}");
        }
        prop_assert!(scale.ticks.len() < 30);
        prop_assert!(scale.ticks.windows(2).all(|pair| pair[0] < pair[1]));
        if !logarithmic {
            prop_assert!((2..=12).contains(&scale.ticks.len()), "{:?}", scale.ticks);
            let texts: std::collections::BTreeSet<_> = scale.ticks.iter().map(|tick| scale.tick_text(*tick)).collect();
            prop_assert_eq!(texts.len(), scale.ticks.len());
        }
    }
}

#[test]
fn ticks_are_round() {
    let texts = |logarithmic, values: &[f64]| {
        // From zero where the first value is a fraction.
        let axis = Axis { label: String::new(), logarithmic, from_zero: values[0].fract() != 0.0 };
        let scale = Scale::of(&axis, values.iter().copied()).unwrap();
        scale.ticks.iter().map(|tick| scale.tick_text(*tick)).collect::<Vec<_>>()
    };
    assert_eq!(texts(false, &[1.0, 2.0]), ["1", "2"], "whole numbers have no fractional ticks");
    assert_eq!(texts(false, &[0.0, 499.0]), ["0", "100", "200", "300", "400", "500"]);
    assert_eq!(texts(false, &[7.0]), ["4", "5", "6", "7", "8", "9", "10"]);
    assert_eq!(texts(false, &[3.5, 97.0]), ["0", "20", "40", "60", "80", "100"]);
    assert_eq!(texts(false, &[0.7]), ["0", "0.1", "0.2", "0.3", "0.4", "0.5", "0.6", "0.7"]);
    assert_eq!(texts(true, &[1.0, 256.0]), ["1", "2", "4", "8", "16", "32", "64", "128", "256"]);
    assert_eq!(texts(true, &[1.0, 1024.0]).last().unwrap(), "1,024");
    assert_eq!(texts(true, &[0.001, 100.0]), ["0.001", "0.01", "0.1", "1", "10", "100"]);
    assert_eq!(texts(false, &[1_500_000.5])[1], "500,000");
}
