//! The window: shows the newest picture with its figures, and turns keys and mouse into cameras.

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use minifb::Window;
use rayfarm_tracer::image::MAX_SIDE;
use rayfarm_tracer::scene::FrameView;
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;

use super::canvas::{Canvas, Picture};
use super::feed::{Arrival, NewsDesk};
use super::input::{Controls, Happened};
use super::overlay::{self, Figures, accounts, legend};
use super::screen;
use super::steering::{self, Steering};
use super::tint::Coloring;
use crate::camera_control::CameraControl;
use crate::farm::{FarmControl, FarmStatus, FinishedFrame};
use crate::wanted::WantedPicture;

/// A window whose picture has not changed is drawn again this often: another window may have covered it, and the
/// figures want to be new.
const REDRAW_EVERY: Duration = Duration::from_millis(200);
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
    window: Window,
    controls: Controls,
    about: About,
    canvas: Canvas,
    picture: Option<FinishedFrame>,
    /// What the dial says of it.
    dial: Vec<String>,
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
    pub(crate) wanted: watch::Sender<WantedPicture>,
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
        let mut window = screen::open(&format!("rayfarm - {}", about.name), width, height)?;
        let controls = Controls::of(&mut window);
        Ok(Self {
            window,
            controls,
            about,
            canvas: Canvas::default(),
            picture: None,
            dial: Vec::new(),
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
        wanted: WantedPicture,
        mut camera: CameraControl,
        link: &Link,
    ) -> Result<(), String> {
        // Whatever ends the window ends the farm: who waits for it waits in vain otherwise.
        let _ended = link.stop.clone().drop_guard();
        let (mut last_step, mut last_draw, mut last_title) = (Instant::now(), None, Instant::now());
        while self.window.is_open() && !link.stop.is_cancelled() {
            let happened = self.controls.look(&mut self.window);
            if happened.end {
                break;
            }
            camera.step(&happened.camera, last_step.elapsed().as_secs_f64());
            last_step = Instant::now();
            let view = FrameView { camera: camera.camera(), ..wanted.view };
            self.ask_for(WantedPicture { view, ..wanted }, link);

            let fresh = self.take_news(&happened, link) | self.steer(&happened, link);
            if fresh || last_draw.is_none_or(|then: Instant| then.elapsed() > REDRAW_EVERY) {
                self.draw(link)?;
                last_draw = Some(Instant::now());
            } else {
                self.window.update();
            }
            if last_title.elapsed() > TITLE_EVERY {
                self.window.set_title(&self.title(link));
                last_title = Instant::now();
            }
        }
        Ok(())
    }

    /// Wants a picture of the window's size; only a change of view is worth a message.
    fn ask_for(&self, picture: WantedPicture, link: &Link) {
        let (width, height) = self.window.get_size();
        let side = |pixels: usize| u32::try_from(pixels).unwrap_or(MAX_SIDE).clamp(1, MAX_SIDE);
        let view = FrameView { width: side(width), height: side(height), ..picture.view };
        let picture = WantedPicture { view, ..picture };
        link.wanted.send_if_modified(|wanted| std::mem::replace(wanted, picture) != picture);
    }

    /// Whether there is something new to see.
    fn take_news(&mut self, happened: &Happened, link: &Link) -> bool {
        self.show_help ^= happened.toggle_help;
        self.show_figures ^= happened.toggle_figures;
        (0..happened.next_coloring).for_each(|_| self.coloring = self.coloring.next());
        let mut fresh = happened.toggle_help || happened.toggle_figures || happened.next_coloring > 0;
        if let Some(Arrival { frame, asked_at, dial }) = link.desk.take_picture() {
            (self.picture, self.asked_at, self.dial) = (Some(frame), Some(asked_at), dial);
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

    fn draw(&mut self, link: &Link) -> Result<(), String> {
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
        self.draw_overlay(link);
        self.window
            .update_with_buffer(self.canvas.pixels(), width, height)
            .map_err(|error| format!("the window takes no more pictures: {error}"))?;
        if let Some(asked_at) = self.asked_at.take() {
            link.desk.shown(asked_at.elapsed());
        }
        Ok(())
    }

    fn draw_overlay(&mut self, link: &Link) {
        let status = link.desk.status();
        let room_for_both = self.canvas.width() >= 640 && self.canvas.height() >= 480;
        if self.show_figures && self.picture.is_some() && (room_for_both || !self.show_help) {
            let figures = self.figures(&status, link);
            overlay::draw_figures(&mut self.canvas, &figures);
        }
        if let Some((title, entries)) =
            self.picture.as_ref().and_then(|frame| self.coloring.legend(&frame.account))
        {
            legend::draw_legend(&mut self.canvas, title, &entries);
        }
        if self.steering.shown {
            let selected = self.steering.selected;
            accounts::draw_accounts(&mut self.canvas, &status, &link.desk.accounts(), selected);
        }
        if self.show_help {
            overlay::draw_help(&mut self.canvas);
        } else if status.workers.is_empty() {
            let trouble = link.desk.trouble();
            let message =
                overlay::waiting_for_workers(link.address, self.about.local_workers, trouble.as_deref());
            overlay::draw_message(&mut self.canvas, &message);
        } else if steering::all_paused(&status) {
            overlay::draw_message(&mut self.canvas, &overlay::all_paused());
        } else if self.picture.is_none() {
            overlay::draw_message(&mut self.canvas, &first_picture(&status));
        }
    }

    fn figures(&self, status: &FarmStatus, link: &Link) -> Figures {
        let (fps, frame_time) = link.desk.rate();
        let wanted = *link.wanted.borrow();
        let view = wanted.view;
        let shown = self.picture.as_ref().map_or(wanted, |frame| wanted.shown_by(&frame.view));
        let slow = frame_time.max(link.desk.since_last_frame()) > PATIENCE && !status.workers.is_empty();
        Figures {
            fps,
            frame_time,
            latency: link.desk.latency(),
            size: (view.width, view.height),
            samples: shown.view.samples,
            dial: self.dial.clone(),
            reductions: shown.reductions(),
            workers: status.workers.len(),
            threads: status.workers.iter().map(|worker| worker.threads).sum(),
            triangles: self.about.triangles,
            progress: slow.then(|| progress(status)),
        }
    }

    fn title(&self, link: &Link) -> String {
        let status = link.desk.status();
        match &self.picture {
            Some(_) => {
                format!("rayfarm - {} - {}", self.about.name, self.figures(&status, link).speed())
            }
            None => format!("rayfarm - {}", self.about.name),
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
