//! The window: shows the newest frame with its figures, and sends the input of keys and mouse.

use std::sync::Arc;
use std::time::{Duration, Instant};

use minifb::Window;
use rayfarm_farm::FarmStatus;
use rayfarm_tracer::image::MAX_SIDE;

use super::canvas::{Canvas, Picture};
use super::input::{Controls, InputEvents};
use super::overlay::accounts::AccountPanel;
use super::overlay::{self, Figures, Overlay};
use super::screen;
use super::tint::Coloring;
use super::watch::WindowWatch;
use super::worker_selection::{self, WorkerSelection};
use super::{Display, DisplayError, SceneInfo};
use crate::viewer::{InputAction, PresentedFrame, Statistics, ViewerHandle};

/// Interval at which the figures are compared with those on the screen, and drawn if they differ.
const FIGURES_EVERY: Duration = Duration::from_millis(200);
/// Updates of the window per second: while something happens, while nothing does, and while the window is hidden.
const UPDATES: usize = 120;
const RESTING_UPDATES: usize = 30;
const HIDDEN_UPDATES: usize = 10;
/// Time after the last input in which further input is expected.
const ALERT: Duration = Duration::from_secs(1);
const TITLE_EVERY: Duration = Duration::from_millis(500);
/// Frame time above which the figures include the progress of the frame.
const SLOW_FRAME: Duration = Duration::from_millis(700);
/// Workers whose problems are listed before the first picture.
const MAX_PROBLEMS: usize = 4;
/// Colour of the window before the first picture.
const BACKGROUND: u32 = 0x0020_2428;

/// A window on the screen.
pub(crate) struct WindowDisplay {
    /// Dropped before the window that it watches.
    watch: WindowWatch,
    window: Window,
    controls: Controls,
    info: SceneInfo,
    canvas: Canvas,
    picture: Option<Arc<PresentedFrame>>,
    /// Overlay on the screen.
    drawn: Overlay,
    title: String,
    /// Time of the input that the picture answers, until it is on the screen.
    input_at: Option<Instant>,
    show_help: bool,
    show_figures: bool,
    selection: WorkerSelection,
    coloring: Coloring,
    /// Size and visibility as last sent to the viewer.
    sent: Option<((u32, u32), bool)>,
}

impl WindowDisplay {
    /// Checks that this build has a window: always `Ok` with the feature `window`.
    ///
    /// # Errors
    /// None.
    pub(crate) fn check_build() -> Result<(), String> {
        Ok(())
    }

    /// Opens an empty window of the given size, in pixels.
    ///
    /// # Errors
    /// The reason for which there is no display, in words for the user.
    pub(crate) fn open(info: SceneInfo, width: u32, height: u32) -> Result<Self, String> {
        let title = format!("rayfarm - {}", info.name);
        let mut window = screen::open(&title, width, height)?;
        let controls = Controls::of(&mut window);
        Ok(Self {
            watch: WindowWatch::of(&window),
            window,
            controls,
            info,
            canvas: Canvas::default(),
            picture: None,
            drawn: Overlay::default(),
            title,
            input_at: None,
            show_help: false,
            show_figures: true,
            selection: WorkerSelection::default(),
            coloring: Coloring::default(),
            sent: None,
        })
    }
}

impl Display for WindowDisplay {
    fn run(mut self, mut viewer: ViewerHandle) -> Result<(), DisplayError> {
        let (mut last_look, mut last_title) = (None, Instant::now());
        let mut last_input = Instant::now();
        while self.window.is_open() && viewer.is_running() {
            let events = self.controls.update(&mut self.window);
            self.watch.update();
            if events.quit {
                break;
            }
            if events.any {
                last_input = Instant::now();
            }
            self.send_view(&events, &viewer);

            let changed = self.apply(&events) | self.take_frame(&mut viewer) | self.command(&events, &viewer);
            let changed = changed | (self.window.get_size() != (self.canvas.width(), self.canvas.height()));
            let stale = last_look.is_none_or(|then: Instant| then.elapsed() > FIGURES_EVERY);
            if stale || changed {
                last_look = Some(Instant::now());
            }
            self.set_update_rate(last_input.elapsed() < ALERT, &viewer);
            let exposed = self.watch.take_exposed();
            if self.watch.is_hidden() || !self.draw_if(changed || exposed, stale, &viewer)? {
                self.window.update();
            }
            if last_title.elapsed() > TITLE_EVERY {
                self.set_title(&viewer);
                last_title = Instant::now();
            }
        }
        // The viewer ends all the same when the handle is dropped.
        viewer.send(vec![InputAction::Quit]);
        Ok(())
    }
}

impl WindowDisplay {
    /// Sends camera actions, and size and visibility where they have changed. At rest nothing is sent.
    fn send_view(&mut self, events: &InputEvents, viewer: &ViewerHandle) {
        let mut actions = events.camera.clone();
        let (size, visible) = (self.size(), !self.watch.is_hidden());
        let (sent_size, sent_visible) = self.sent.unzip();
        if sent_size != Some(size) {
            actions.push(InputAction::Resize { width: size.0, height: size.1 });
        }
        if sent_visible != Some(visible) {
            actions.push(InputAction::SetVisible(visible));
        }
        if !actions.is_empty() && viewer.send(actions) {
            self.sent = Some((size, visible));
        }
    }

    /// Size of the inside of the window, as far as pictures can be of that size.
    fn size(&self) -> (u32, u32) {
        let (width, height) = self.window.get_size();
        let side = |pixels: usize| u32::try_from(pixels).unwrap_or(MAX_SIDE).clamp(1, MAX_SIDE);
        (side(width), side(height))
    }

    /// Sets the rate at which input is read: reading takes time as well.
    fn set_update_rate(&mut self, alert: bool, viewer: &ViewerHandle) {
        let updates = match (self.watch.is_hidden(), alert || !viewer.statistics().resting) {
            (true, _) => HIDDEN_UPDATES,
            (false, true) => UPDATES,
            (false, false) => RESTING_UPDATES,
        };
        self.window.set_target_fps(updates);
    }

    /// Applies the keys of the overlay. Returns whether the window looks different.
    fn apply(&mut self, events: &InputEvents) -> bool {
        self.show_help ^= events.toggle_help;
        self.show_figures ^= events.toggle_figures;
        (0..events.next_coloring).for_each(|_| self.coloring = self.coloring.next());
        events.toggle_help || events.toggle_figures || events.next_coloring > 0
    }

    /// Takes the newest frame. Returns whether there was one.
    fn take_frame(&mut self, viewer: &mut ViewerHandle) -> bool {
        let Some(frame) = viewer.new_frame() else { return false };
        // A frame that arrives while the window is hidden is drawn later: that time is no latency.
        self.input_at = (!self.watch.is_hidden()).then_some(frame.input_at);
        self.picture = Some(frame);
        true
    }

    /// Sends the commands of keys to workers. Returns whether the selection has changed.
    fn command(&mut self, events: &InputEvents, viewer: &ViewerHandle) -> bool {
        if !events.concerns_workers() && self.selection.selected.is_none() {
            return false;
        }
        let before = self.selection;
        let commands = self.selection.apply(events, &viewer.status());
        if !commands.is_empty() {
            viewer.send(commands.into_iter().map(InputAction::Worker).collect());
        }
        self.selection != before
    }

    /// Draws the window if it must be, or if `look` and the overlay has changed. Returns whether it was drawn.
    fn draw_if(&mut self, must: bool, look: bool, viewer: &ViewerHandle) -> Result<bool, DisplayError> {
        let overlay = (must || look).then(|| self.overlay(self.window.get_size(), viewer));
        match overlay.filter(|overlay| must || *overlay != self.drawn) {
            Some(overlay) => self.draw(overlay, viewer).map(|()| true),
            None => Ok(false),
        }
    }

    fn draw(&mut self, overlay: Overlay, viewer: &ViewerHandle) -> Result<(), DisplayError> {
        let (width, height) = self.window.get_size();
        self.canvas.resize(width, height);
        match self.picture.as_deref() {
            None => self.canvas.fill(BACKGROUND),
            Some(PresentedFrame { frame, .. }) => {
                self.canvas.show(Picture {
                    width: frame.view.width as usize,
                    height: frame.view.height as usize,
                    rgb: &frame.pixels,
                });
                self.canvas.tint(&self.coloring.tints(&frame.account, frame.view.height));
            }
        }
        overlay.draw(&mut self.canvas);
        self.drawn = overlay;
        self.window
            .update_with_buffer(self.canvas.pixels(), width, height)
            .map_err(|error| DisplayError::Failed(format!("the window accepts no more pictures: {error}")))?;
        self.watch.drawn();
        if let Some(input_at) = self.input_at.take() {
            viewer.send(vec![InputAction::Presented { latency: input_at.elapsed() }]);
        }
        Ok(())
    }

    /// The overlay of a window of `size`, in pixels.
    fn overlay(&self, size: (usize, usize), viewer: &ViewerHandle) -> Overlay {
        let (status, statistics) = (viewer.status(), viewer.statistics());
        let room_for_both = size.0 >= 640 && size.1 >= 480;
        let show_figures = self.show_figures && (room_for_both || !self.show_help);
        let picture = self.picture.as_deref();
        let WorkerSelection { shown, selected } = self.selection;
        Overlay {
            figures: picture
                .filter(|_| show_figures)
                .map(|picture| self.figures(picture, &status, &statistics)),
            legend: picture.and_then(|picture| self.coloring.legend(&picture.frame.account)),
            accounts: shown.then(|| AccountPanel::new(size, &status, &statistics.accounts, selected)),
            help: self.show_help,
            message: self.message(&status, &statistics, viewer),
            fault: statistics.scene_fault.clone(),
        }
    }

    /// The reason for which no picture or no progress is to be seen, if there is one.
    fn message(
        &self,
        status: &FarmStatus,
        statistics: &Statistics,
        viewer: &ViewerHandle,
    ) -> Option<Vec<String>> {
        if status.workers.is_empty() {
            return Some(overlay::waiting_for_workers(
                &viewer.entrance().reachable(),
                self.info.local_workers,
                statistics.problem.as_deref(),
                &status.banned,
            ));
        }
        if worker_selection::all_paused(status) {
            return Some(overlay::all_paused());
        }
        self.picture.is_none().then(|| first_picture(status))
    }

    fn figures(&self, picture: &PresentedFrame, status: &FarmStatus, statistics: &Statistics) -> Figures {
        let Statistics { resting, frame_time, since_last_frame, .. } = *statistics;
        let is_slow = frame_time.max(since_last_frame) > SLOW_FRAME && !status.workers.is_empty();
        let quality = if resting { &statistics.quality } else { &picture.quality };
        Figures {
            fps: (!resting).then_some(statistics.fps),
            fps_range: statistics.fps_range,
            frame_time,
            latency: statistics.latency,
            size: self.size(),
            samples: picture.frame.request.view.samples,
            film: picture.film,
            quality: quality.clone(),
            reductions: picture.frame.request.setting().reductions(),
            workers: status.workers.len(),
            threads: status.workers.iter().map(|worker| worker.threads).sum(),
            triangles: self.info.triangles,
            progress: (is_slow && !resting).then(|| progress(status)),
        }
    }

    fn set_title(&mut self, viewer: &ViewerHandle) {
        let mut title = format!("rayfarm - {}", self.info.name);
        if let Some(picture) = self.picture.as_deref() {
            let figures = self.figures(picture, &viewer.status(), &viewer.statistics());
            title += &format!(" - {}", figures.speed());
        }
        if self.title != title {
            self.window.set_title(&title);
            self.title = title;
        }
    }
}

fn first_picture(status: &FarmStatus) -> Vec<String> {
    let first = match progress(status) {
        done if done > 0.0 => format!("Rendering the first picture: {:.0} %", done * 100.0),
        _ => "Sending the scene to the workers.".to_owned(),
    };
    let problems = status.workers.iter().filter_map(|worker| {
        let problem = worker.last_failure.as_ref()?;
        Some(format!("{} cannot render it: {problem}", worker.name))
    });
    std::iter::once(first).chain(problems.take(MAX_PROBLEMS)).collect()
}

/// Completed part of the frame being rendered: 0..=1.
fn progress(status: &FarmStatus) -> f64 {
    f64::from(status.rows_done) / f64::from(status.rows.max(1))
}
