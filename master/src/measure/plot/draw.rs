//! Drawing of a chart with `plotters`: title, axes, series, legend.

use std::fmt::Display;

use plotters::coord::Shift;
use plotters::coord::cartesian::Cartesian2d;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::labels::{self, Drawn, Label};
use super::scale::Scale;
use super::{Chart, Line, PlotError, Series};

/// Colours that colour-blind readers can distinguish (Okabe and Ito, "Color Universal Design", 2008), without the
/// yellow, which is faint on white.
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(90, 90, 90),
];
/// Colour of the lines from points to labels that are farther away.
const LEADER: RGBColor = RGBColor(150, 150, 150);
const GRID: RGBColor = RGBColor(225, 225, 225);
/// Text sizes in units of `plotters`.
const TITLE: f64 = 28.0;
const LABEL: f64 = 22.0;
const SMALL: f64 = 18.0;
/// Height of a label in pixels.
const LABEL_HEIGHT: i32 = 20;
/// Width of a letter of the legend and of labels, in pixels.
const LETTER: usize = 11;
/// Height of a line of the legend, and width of its mark, in pixels.
const LEGEND_LINE: i32 = 28;
const LEGEND_MARK: i32 = 44;
/// Pixels to the right of a plot without a legend: room for half of the last tick's number.
const RIGHT: u32 = 24;
/// Series with more points are drawn without marks, which would hide the line.
const MAX_MARKS: usize = 80;

type Area<B> = DrawingArea<B, Shift>;
pub(super) type Pixel = (i32, i32);
type Plane = Cartesian2d<Scale, Scale>;

/// Draws a chart.
///
/// # Errors
/// No points; values that an axis cannot show; an error of the backend.
pub(super) fn draw<B: DrawingBackend>(chart: &Chart, backend: B) -> Result<(), PlotError> {
    let x = Scale::of(&chart.x, values(chart, |series| series.points.iter().map(|point| point.x).collect()))?;
    let y = Scale::of(&chart.y, values(chart, heights))?;
    let root = backend.into_drawing_area();
    root.fill(&WHITE).map_err(failed)?;
    let root = if chart.title.is_empty() {
        root
    } else {
        root.titled(&chart.title, (FontFamily::SansSerif, TITLE)).map_err(failed)?
    };
    let (width, _) = root.dim_in_pixel();
    // A single series without a name needs no legend.
    let has_legend = chart.series.iter().any(|series| !series.name.is_empty());
    let legend_pixels = if has_legend { legend_width(chart) } else { RIGHT };
    let (area, legend_area) = root.split_horizontally(width.saturating_sub(legend_pixels));
    let mut builder = ChartBuilder::on(&area);
    builder.margin(14).x_label_area_size(66).y_label_area_size(96);
    let mut context = builder.build_cartesian_2d(x.clone(), y.clone()).map_err(failed)?;
    context
        .configure_mesh()
        .bold_line_style(GRID)
        .axis_style(BLACK)
        .label_style((FontFamily::SansSerif, SMALL))
        .axis_desc_style((FontFamily::SansSerif, LABEL))
        .x_desc(&chart.x.label)
        .y_desc(&chart.y.label)
        .draw()
        .map_err(failed)?;
    let pen = |index| Pen { plane: context.plotting_area(), x: &x, y: &y, look: Look::of(index) };
    for (index, series) in chart.series.iter().enumerate() {
        pen(index).draw(series)?;
    }
    pen(0).draw_labels(&chart.series)?;
    if has_legend {
        legend(chart, &legend_area)?;
    }
    root.present().map_err(failed)
}

fn failed(error: impl Display) -> PlotError {
    PlotError::Chart(format!("the plot cannot be drawn: {error}"))
}

fn values(chart: &Chart, of: impl Fn(&Series) -> Vec<f64>) -> Vec<f64> {
    chart.series.iter().flat_map(of).collect()
}

fn heights(series: &Series) -> Vec<f64> {
    let points = series.points.iter();
    let all =
        points.flat_map(|point| point.spread.map_or([point.y; 2], |(least, greatest)| [least, greatest]));
    all.chain(series.level).collect()
}

fn legend_width(chart: &Chart) -> u32 {
    let longest = chart.series.iter().map(|series| series.name.chars().count()).max().unwrap_or(0);
    (LEGEND_MARK as usize + 24 + longest.min(40) * LETTER) as u32
}

/// Colour and mark of a series, by its index. All pairs are used before one repeats.
#[derive(Clone, Copy)]
struct Look {
    color: RGBColor,
    mark: Mark,
}

#[derive(Clone, Copy)]
enum Mark {
    Disc,
    Square,
    Triangle,
    Ring,
    Diamond,
}

impl Look {
    fn of(index: usize) -> Self {
        const MARKS: [Mark; 5] = [Mark::Disc, Mark::Square, Mark::Triangle, Mark::Diamond, Mark::Ring];
        Self { color: COLORS[index % COLORS.len()], mark: MARKS[index % MARKS.len()] }
    }

    fn stroke(self) -> ShapeStyle {
        self.color.stroke_width(2)
    }

    /// Draws the mark at a pixel.
    fn draw_mark<B: DrawingBackend>(self, area: &Area<B>, at: Pixel) -> Result<(), PlotError> {
        let around =
            |corners: &[Pixel]| corners.iter().map(|(x, y)| (at.0 + x, at.1 + y)).collect::<Vec<_>>();
        let polygon = |corners: &[Pixel]| area.draw(&Polygon::new(around(corners), self.color.filled()));
        let drawn = match self.mark {
            Mark::Disc => area.draw(&Circle::new(at, 5, self.color.filled())),
            Mark::Ring => area
                .draw(&Circle::new(at, 5, WHITE.filled()))
                .and_then(|()| area.draw(&Circle::new(at, 5, self.stroke()))),
            Mark::Square => polygon(&[(-4, -4), (4, -4), (4, 4), (-4, 4)]),
            Mark::Triangle => polygon(&[(0, -6), (6, 5), (-6, 5)]),
            Mark::Diamond => polygon(&[(0, -7), (7, 0), (0, 7), (-7, 0)]),
        };
        drawn.map_err(failed)
    }
}

/// Draws one series.
struct Pen<'a, B: DrawingBackend> {
    plane: &'a DrawingArea<B, Plane>,
    x: &'a Scale,
    y: &'a Scale,
    look: Look,
}

impl<B: DrawingBackend> Pen<'_, B> {
    fn draw(&self, series: &Series) -> Result<(), PlotError> {
        let area = self.plane.use_screen_coord();
        let pixels: Vec<Pixel> = series.points.iter().map(|point| self.pixel(point.x, point.y)).collect();
        if let Some(level) = series.level {
            let y = self.height(level);
            let ends = vec![(self.left(), y), (self.right(), y)];
            area.draw(&DashedPathElement::new(ends, 14, 5, self.look.stroke())).map_err(failed)?;
        }
        draw_line(&area, series.line, &pixels, self.look.stroke())?;
        let marked = match series.line {
            Line::None => true,
            Line::Solid => series.points.len() <= MAX_MARKS,
            Line::Dashed => false,
        };
        for (point, at) in series.points.iter().zip(pixels) {
            if let Some((least, greatest)) = point.spread {
                self.draw_spread(&area, at.0, self.height(least), self.height(greatest))?;
            }
            if marked {
                self.look.draw_mark(&area, at)?;
            }
        }
        Ok(())
    }

    fn pixel(&self, x: f64, y: f64) -> Pixel {
        self.plane.map_coordinate(&(x, y))
    }

    fn height(&self, y: f64) -> i32 {
        self.plane.map_coordinate(&(self.x.low, y)).1
    }

    fn left(&self) -> i32 {
        self.plane.map_coordinate(&(self.x.low, self.y.low)).0
    }

    fn right(&self) -> i32 {
        self.plane.map_coordinate(&(self.x.high, self.y.low)).0
    }

    fn draw_spread(&self, area: &Area<B>, x: i32, bottom: i32, top: i32) -> Result<(), PlotError> {
        let style = self.look.color.stroke_width(1);
        for ends in
            [[(x, bottom), (x, top)], [(x - 4, bottom), (x + 4, bottom)], [(x - 4, top), (x + 4, top)]]
        {
            area.draw(&PathElement::new(ends, style)).map_err(failed)?;
        }
        Ok(())
    }

    /// Draws the labels of points, last, so that they avoid everything else.
    fn draw_labels(&self, all: &[Series]) -> Result<(), PlotError> {
        let area = self.plane.use_screen_coord();
        let (mut drawn, mut texts, mut wanted) = (Drawn::default(), Vec::new(), Vec::new());
        for series in all {
            let pixels: Vec<Pixel> = series.points.iter().map(|point| self.pixel(point.x, point.y)).collect();
            for (point, at) in series.points.iter().zip(&pixels) {
                let Some(text) = &point.label else { continue };
                let width = (text.chars().count() * LETTER) as i32;
                wanted.push(Label { at: *at, width, height: LABEL_HEIGHT });
                texts.push(text);
            }
            if series.line != Line::None {
                drawn.lines.extend(pixels.windows(2).map(|ends| [ends[0], ends[1]]));
            }
            drawn.marks.extend(pixels);
        }
        if wanted.is_empty() {
            return Ok(());
        }
        let (low, high) = (self.pixel(self.x.low, self.y.low), self.pixel(self.x.high, self.y.high));
        let room = labels::Area { left: low.0, top: high.1, right: high.0, bottom: low.1 };
        let places = labels::place(&wanted, &drawn, room);
        for ((text, label), place) in texts.into_iter().zip(&wanted).zip(places) {
            draw_label(&area, text, label.at, place)?;
        }
        Ok(())
    }
}

fn draw_label<B: DrawingBackend>(
    area: &Area<B>,
    text: &str,
    at: Pixel,
    place: labels::Area,
) -> Result<(), PlotError> {
    if place.is_away_from(at) {
        area.draw(&PathElement::new([at, place.nearest_to(at)], LEADER.stroke_width(1))).map_err(failed)?;
    }
    // At the side of its point, text begins or ends at the label's edge, whatever the width of the font.
    let (x, side) = if place.right <= at.0 { (place.right, HPos::Right) } else { (place.left, HPos::Left) };
    let style = (FontFamily::SansSerif, SMALL).into_text_style(area).pos(Pos::new(side, VPos::Bottom));
    area.draw(&Text::new(text.to_owned(), (x, place.bottom), style)).map_err(failed)
}

fn draw_line<B: DrawingBackend>(
    area: &Area<B>,
    line: Line,
    pixels: &[Pixel],
    style: ShapeStyle,
) -> Result<(), PlotError> {
    let drawn = match line {
        Line::None => Ok(()),
        Line::Solid => area.draw(&PathElement::new(pixels, style)),
        Line::Dashed => area.draw(&DashedPathElement::new(pixels.to_vec(), 10, 7, style)),
    };
    drawn.map_err(failed)
}

/// Draws the names in a column at the right of the plot.
fn legend<B: DrawingBackend>(chart: &Chart, area: &Area<B>) -> Result<(), PlotError> {
    let style = (FontFamily::SansSerif, SMALL).into_text_style(area).pos(Pos::new(HPos::Left, VPos::Center));
    for (index, series) in chart.series.iter().enumerate() {
        let look = Look::of(index);
        let y = 28 + index as i32 * LEGEND_LINE;
        let ends = [(0, y), (LEGEND_MARK - 12, y)];
        let level_only = series.points.is_empty();
        draw_line(area, if level_only { Line::Dashed } else { series.line }, &ends, look.stroke())?;
        if series.line != Line::Dashed && !level_only {
            look.draw_mark(area, ((LEGEND_MARK - 12) / 2, y))?;
        }
        area.draw(&Text::new(series.name.clone(), (LEGEND_MARK, y), style.clone())).map_err(failed)?;
    }
    Ok(())
}
