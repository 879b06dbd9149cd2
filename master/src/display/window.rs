//! The window: shows the newest picture with its figures, and turns keys and mouse into cameras.

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use minifb::Window;
use rayfarm_tracer::image::MAX_SIDE;
use rayfarm_tracer::scene::FrameView;
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;

use super::canvas::{Canvas, Picture};
use super::input::{Controls, Happened};
use super::overlay::accounts::AccountPanel;
use super::overlay::{self, Figures, Overlay};
use super::screen;
use super::steering::{self, Steering};
use super::tint::Coloring;
use super::watch::Watch;
use crate::farm::{FarmControl, FarmStatus, FinishedFrame};
use crate::viewer::camera_control::CameraControl;
use crate::viewer::frame_loop::{Arrival, NewsDesk};
use crate::viewer::requests::WindowState;
use crate::viewer::view_request::ViewRequest;

/// This often the figures are looked at, and drawn if they have changed.
const FIGURES_EVERY: Duration = Duration::from_millis(200);
/// The input is looked at this many times a second while something happens, while nothing does, and while the window
/// is hidden.
const UPDATES: usize = 120;
const RESTING_UPDATES: usize = 30;
const HIDDEN_UPDATES: usize = 10;
/// After the last input, something is expected to happen for this long.
const ALERT: Duration = Duration::from_secs(1);
const TITLE_EVERY: Duration = Duration::from_millis(500);
/// A frame that takes longer than this is told how far it is.
const PATIENCE: Duration = Duration::from_millis(700);
/// Workers whose trouble is told before the first picture.
const MAX_TROUBLES: usize = 4;
/// What is seen before the first picture.
const GROUND: u32 = 0x0020_2428;

/// What the window shows besides pictures.
#[derive(Clone, Debug)]
pub(crate) struct About {
    /// The scene's name, for the title.
    pub(crate) name: String,
    /// Triangles over all instances.
    pub(crate) triangles: u64,
    /// Workers that the master starts itself.
    pub(crate) local_workers: u32,
}

/// A window on the screen that shows nothing yet.
pub(crate) struct Display {
    /// Dropped before the window that it watches.
    watch: Watch,
    window: Window,
    controls: Controls,
    about: About,
    canvas: Canvas,
    picture: Option<FinishedFrame>,
    /// What is written over it on the screen.
    shown: Overlay,
    title: String,
    /// What the quality controller says of it.
    quality: Vec<String>,
    /// When the picture was asked for, until it is on the screen.
    asked_at: Option<Instant>,
    show_help: bool,
    show_figures: bool,
    steering: Steering,
    coloring: Coloring,
}

/// The two ways between the window and the farm.
pub(crate) struct Link {
    /// Where the newest view goes.
    pub(crate) wanted: watch::Sender<WindowState>,
    /// Where the newest picture comes from.
    pub(crate) desk: NewsDesk,
    /// Where commands to workers go.
    pub(crate) control: FarmControl,
    /// Where workers connect.
    pub(crate) address: SocketAddr,
    /// Cancelled by either side to end.
    pub(crate) stop: CancellationToken,
}

impl Display {
    /// Opens a window of the given size.
    ///
    /// # Errors
    /// Why there is no display.
    pub(crate) fn open(about: About, width: u32, height: u32) -> Result<Self, String> {
        let title = format!("rayfarm - {}", about.name);
        let mut window = screen::open(&title, width, height)?;
        let controls = Controls::of(&mut window);
        Ok(Self {
            watch: Watch::of(&window),
            window,
            controls,
            about,
            canvas: Canvas::default(),
            picture: None,
            shown: Overlay::default(),
            title,
            quality: Vec::new(),
            asked_at: None,
            show_help: false,
            show_figures: true,
            steering: Steering::default(),
            coloring: Coloring::default(),
        })
    }

    /// Shows pictures until the user ends it or `link.stop` is cancelled, and cancels that. Never waits for the farm.
    ///
    /// # Errors
    /// A screen that takes no pictures any more.
    pub(crate) fn run(
        mut self,
        wanted: ViewRequest,
        mut camera: CameraControl,
        link: &Link,
    ) -> Result<(), String> {
        // Whatever ends the window ends the farm: who waits for it waits in vain otherwise.
        let _ended = link.stop.clone().drop_guard();
        let (mut last_step, mut last_look, mut last_title) = (Instant::now(), None, Instant::now());
        let mut last_input = Instant::now();
        while self.window.is_open() && !link.stop.is_cancelled() {
            let happened = self.controls.look(&mut self.window);
            self.watch.look();
            if happened.end {
                break;
            }
            if happened.any {
                last_input = Instant::now();
            }
            camera.step(&happened.camera, last_step.elapsed().as_secs_f64());
            last_step = Instant::now();
            let view = FrameView { camera: camera.camera(), ..wanted.view };
            self.ask_for(ViewRequest { view, ..wanted }, link);

            let fresh = self.take_news(&happened, link) | self.steer(&happened, link);
            let fresh = fresh | (self.window.get_size() != (self.canvas.width(), self.canvas.height()));
            let stale = last_look.is_none_or(|then: Instant| then.elapsed() > FIGURES_EVERY);
            if stale || fresh {
                last_look = Some(Instant::now());
            }
            self.set_pace(last_input.elapsed() < ALERT, link);
            let exposed = self.watch.take_exposed();
            if self.watch.is_hidden() || !self.draw_if(fresh || exposed, stale, link)? {
                self.window.update();
            }
            if last_title.elapsed() > TITLE_EVERY {
                self.set_title(link);
                last_title = Instant::now();
            }
        }
        Ok(())
    }

    /// Wants a picture of the window's size; only a change of view is worth a message.
    fn ask_for(&self, picture: ViewRequest, link: &Link) {
        let (width, height) = self.window.get_size();
        let side = |pixels: usize| u32::try_from(pixels).unwrap_or(MAX_SIDE).clamp(1, MAX_SIDE);
        let view = FrameView { width: side(width), height: side(height), ..picture.view };
        let picture = ViewRequest { view, ..picture };
        let state = WindowState { picture, hidden: self.watch.is_hidden() };
        link.wanted.send_if_modified(|wanted| std::mem::replace(wanted, state) != state);
    }

    /// Looks often where something happens, and seldom where nothing does: looking costs as well.
    fn set_pace(&mut self, alert: bool, link: &Link) {
        let updates = match (self.watch.is_hidden(), alert || link.desk.resting().is_none()) {
            (true, _) => HIDDEN_UPDATES,
            (false, true) => UPDATES,
            (false, false) => RESTING_UPDATES,
        };
        self.window.set_target_fps(updates);
    }

    /// Whether there is something new to see.
    fn take_news(&mut self, happened: &Happened, link: &Link) -> bool {
        self.show_help ^= happened.toggle_help;
        self.show_figures ^= happened.toggle_figures;
        (0..happened.next_coloring).for_each(|_| self.coloring = self.coloring.next());
        let mut fresh = happened.toggle_help || happened.toggle_figures || happened.next_coloring > 0;
        if let Some(Arrival { frame, asked_at, quality }) = link.desk.take_picture() {
            // What comes while the window is hidden is shown at some other time: that is no latency.
            let asked_at = (!self.watch.is_hidden()).then_some(asked_at);
            (self.picture, self.asked_at, self.quality) = (Some(frame), asked_at, quality);
            fresh = true;
        }
        fresh
    }

    /// Does what keys ask of workers. Whether that can be seen.
    fn steer(&mut self, happened: &Happened, link: &Link) -> bool {
        if !happened.steers() && self.steering.selected.is_none() {
            return false;
        }
        let before = self.steering;
        let wishes = self.steering.step(happened, &link.desk.status());
        wishes.iter().for_each(|wish| wish.perform(&link.control));
        self.steering != before
    }

    /// Draws the window if it must be, or if it is time to look whether what is written on it has changed. Whether it was.
    fn draw_if(&mut self, must: bool, look: bool, link: &Link) -> Result<bool, String> {
        let overlay = (must || look).then(|| self.overlay(self.window.get_size(), link));
        match overlay.filter(|overlay| must || *overlay != self.shown) {
            Some(overlay) => self.draw(overlay, link).map(|()| true),
            None => Ok(false),
        }
    }

    fn draw(&mut self, overlay: Overlay, link: &Link) -> Result<(), String> {
        let (width, height) = self.window.get_size();
        self.canvas.resize(width, height);
        match &self.picture {
            None => self.canvas.fill(GROUND),
            Some(frame) => {
                self.canvas.show(Picture {
                    width: frame.view.width as usize,
                    height: frame.view.height as usize,
                    rgb: &frame.pixels,
                });
                self.canvas.tint(&self.coloring.tints(&frame.account, frame.view.height));
            }
        }
        overlay.draw(&mut self.canvas);
        self.shown = overlay;
        self.window
            .update_with_buffer(self.canvas.pixels(), width, height)
            .map_err(|error| format!("the window takes no more pictures: {error}"))?;
        self.watch.drawn();
        if let Some(asked_at) = self.asked_at.take() {
            link.desk.shown(asked_at.elapsed());
        }
        Ok(())
    }

    /// What is to be written over the picture in a window of `size`.
    fn overlay(&self, size: (usize, usize), link: &Link) -> Overlay {
        let status = link.desk.status();
        let room_for_both = size.0 >= 640 && size.1 >= 480;
        let figures = self.show_figures && self.picture.is_some() && (room_for_both || !self.show_help);
        let selected = self.steering.selected;
        Overlay {
            figures: figures.then(|| self.figures(&status, link)),
            legend: self.picture.as_ref().and_then(|frame| self.coloring.legend(&frame.account)),
            accounts: self
                .steering
                .shown
                .then(|| AccountPanel::new(size, &status, &link.desk.accounts(), selected)),
            help: self.show_help,
            message: self.message(&status, link),
        }
    }

    /// What the window waits for, if it does.
    fn message(&self, status: &FarmStatus, link: &Link) -> Option<Vec<String>> {
        if status.workers.is_empty() {
            let trouble = link.desk.trouble();
            let local = self.about.local_workers;
            return Some(overlay::waiting_for_workers(
                link.address,
                local,
                trouble.as_deref(),
                &status.kicked,
            ));
        }
        if steering::all_paused(status) {
            return Some(overlay::all_paused());
        }
        self.picture.is_none().then(|| first_picture(status))
    }

    fn figures(&self, status: &FarmStatus, link: &Link) -> Figures {
        let (fps, frame_time) = link.desk.rate();
        let resting = link.desk.resting();
        let wanted = link.wanted.borrow().picture;
        let view = wanted.view;
        let shown = self.picture.as_ref().map_or(wanted, |frame| wanted.shown_by(&frame.view));
        let slow = frame_time.max(link.desk.since_last_frame()) > PATIENCE && !status.workers.is_empty();
        Figures {
            fps: resting.is_none().then_some(fps),
            frame_time,
            latency: link.desk.latency(),
            size: (view.width, view.height),
            samples: shown.view.samples,
            quality: resting.clone().unwrap_or_else(|| self.quality.clone()),
            reductions: shown.reductions(),
            workers: status.workers.len(),
            threads: status.workers.iter().map(|worker| worker.threads).sum(),
            triangles: self.about.triangles,
            progress: (slow && resting.is_none()).then(|| progress(status)),
        }
    }

    fn set_title(&mut self, link: &Link) {
        let mut title = format!("rayfarm - {}", self.about.name);
        if self.picture.is_some() {
            title += &format!(" - {}", self.figures(&link.desk.status(), link).speed());
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
    let troubles = status.workers.iter().filter_map(|worker| {
        let trouble = worker.trouble.as_ref()?;
        Some(format!("{} cannot render it: {trouble}", worker.name))
    });
    std::iter::once(first).chain(troubles.take(MAX_TROUBLES)).collect()
}

/// How much of the frame being rendered is done: 0..=1.
fn progress(status: &FarmStatus) -> f64 {
    f64::from(status.rows_done) / f64::from(status.rows.max(1))
}
