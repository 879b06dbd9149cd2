//! The terminal: shows the newest frame as characters or as a picture, with a panel of figures, and sends the input of keys and mouse.
//!
//! ```text
//! frame -> raster (pixels of the cells) -> cells (glyph and two colours each) -> encoder (changed cells as bytes) -> terminal
//! ```
//!
//! After each frame the display requests the place of its cursor, and the next frame waits for the reply: a slow connection shows
//! fewer frames and no old ones. Lines of the log go to the panel, because standard error is the same screen.

mod cells;
mod detect;
mod encoder;
mod graphics;
mod guard;
mod input;
mod panel;
mod raster;
mod sixel;

use std::io::{self, IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crossterm::{cursor, event, terminal};
use rayfarm_farm::WorkerState;

use self::cells::{Cell, cells_of};
use self::detect::{Abilities, Mode};
use self::encoder::{Colors, Encoder};
use self::graphics::Placed;
use self::guard::TerminalGuard;
use self::input::{Meaning, Reader};
use self::panel::{PANEL_ROWS, Screen};
use self::raster::{Picture, resized};
use super::{Display, DisplayError};
use crate::log_lines;
use crate::viewer::{InputAction, PresentedFrame, ViewerHandle, WorkerCommand};

pub(crate) use cells::CellKind;
pub(crate) use graphics::Protocol;
pub(crate) use guard::restore;

/// Longest wait for input while the picture changes, and while it rests.
const WAIT: Duration = Duration::from_millis(4);
const RESTING_WAIT: Duration = Duration::from_millis(60);
/// Interval at which figures and log are compared with those on the screen.
const PANEL_EVERY: Duration = Duration::from_millis(250);
/// Size of a cell in pixels where the terminal does not report it.
const USUAL_CELL: (u32, u32) = (9, 18);
/// Terminals of fewer rows have no panel.
const MIN_ROWS_WITH_PANEL: usize = 8;
const BACKGROUND: [u8; 3] = [32, 36, 40];

/// Choice of the way to show pictures, instead of the detected one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CellChoice {
    /// As characters.
    Cells(CellKind),
    /// As pictures.
    Graphics(Protocol),
}

/// The terminal of this process.
#[derive(Debug)]
pub(crate) struct TerminalDisplay {
    choice: Option<CellChoice>,
}

/// What the display has taken over, and what it shows.
struct Shown {
    guard: TerminalGuard,
    mode: Mode,
    cell: (u32, u32),
    encoder: Encoder,
    size: (usize, usize),
    picture: Option<Arc<PresentedFrame>>,
    /// Whether the picture on the screen is not the newest one.
    is_old: bool,
    show_help: bool,
    show_panel: bool,
    panel_at: Option<Instant>,
    panel_text: (String, String),
    /// Time of the input that the picture answers, until it is on the screen.
    input_at: Option<Instant>,
    /// Whether the terminal replies to questions for its cursor.
    replies: bool,
}

impl TerminalDisplay {
    /// Checks that this process has a terminal.
    ///
    /// # Errors
    /// The reason for which there is none, in words for the user.
    pub(crate) fn open(choice: Option<CellChoice>) -> Result<Self, String> {
        if io::stdout().is_terminal() && io::stdin().is_terminal() {
            Ok(Self { choice })
        } else {
            Err("standard input and output are not a terminal".to_owned())
        }
    }
}

impl Display for TerminalDisplay {
    fn run(self, viewer: ViewerHandle) -> Result<(), DisplayError> {
        let failed = |error: io::Error| DisplayError::Failed(format!("the terminal cannot be used: {error}"));
        let guard = TerminalGuard::take().map_err(failed)?;
        log_lines::hold_back();
        let result = self.show(guard, viewer).map_err(failed);
        // The terminal is restored now, and lines that were held back can be read.
        log_lines::release();
        result
    }
}

impl TerminalDisplay {
    fn show(self, guard: TerminalGuard, mut viewer: ViewerHandle) -> io::Result<()> {
        let abilities = Abilities::query();
        let mode = match self.choice {
            None => abilities.best(),
            Some(CellChoice::Cells(kind)) => Mode::Cells(kind),
            Some(CellChoice::Graphics(protocol)) => Mode::Graphics(protocol),
        };
        let mut shown = Shown::new(guard, mode, abilities.cell.unwrap_or(USUAL_CELL));
        let stop_request = stop_requests()?;
        let mut reader = Reader::default();
        shown.resize(&viewer)?;
        viewer.send(vec![InputAction::SetVisible(true)]);
        while viewer.is_running() {
            let wait = if viewer.statistics().resting { RESTING_WAIT } else { WAIT };
            if event::poll(wait)? {
                while event::poll(Duration::ZERO)? {
                    let meaning = reader.meaning(&event::read()?, shown.size.1 as u16);
                    if shown.apply(meaning, &viewer)?.is_break() {
                        viewer.send(vec![InputAction::Quit]);
                        return Ok(());
                    }
                }
            }
            if stop_request.swap(false, Ordering::AcqRel) {
                shown.stop(&viewer)?;
            }
            shown.take_frame(&mut viewer);
            shown.draw(&viewer)?;
        }
        Ok(())
    }
}

/// A flag that SIGTSTP sets: Ctrl-Z of another program, or `kill -TSTP`.
#[cfg(unix)]
fn stop_requests() -> io::Result<Arc<AtomicBool>> {
    let requested = Arc::new(AtomicBool::new(false));
    signal_hook::flag::register(signal_hook::consts::SIGTSTP, Arc::clone(&requested))?;
    Ok(requested)
}

#[cfg(not(unix))]
fn stop_requests() -> io::Result<Arc<AtomicBool>> {
    Ok(Arc::new(AtomicBool::new(false)))
}

impl Shown {
    fn new(guard: TerminalGuard, mode: Mode, cell: (u32, u32)) -> Self {
        // Terminals with 24-bit colours say so in this variable; there is no query that all of them answer.
        let is_true = |value: std::ffi::OsString| value == "truecolor" || value == "24bit";
        let has_true_colors = std::env::var_os("COLORTERM").is_some_and(is_true)
            || std::env::var("TERM").is_ok_and(|term| term.contains("direct") || term.contains("kitty"));
        let colors = if has_true_colors { Colors::True } else { Colors::Indexed };
        Self {
            guard,
            mode,
            cell,
            encoder: Encoder::new(colors),
            size: (0, 0),
            picture: None,
            is_old: true,
            show_help: false,
            show_panel: true,
            panel_at: None,
            panel_text: Default::default(),
            input_at: None,
            replies: true,
        }
    }

    /// Rows for the picture.
    fn picture_rows(&self) -> usize {
        let has_panel = self.show_panel && self.size.1 >= MIN_ROWS_WITH_PANEL;
        self.size.1 - if has_panel { PANEL_ROWS } else { 0 }
    }

    /// Reads the size of the terminal and requests pictures that fit.
    fn resize(&mut self, viewer: &ViewerHandle) -> io::Result<()> {
        let (columns, rows) = terminal::size()?;
        self.size = (usize::from(columns), usize::from(rows));
        let rows = self.picture_rows();
        let (width, height) = match self.mode {
            Mode::Cells(kind) => kind.picture_size(self.size.0, rows),
            Mode::Graphics(_) => (self.size.0 * self.cell.0 as usize, rows * self.cell.1 as usize),
        };
        let side = |pixels: usize| u32::try_from(pixels).unwrap_or(u32::MAX).max(1);
        viewer.send(vec![InputAction::Resize { width: side(width), height: side(height) }]);
        self.encoder.forget();
        self.is_old = true;
        self.panel_at = None;
        let mut clear = b"\x1b[0m\x1b[2J".to_vec();
        if let Mode::Graphics(protocol) = self.mode {
            graphics::remove(protocol, &mut clear);
        }
        io::stdout().lock().write_all(&clear)
    }

    /// Applies the meaning of an event. Breaks at the end.
    fn apply(
        &mut self,
        meaning: Option<Meaning>,
        viewer: &ViewerHandle,
    ) -> io::Result<std::ops::ControlFlow<()>> {
        match meaning {
            None => {}
            Some(Meaning::Camera(action)) => {
                viewer.send(vec![action]);
            }
            Some(Meaning::ToggleHelp) => {
                self.show_help ^= true;
                self.resize(viewer)?;
            }
            Some(Meaning::ToggleFigures) => {
                self.show_panel ^= true;
                self.resize(viewer)?;
            }
            Some(Meaning::TogglePause) => {
                let command = pause_or_resume(viewer);
                viewer.send(command.into_iter().map(InputAction::Worker).collect());
            }
            Some(Meaning::BringBack) => {
                viewer.send(vec![InputAction::Worker(WorkerCommand::BringBack)]);
            }
            Some(Meaning::Redraw) => self.resize(viewer)?,
            Some(Meaning::Stop) => self.stop(viewer)?,
            Some(Meaning::Quit) => return Ok(std::ops::ControlFlow::Break(())),
        }
        Ok(std::ops::ControlFlow::Continue(()))
    }

    /// Stops the process in the background, with the terminal restored; no frames are requested meanwhile.
    fn stop(&mut self, viewer: &ViewerHandle) -> io::Result<()> {
        #[cfg(unix)]
        self.guard.stop_in_background()?;
        let _ = &self.guard;
        self.resize(viewer)
    }

    fn take_frame(&mut self, viewer: &mut ViewerHandle) {
        if let Some(frame) = viewer.new_frame() {
            self.input_at = Some(frame.input_at);
            self.picture = Some(frame);
            self.is_old = true;
        }
    }

    /// Draws what has changed, in one write, and waits until the terminal has taken it.
    fn draw(&mut self, viewer: &ViewerHandle) -> io::Result<()> {
        let is_due = self.panel_at.is_none_or(|then| then.elapsed() > PANEL_EVERY);
        if is_due {
            self.panel_at = Some(Instant::now());
            let figures = panel::figures(self.picture.as_deref(), &viewer.statistics(), &viewer.status());
            let text = (figures, log_lines::last().unwrap_or_default());
            self.is_old |= std::mem::replace(&mut self.panel_text, text.clone()) != text;
        }
        if !self.is_old {
            return Ok(());
        }
        self.is_old = false;
        let mut bytes = Vec::new();
        self.encode(viewer, &mut bytes);
        if bytes.is_empty() {
            return Ok(());
        }
        let mut out = io::stdout().lock();
        out.write_all(&bytes)?;
        out.flush()?;
        drop(out);
        if let Some(input_at) = self.input_at.take() {
            viewer.send(vec![InputAction::Presented { latency: input_at.elapsed() }]);
        }
        if self.replies {
            // A terminal that never replies is only read and written.
            self.replies = cursor::position().is_ok();
        }
        Ok(())
    }

    /// Appends the bytes of the whole screen.
    fn encode(&mut self, viewer: &ViewerHandle, bytes: &mut Vec<u8>) {
        let (columns, rows) = self.size;
        let mut cells = vec![Cell::filled(BACKGROUND); columns * rows];
        let picture_rows = self.picture_rows();
        match (self.mode, self.picture.as_deref()) {
            (Mode::Cells(kind), Some(picture)) => {
                let (cell_columns, cell_rows) = kind.pixels();
                let size = (columns * cell_columns, picture_rows * cell_rows);
                let pixels = resized(of_frame(picture), size.0, size.1);
                for (cell, shown) in cells.iter_mut().zip(cells_of(kind, &pixels, columns)) {
                    *cell = shown;
                }
            }
            (Mode::Graphics(protocol), Some(picture)) if !self.show_help => {
                let Picture { width, height, rgb } = of_frame(picture);
                let placed = Placed { width, height, rgb, columns, rows: picture_rows };
                if let Err(problem) = graphics::show(protocol, placed, bytes) {
                    tracing::warn!("the picture cannot be shown: {problem}");
                }
            }
            _ => {}
        }
        let mut screen = Screen { cells: &mut cells, columns };
        if picture_rows < rows {
            screen.panel(&self.panel_text.0, &self.panel_text.1);
        }
        if self.show_help {
            screen.message(&panel::keys());
        } else if viewer.status().workers.is_empty() {
            screen.message(&waiting(viewer));
        } else if let Some(fault) = &viewer.statistics().scene_fault {
            screen.message(&panel::scene_fault(fault, columns));
        }
        self.encoder.update(&cells, columns, bytes);
    }
}

fn of_frame(picture: &PresentedFrame) -> Picture<'_> {
    let view = &picture.frame.view;
    Picture { width: view.width as usize, height: view.height as usize, rgb: &picture.frame.pixels }
}

/// The message while no worker is connected.
fn waiting(viewer: &ViewerHandle) -> Vec<String> {
    let mut lines = vec!["Waiting for a worker.".to_owned(), String::new()];
    lines.extend(viewer.statistics().problem.clone());
    lines.extend(viewer.entrance().reachable().for_window());
    lines
}

/// The command of P: resumes all workers if all are paused, and pauses them otherwise.
fn pause_or_resume(viewer: &ViewerHandle) -> Option<WorkerCommand> {
    let status = viewer.status();
    let ids: Vec<u64> = status.workers.iter().map(|worker| worker.id).collect();
    if ids.is_empty() {
        return None;
    }
    let all_paused = status.workers.iter().all(|worker| worker.state == WorkerState::Paused);
    Some(if all_paused { WorkerCommand::Resume(ids) } else { WorkerCommand::Pause(ids) })
}
