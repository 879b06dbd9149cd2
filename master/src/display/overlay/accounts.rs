//! Panel of workers: the use of each worker's time, and the selected worker.

use rayfarm_farm::accounting::{Fading, PART_COUNT, Smoothed};
use rayfarm_farm::{FarmStatus, Verification, WorkerState};

use super::{GLYPH, LINE, MARGIN, Panel, SOFT, WHITE, kicked};
use crate::display::canvas::Canvas;
use crate::display::numbers::grouped;

/// Names of the parts of thread time, from wide to narrow layouts.
const WORDS: [&str; PART_COUNT] = ["trace", "wait", "encode", "send", "decode", "tail", "scene"];
const SHORT: [&str; PART_COUNT] = ["trc", "wait", "enc", "send", "dec", "tail", "scn"];
const SHORTEST: [&str; PART_COUNT] = ["trc", "wai", "enc", "snd", "dec", "tai", "scn"];
const HINT: &str = "% of thread time  Tab select  P pause  L drain  K kick";
const SHORT_HINT: &str = "Tab P L K: see H";
/// Width of the column of names, in characters.
const NAMES: std::ops::RangeInclusive<usize> = 8..=24;

/// Widths of the columns, in characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Layout {
    name: usize,
    part: usize,
    /// Decimals of a percentage.
    digits: usize,
    words: [&'static str; PART_COUNT],
    /// Widths of the columns of rows per second and kilobytes per frame, where they are shown.
    figures: Option<(usize, usize)>,
    hint: &'static str,
}

/// Layouts from the widest to the narrowest.
const LAYOUTS: [Layout; 3] = [
    Layout { name: 8, part: 7, digits: 1, words: WORDS, figures: Some((11, 11)), hint: HINT },
    Layout { name: 8, part: 5, digits: 0, words: SHORT, figures: Some((8, 7)), hint: HINT },
    Layout { name: 8, part: 4, digits: 0, words: SHORTEST, figures: None, hint: SHORT_HINT },
];

impl Layout {
    /// The widest layout that fits, with as much of the names as fits.
    fn of(columns: usize) -> Self {
        let [.., narrowest] = LAYOUTS;
        let layout = LAYOUTS.into_iter().find(|layout| layout.columns() <= columns).unwrap_or(narrowest);
        let spare = columns.saturating_sub(layout.columns());
        Self { name: (NAMES.start() + spare).min(*NAMES.end()), ..layout }
    }

    /// Layout and text scale for a window of this size: the largest text with which speeds and bytes fit.
    fn fit((width, height): (usize, usize)) -> (Self, usize) {
        let columns = |scale: usize| (width / (GLYPH * scale)).saturating_sub(2);
        let [_, medium, _] = LAYOUTS;
        let roomy = |scale: &usize| columns(*scale) >= medium.columns();
        let scale = (1..=Panel::suited_to(height)).rev().find(roomy).unwrap_or(1);
        (Self::of(columns(scale)), scale)
    }

    fn columns(&self) -> usize {
        let figures = self.figures.map_or(0, |(speed, bytes)| speed + bytes);
        (2 + self.name + self.part * PART_COUNT + figures).max(self.hint.len())
    }

    fn header(&self) -> String {
        let words: String =
            self.words.iter().map(|word| format!("{word:>width$}", width = self.part)).collect();
        let figures = self.figures.map(|(speed, bytes)| format!("{:>speed$}{:>bytes$}", "rows/s", "KB/fr"));
        format!("  {:name$}{words}{}", "worker", figures.unwrap_or_default(), name = self.name)
    }

    /// Line of a worker. `state` replaces the percentages of a worker that does not render; dashes replace unknown ones.
    fn line(
        &self,
        mark: char,
        name: &str,
        account: Option<Smoothed>,
        state: Option<WorkerState>,
        speed: f64,
    ) -> String {
        let Self { part: width, digits, .. } = *self;
        let name: String = name.chars().take(self.name).collect();
        let parts: String = match (account, state) {
            (_, Some(state)) => format!("  {:<rest$}", state.to_string(), rest = width * PART_COUNT - 2),
            (Some(Smoothed { percent, .. }), None) => {
                percent.iter().map(|part| format!("{part:>width$.digits$}")).collect()
            }
            (None, None) => format!("{:>width$}", "-").repeat(PART_COUNT),
        };
        let bytes = account.map_or(0.0, |account| account.bytes);
        let rounded = |value: f64| grouped(value.round() as u64);
        let figures = self
            .figures
            .map(|(s, b)| format!("{:>s$}{:>b$}", rounded(speed), rounded(bytes / 1e3)))
            .unwrap_or_default();
        format!("{mark} {name:name_width$}{parts}{figures}", name_width = self.name)
    }
}

/// Lines of the panel, each with its colour: a header, the workers that fit (with the selected one), their sum, and hints.
fn lines(
    layout: &Layout,
    status: &FarmStatus,
    accounts: &Fading,
    selected: Option<u64>,
    room: usize,
) -> Vec<(String, u32)> {
    let workers = &status.workers;
    let mut lines = vec![(layout.header(), SOFT)];
    let below = 4 + usize::from(status.verification.is_some()) + usize::from(!status.banned.is_empty());
    let visible = room.saturating_sub(below).clamp(1, workers.len().max(1));
    let place = workers.iter().position(|worker| Some(worker.id) == selected).unwrap_or(0);
    let first = place.saturating_sub(visible - 1);
    for worker in workers.iter().skip(first).take(visible) {
        let mark = if Some(worker.id) == selected { '>' } else { ' ' };
        let (state, color) = match worker.state {
            WorkerState::Working => (None, WHITE),
            state => (Some(state), SOFT),
        };
        let name = format!("{} {}", worker.id, worker.name);
        let account = accounts.of(worker.id).filter(|_| worker.state != WorkerState::Paused);
        lines.push((layout.line(mark, &name, account, state, worker.speed), color));
    }
    if workers.len() > visible {
        lines.push((format!("  ... {} more", workers.len() - visible), SOFT));
    }
    if workers.len() > 1 {
        let speed = workers.iter().map(|worker| worker.speed).sum();
        lines.push((layout.line(' ', "all", accounts.sum(), None, speed), WHITE));
    }
    if let Some(Verification { verified, mismatches, .. }) = status.verification {
        let text = format!("  verified {}, wrong {}", grouped(verified), grouped(mismatches));
        lines.push((text, if mismatches > 0 { WHITE } else { SOFT }));
    }
    if !status.banned.is_empty() {
        let text = format!("  {} (B: bring back)", kicked::list(&status.banned));
        lines.push((text.chars().take(layout.columns()).collect(), SOFT));
    }
    lines.push((layout.hint.to_owned(), SOFT));
    lines
}

/// The panel for a window of a certain size.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::display) struct AccountPanel {
    /// Each line with its colour.
    lines: Vec<(String, u32)>,
    scale: usize,
}

impl AccountPanel {
    /// The panel for a window of `size`: pixels per row, and rows.
    pub(in crate::display) fn new(
        size: (usize, usize),
        status: &FarmStatus,
        accounts: &Fading,
        selected: Option<u64>,
    ) -> Self {
        let (layout, scale) = Layout::fit(size);
        let room = size.1 / 2 / (LINE * scale);
        Self { lines: lines(&layout, status, accounts, selected, room), scale }
    }

    /// Draws the panel in the lower left corner.
    pub(super) fn draw(&self, canvas: &mut Canvas) {
        let (lines, colors): (Vec<String>, Vec<u32>) = self.lines.iter().cloned().unzip();
        let panel = Panel { lines, scale: self.scale };
        let top = canvas.height().saturating_sub(panel.height() + MARGIN * panel.scale);
        panel.draw_in(canvas, MARGIN * panel.scale, top, |index| colors.get(index).copied().unwrap_or(SOFT));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayfarm_farm::WorkerStatus;
    use rayfarm_farm::accounting::{FrameAccount, Parts, WorkerAccount};
    use std::time::Duration;

    fn status(count: u64) -> FarmStatus {
        let worker = |id| WorkerStatus {
            id,
            name: format!("machine-{id}"),
            local: false,
            address: ([127, 0, 0, 1], 9).into(),
            threads: 2,
            segments_done: 7,
            speed: 12_345.6,
            state: if id == 2 { WorkerState::Paused } else { WorkerState::Working },
            last_failure: None,
        };
        FarmStatus { workers: (1..=count).map(worker).collect(), ..FarmStatus::default() }
    }

    fn accounts() -> Fading {
        let parts = Parts { trace: 900, wait: 75, send: 25, ..Parts::default() };
        let worker = WorkerAccount { id: 1, parts, bytes: 250_000, ..WorkerAccount::default() };
        let mut fading = Fading::default();
        fading.add(Duration::ZERO, &FrameAccount { workers: vec![worker], segments: Vec::new() });
        fading
    }

    fn texts(count: u64, selected: Option<u64>, columns: usize, room: usize) -> Vec<String> {
        let lines = lines(&Layout::of(columns), &status(count), &accounts(), selected, room);
        lines.into_iter().map(|(text, _)| text).collect()
    }

    #[test]
    fn a_line_has_name_percentages_speed_and_bytes() {
        let texts = texts(2, Some(2), 120, 20);
        let words = |index: usize| texts[index].split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(words(0), "worker trace wait encode send decode tail scene rows/s KB/fr");
        assert_eq!(words(1), "1 machine-1 90.0 7.5 0.0 2.5 0.0 0.0 0.0 12,346 250");
        assert_eq!(words(2), "> 2 machine-2 paused 12,346 0");
        assert_eq!(words(3), "all 90.0 7.5 0.0 2.5 0.0 0.0 0.0 24,691 250");
    }

    #[test]
    fn counts_of_verification_have_a_line() {
        let counts = Verification { percent: 5, verified: 1234, mismatches: 2, ..Verification::default() };
        let status = FarmStatus { verification: Some(counts), ..status(1) };
        let lines = lines(&Layout::of(120), &status, &accounts(), None, 20);
        let verified: Vec<_> = lines.iter().filter(|(text, _)| text.contains("verified")).collect();
        assert_eq!(verified, [&("  verified 1,234, wrong 2".to_owned(), WHITE)]);
    }

    #[test]
    fn columns_are_aligned_with_their_words_in_any_width() {
        for columns in [38, 39, 58, 61, 64, 80, 88, 200] {
            let texts = texts(3, None, columns, 20);
            assert!(texts.iter().all(|line| line.chars().count() <= columns), "{columns}: {texts:#?}");
            assert_eq!(texts[0].len(), texts[1].len(), "{texts:#?}");
        }
    }

    #[test]
    fn a_worker_that_does_not_render_keeps_its_name_in_any_width() {
        let states = [WorkerState::Paused, WorkerState::Draining, WorkerState::Resting, WorkerState::Silent];
        for (columns, state) in
            [38, 61, 120].into_iter().flat_map(|columns| states.map(|state| (columns, state)))
        {
            let mut status = status(1);
            (status.workers[0].name, status.workers[0].state) = ("mill-7".to_owned(), state);
            let lines = lines(&Layout::of(columns), &status, &accounts(), None, 20);
            let (line, color) = &lines[1];
            assert!(line.contains("1 mill-7") && line.contains(&state.to_string()), "{columns}: {line}");
            assert_eq!((line.len(), *color), (lines[0].0.len(), SOFT), "{columns}: {line}");
        }
    }

    #[test]
    fn workers_that_were_kicked_are_named_with_the_key_that_brings_them_back() {
        let kicked = ["mill", "barn"]
            .map(|name| rayfarm_farm::BannedWorker { id: 1, name: name.to_owned(), address: None })
            .to_vec();
        let status = FarmStatus { banned: kicked, ..status(1) };
        let lines = lines(&Layout::of(120), &status, &accounts(), None, 20);
        let expected = "  Kicked: mill, barn (B: bring back)";
        assert!(lines.iter().any(|(text, _)| text == expected), "{lines:#?}");
    }

    #[test]
    fn the_usual_window_has_large_text_with_speeds() {
        let layout = |width, height| {
            let (layout, scale) = Layout::fit((width, height));
            (layout.figures.is_some(), scale)
        };
        assert_eq!(
            [layout(1024, 768), layout(640, 480), layout(320, 240)],
            [(true, 2), (true, 1), (false, 1)]
        );
    }

    #[test]
    fn the_selected_worker_is_always_visible() {
        for selected in 1..=50 {
            let texts = texts(50, Some(selected), 120, 12);
            assert!(texts.len() <= 12 && texts.iter().any(|line| line.starts_with('>')), "{texts:#?}");
        }
    }
}
