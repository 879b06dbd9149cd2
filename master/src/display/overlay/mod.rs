//! Overlay of the picture: figures, panels, the list of keys, and messages.

use std::borrow::Cow;
use std::time::Duration;

use accounts::AccountPanel;
use legend::Entry;
use rayfarm_farm::BannedWorker;
use rayfarm_farm::Reachable;
use rayfarm_farm::accounting::duration_text;

use rayfarm_tracer::simd_level;

use super::canvas::{Canvas, GLYPH, Rect};
use super::numbers::{counted, three_digits};
use crate::viewer::film::FilmProgress;

pub(super) mod accounts;
mod kicked;
pub(super) mod legend;

/// Height of a line, in dots.
const LINE: usize = GLYPH + 3;
/// Distance between text and the edge of its panel, in dots.
const MARGIN: usize = 5;
/// Lines of a fault that are shown; the log has all of it.
const MAX_FAULT_LINES: usize = 8;
const WHITE: u32 = 0x00f4_f4f4;
const SOFT: u32 = 0x00c4_ccd4;

/// Keys of the window, and the effect of each.
const KEYS: [(&str, &str); 18] = [
    ("W A S D", "move"),
    ("Q E", "move down, up"),
    ("arrows", "look around"),
    (", .", "roll left, right"),
    ("drag", "orbit"),
    ("wheel", "nearer, farther"),
    ("+ -", "zoom (or page up, page down)"),
    ("R", "back to the start"),
    ("O", "hide the figures"),
    ("F", "workers and their time"),
    ("C", "colour by worker, by cost"),
    ("Tab", "select a worker"),
    ("P", "pause, resume (all or selected)"),
    ("L", "drain the selected worker"),
    ("K", "kick the selected worker"),
    ("B", "bring kicked and drained workers back"),
    ("H", "hide this list"),
    ("Esc", "end"),
];

/// Content of the overlay.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Overlay {
    pub(super) figures: Option<Figures>,
    /// Title, and the meaning of each colour.
    pub(super) legend: Option<(&'static str, Vec<Entry>)>,
    pub(super) accounts: Option<AccountPanel>,
    pub(super) help: bool,
    /// Message about a farm that renders nothing, in the middle of the window.
    pub(super) message: Option<Vec<String>>,
    /// Fault in the files of the scene, at the lower edge: the picture is of the scene before.
    pub(super) fault: Option<String>,
}

impl Overlay {
    /// Draws the overlay over the canvas.
    pub(super) fn draw(&self, canvas: &mut Canvas) {
        // Only the picture is darkened; panels come later.
        if self.message.is_some() {
            canvas.darken(Rect { x: 0, y: 0, width: canvas.width(), height: canvas.height() });
        }
        if let Some(figures) = &self.figures {
            draw_figures(canvas, figures);
        }
        if let Some((title, entries)) = &self.legend {
            legend::draw_legend(canvas, title, entries);
        }
        if let Some(accounts) = &self.accounts {
            accounts.draw(canvas);
        }
        if let Some(fault) = &self.fault {
            draw_fault(canvas, fault);
        }
        if self.help {
            draw_help(canvas);
        } else if let Some(message) = &self.message {
            draw_centred(canvas, message, 1);
        }
    }
}

/// Figures in the upper left corner.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Figures {
    /// Completed frames per second; `None` at rest, when no frame is requested.
    pub(super) fps: Option<f64>,
    /// Lowest and highest rate within the last second, by the times between frames, where known.
    pub(super) fps_range: Option<(f64, f64)>,
    /// Mean time of a frame.
    pub(super) frame_time: Duration,
    /// Time from an input to its picture on the screen, where known.
    pub(super) latency: Option<Duration>,
    /// Pixels per row and rows.
    pub(super) size: (u32, u32),
    /// Rays per pixel.
    pub(super) samples: u32,
    /// Progress of the picture, if it is rendered in passes.
    pub(super) film: Option<FilmProgress>,
    /// Lines of the quality controller.
    pub(super) quality: Vec<String>,
    /// Labels of all knobs that are not at full quality.
    pub(super) reductions: Vec<Cow<'static, str>>,
    /// Connected workers.
    pub(super) workers: usize,
    /// Render threads of all workers.
    pub(super) threads: u32,
    /// Triangles over all instances.
    pub(super) triangles: u64,
    /// Completed part of the frame in flight, 0..=1, where frames are slow.
    pub(super) progress: Option<f64>,
}

impl Figures {
    /// Lines of the overlay.
    fn lines(&self) -> Vec<String> {
        let mut lines = vec![self.speed()];
        if let Some((lowest, highest)) = self.fps_range.filter(|_| self.fps.is_some()) {
            lines.push(format!("{} to {} FPS", three_digits(lowest), three_digits(highest)));
        }
        let samples = match self.film {
            None if self.samples > 1 => format!(", {} samples", self.samples),
            _ => String::new(),
        };
        lines.push(format!("{} x {}{samples}", self.size.0, self.size.1));
        if let Some(film) = &self.film {
            lines.push(film.text());
            let left = film.left.filter(|_| !film.is_complete());
            lines.extend(left.map(|left| format!("{} left", duration_text(left))));
        }
        lines.extend(self.quality.iter().cloned());
        lines.extend(self.reductions.iter().map(ToString::to_string));
        lines.push(format!(
            "{}, {}",
            counted(self.workers as u64, "worker"),
            counted(self.threads.into(), "thread")
        ));
        lines.push(counted(self.triangles, "triangle"));
        if let Some(latency) = self.latency {
            lines.push(format!("latency {} ms", three_digits(latency.as_secs_f64() * 1e3)));
        }
        if let Some(progress) = self.progress {
            lines.push(format!("next frame: {:.0} %", progress.clamp(0.0, 1.0) * 100.0));
        }
        lines.push(format!("rayfarm {}, {}", env!("CARGO_PKG_VERSION"), simd_level()));
        lines.push("H: keys".to_owned());
        lines
    }

    /// Rate and frame time, also for the title of the window.
    pub(super) fn speed(&self) -> String {
        let frame_time = three_digits(self.frame_time.as_secs_f64() * 1e3);
        match self.fps {
            Some(fps) => format!("{} FPS  {frame_time} ms", three_digits(fps)),
            None => format!("at rest  {frame_time} ms"),
        }
    }
}

/// Draws the figures in the upper left corner.
fn draw_figures(canvas: &mut Canvas, figures: &Figures) {
    let lines = figures.lines();
    let panel = Panel::fit(canvas, &lines);
    let at = MARGIN * panel.scale;
    panel.draw(canvas, at, at, lines.len());
}

/// Draws the list of keys in the middle.
fn draw_help(canvas: &mut Canvas) {
    let widest = KEYS.iter().map(|(keys, _)| keys.len()).max().unwrap_or(0);
    let lines: Vec<String> = KEYS.iter().map(|(keys, what)| format!("{keys:widest$}  {what}")).collect();
    draw_centred(canvas, &lines, lines.len());
}

/// Message while no worker is connected. `problem` is the reason for which the local ones have ended.
pub(super) fn waiting_for_workers(
    reachable: &Reachable,
    local_workers: u32,
    problem: Option<&str>,
    kicked: &[BannedWorker],
) -> Vec<String> {
    let first = match (problem, local_workers) {
        (Some(problem), _) => format!("Waiting for a worker: {problem}."),
        (None, 0) => "Waiting for a worker.".to_owned(),
        (None, 1) => "Waiting for this machine's worker.".to_owned(),
        (None, n) => format!("Waiting for this machine's {n} workers."),
    };
    let mut lines = vec![first];
    lines.extend(kicked::remedies(kicked, problem.is_some() && local_workers > 0));
    lines.push(String::new());
    lines.extend(reachable.for_window());
    lines
}

/// Message while all workers are paused.
pub(super) fn all_paused() -> Vec<String> {
    vec!["All workers are paused.".to_owned(), String::new(), "P: resume".to_owned()]
}

/// Draws a fault in the files of the scene at the lower edge.
fn draw_fault(canvas: &mut Canvas, fault: &str) {
    let scale = Panel::suited_to(canvas.height());
    let columns = (canvas.width() / (GLYPH * scale)).saturating_sub(4).max(1);
    let mut lines = vec!["The scene has a fault and is shown as it was before:".to_owned()];
    lines.extend(fault.lines().flat_map(|line| broken(line, columns)).take(MAX_FAULT_LINES));
    let panel = Panel::fit(canvas, &lines);
    let x = canvas.width().saturating_sub(panel.width()) / 2;
    let y = canvas.height().saturating_sub(panel.height() + MARGIN * panel.scale);
    panel.draw(canvas, x, y, 1);
}

fn draw_centred(canvas: &mut Canvas, lines: &[String], bright: usize) {
    let panel = Panel::fit(canvas, lines);
    let x = canvas.width().saturating_sub(panel.width()) / 2;
    let y = canvas.height().saturating_sub(panel.height()) / 2;
    panel.draw(canvas, x, y, bright);
}

/// Lines of text on a dark rectangle, as large as the canvas allows.
struct Panel {
    lines: Vec<String>,
    scale: usize,
}

impl Panel {
    /// A panel with the largest text that fits and suits the canvas. Lines that are too long for the smallest text are broken.
    fn fit(canvas: &Canvas, lines: &[String]) -> Self {
        let suits = Self::suited_to(canvas.height());
        let panel = |scale| Self { lines: lines.to_vec(), scale };
        let fits = |panel: &Self| {
            panel.width() + 2 * MARGIN <= canvas.width() && panel.height() + 2 * MARGIN <= canvas.height()
        };
        (1..=suits).rev().map(panel).find(fits).unwrap_or_else(|| {
            let columns = (canvas.width().saturating_sub(4 * MARGIN) / GLYPH).max(1);
            Self { lines: lines.iter().flat_map(|line| broken(line, columns)).collect(), scale: 1 }
        })
    }

    /// Scale of text that suits a canvas of this height.
    fn suited_to(height: usize) -> usize {
        ((height + 225) / 450).clamp(1, 4)
    }

    fn width(&self) -> usize {
        let columns = self.lines.iter().map(|line| line.chars().count()).max().unwrap_or(0);
        (columns * GLYPH + 2 * MARGIN) * self.scale
    }

    fn height(&self) -> usize {
        (self.lines.len() * LINE + 2 * MARGIN - (LINE - GLYPH)) * self.scale
    }

    /// Draws the panel at (`x`, `y`); the first `bright` lines are brighter.
    fn draw(&self, canvas: &mut Canvas, x: usize, y: usize, bright: usize) {
        self.draw_in(canvas, x, y, |index| if index < bright { WHITE } else { SOFT });
    }

    /// Draws the panel at (`x`, `y`) with a colour for each line.
    fn draw_in(&self, canvas: &mut Canvas, x: usize, y: usize, color: impl Fn(usize) -> u32) {
        canvas.darken(Rect { x, y, width: self.width(), height: self.height() });
        for (index, line) in self.lines.iter().enumerate() {
            let (left, top) = (x + MARGIN * self.scale, y + (MARGIN + index * LINE) * self.scale);
            canvas.text(left, top, self.scale, color(index), line);
        }
    }
}

/// Breaks a line at spaces into pieces of at most `columns` characters; cuts longer words.
fn broken(line: &str, columns: usize) -> Vec<String> {
    let (mut pieces, mut piece) = (Vec::new(), String::new());
    for word in line.split(' ') {
        for part in word.chars().collect::<Vec<_>>().chunks(columns) {
            let needs = part.len() + usize::from(!piece.is_empty());
            if !piece.is_empty() && piece.chars().count() + needs > columns {
                pieces.push(std::mem::take(&mut piece));
            }
            if !piece.is_empty() {
                piece.push(' ');
            }
            piece.extend(part);
        }
    }
    pieces.push(piece);
    pieces
}

#[cfg(test)]
mod tests;
