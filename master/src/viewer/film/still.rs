//! The film of an interactive view: what the displays show after each pass.

use std::sync::Arc;
use std::time::{Duration, Instant};

use rayfarm_farm::{FinishedFrame, FrameId, ViewRequest};
use rayfarm_tracer::image::ImageError;
use rayfarm_tracer::scene::FrameView;
use rayfarm_tracer::{PixelFormat, develop_denoised};
use tokio::task::{JoinError, JoinHandle};

use super::guides::FilmGuides;
use super::pass::{Part, Pass};
use super::{Film, FilmProgress, FilmTarget, Pace, PassError};

/// Samples from which a film has an estimate of its noise.
const LEAST_DENOISED: u32 = 2;

/// A film with its number.
#[derive(Clone, Debug)]
struct Numbered {
    number: u64,
    film: Film,
    target: FilmTarget,
    pace: Pace,
    guides: FilmGuides,
}

/// The film of an interactive view, if it is at rest and rendered in passes.
///
/// Its pictures are denoised on request, once its guides are there. That takes many times as long as a pass is added, so it runs next to the
/// viewer, one picture at a time: what the film has when a picture is ready is the next one. The film itself is not changed.
#[derive(Debug)]
pub(in crate::viewer) struct StillFilm {
    started: Instant,
    /// Shared with the picture that is being developed.
    current: Option<Arc<Numbered>>,
    /// Whether pictures are denoised.
    denoised: bool,
    /// The last pass of the film without its pixels, which describes its pictures.
    last: Option<FinishedFrame>,
    /// Samples of the newest picture of the film that was returned.
    shown: u32,
    developing: Option<JoinHandle<Developed>>,
    /// Whether a further picture is to be developed after that.
    is_due: bool,
}

/// The effect of a pass on a film.
#[derive(Debug)]
pub(in crate::viewer) enum Added {
    /// Samples were added.
    Samples {
        /// The picture that the film shows; `None` if it follows from [`StillFilm::developed`].
        frame: Option<Box<FinishedFrame>>,
        progress: FilmProgress,
    },
    /// A guide was added, after which a picture may follow from [`StillFilm::developed`].
    Guide,
}

/// A picture that was developed next to the viewer.
#[derive(Debug)]
pub(in crate::viewer) struct Redeveloped {
    /// Number of its film.
    pub(in crate::viewer) film: u64,
    pub(in crate::viewer) frame: FinishedFrame,
    pub(in crate::viewer) progress: FilmProgress,
}

/// A picture of a film as it comes from its thread.
#[derive(Debug)]
struct Developed {
    film: u64,
    denoised: bool,
    view: FrameView,
    progress: FilmProgress,
    pixels: Result<Vec<u8>, ImageError>,
}

impl StillFilm {
    /// The state before the first pass.
    pub(in crate::viewer) fn new(denoised: bool) -> Self {
        Self {
            started: Instant::now(),
            current: None,
            denoised,
            last: None,
            shown: 0,
            developing: None,
            is_due: false,
        }
    }

    /// Adds a pass of a film to it; the first pass of another film replaces the film. Runs on a blocking thread, because a large picture
    /// takes tens of milliseconds.
    ///
    /// # Errors
    /// A frame that is not the next pass of its film, which is dropped then.
    pub(in crate::viewer) async fn add(
        &mut self,
        pass: Pass,
        frame: FinishedFrame,
    ) -> Result<Added, PassError> {
        let at = self.started.elapsed();
        let film = self.current.take().filter(|current| current.number == pass.film);
        if film.is_none() {
            self.clear();
        }
        let denoised = self.denoised;
        let work = move || {
            let mut film = film.unwrap_or_else(|| Arc::new(Numbered::new(&pass)));
            // A copy while a picture of it is being developed.
            let own = Arc::make_mut(&mut film);
            own.add(&pass, &frame, at)?;
            let is_later = denoised && own.can_be_denoised();
            let developed = match pass.part {
                Part::Samples { .. } if !is_later => Some(own.develop(false)),
                _ => None,
            };
            let progress = own.progress(false);
            let last = FinishedFrame { pixels: Vec::new().into(), ..frame };
            Ok::<_, PassError>((film, last, developed, progress, is_later))
        };
        let (film, last, developed, progress, is_later) = result_of(tokio::task::spawn_blocking(work).await)?;
        self.current = Some(film);
        let is_guide = matches!(pass.part, Part::Guide(_));
        let frame = developed.and_then(|developed| self.presentable(&last, developed));
        if !is_guide {
            self.last = Some(last);
        }
        if is_later {
            self.develop_again();
        }
        Ok(if is_guide { Added::Guide } else { Added::Samples { frame: frame.map(Box::new), progress } })
    }

    /// Waits for a picture that is developed next to the viewer. Never returns where none is. Cancel safe.
    pub(in crate::viewer) async fn developed(&mut self) -> Redeveloped {
        loop {
            let Some(developing) = &mut self.developing else { return std::future::pending().await };
            let developed = result_of(developing.await);
            self.developing = None;
            self.develop_if_due();
            let Some(last) = self.last.take() else { continue };
            let (film, progress) = (developed.film, developed.progress);
            let frame = self.presentable(&last, developed);
            self.last = Some(last);
            if let Some(frame) = frame {
                return Redeveloped { film, frame, progress };
            }
        }
    }

    /// Shows pictures with or without their noise from now on. The newest picture is developed again if that makes a difference.
    pub(in crate::viewer) fn set_denoised(&mut self, denoised: bool) {
        let differs = std::mem::replace(&mut self.denoised, denoised) != denoised;
        if differs && self.current.as_ref().is_some_and(|film| film.can_be_denoised()) {
            self.develop_again();
        }
    }

    /// Frames whose pixels are in the film, or guide its denoiser.
    pub(in crate::viewer) fn frames(&self) -> impl Iterator<Item = FrameId> {
        let film = self.current.iter();
        film.flat_map(|film| film.film.frames().iter().chain(film.guides.frames())).copied()
    }

    /// Drops the film. A picture of it that is being developed is not returned.
    pub(in crate::viewer) fn clear(&mut self) {
        (self.current, self.last, self.shown, self.is_due) = (None, None, 0, false);
    }

    /// The frame of a developed picture; `None` if it is of a former film, with or without noise against the newest setting, or older than
    /// the newest picture.
    fn presentable(&mut self, last: &FinishedFrame, developed: Developed) -> Option<FinishedFrame> {
        let Developed { film, denoised, view, pixels, .. } = developed;
        let is_current = self.current.as_ref().is_some_and(|current| current.number == film);
        let is_plain = !denoised && (!self.denoised || !self.can_be_denoised());
        let is_wanted = denoised && self.denoised || is_plain;
        if !is_current || !is_wanted || view.samples < self.shown {
            return None;
        }
        match pixels {
            Ok(pixels) => {
                self.shown = view.samples;
                Some(with_pixels(last, view, pixels))
            }
            Err(error) => {
                tracing::error!("the picture cannot be denoised: {error}");
                None
            }
        }
    }

    /// Whether a picture is being developed next to the viewer.
    #[cfg(test)]
    pub(super) fn is_developing(&self) -> bool {
        self.developing.is_some()
    }

    fn can_be_denoised(&self) -> bool {
        self.current.as_ref().is_some_and(|film| film.can_be_denoised())
    }

    /// Develops the newest picture of the film, after the one that is being developed.
    fn develop_again(&mut self) {
        self.is_due = true;
        self.develop_if_due();
    }

    fn develop_if_due(&mut self) {
        if self.developing.is_some() || !self.is_due {
            return;
        }
        self.is_due = false;
        let (film, denoised) = (self.current.clone(), self.denoised);
        let work = film.map(|film| move || film.develop(denoised));
        self.developing = work.map(tokio::task::spawn_blocking);
    }
}

impl Numbered {
    /// The empty film of a pass.
    fn new(pass: &Pass) -> Self {
        let whole = &pass.whole;
        Self {
            number: pass.film,
            film: Film::new(&whole.rendered()),
            target: FilmTarget::of(&whole.view),
            pace: Pace::default(),
            guides: FilmGuides::default(),
        }
    }

    /// Adds a pass that was complete at a time.
    ///
    /// # Errors
    /// A frame that is not the next pass.
    fn add(&mut self, pass: &Pass, frame: &FinishedFrame, at: Duration) -> Result<(), PassError> {
        match pass.part {
            Part::Samples { .. } => {
                self.film.add(frame)?;
                self.pace.record(at, self.film.samples());
                Ok(())
            }
            Part::Guide(shading) => self.guides.add(&pass.whole, shading, frame),
        }
    }

    fn can_be_denoised(&self) -> bool {
        self.film.samples() >= LEAST_DENOISED && self.guides.all().is_some()
    }

    fn progress(&self, is_denoised: bool) -> FilmProgress {
        FilmProgress { is_denoised, ..self.pace.progress(&self.target, self.film.error()) }
    }

    /// The picture that the film shows, without most of its noise if that is requested and the guides are there.
    fn develop(&self, denoised: bool) -> Developed {
        let view = self.film.shown(PixelFormat::Rgb8);
        let guides = self.guides.all().filter(|_| denoised && self.can_be_denoised());
        let pixels = match guides {
            Some(guides) => develop_denoised(&view, view.samples, self.film.sums(), guides),
            None => Ok(self.film.develop(PixelFormat::Rgb8)),
        };
        let denoised = guides.is_some();
        Developed { film: self.number, denoised, view, progress: self.progress(denoised), pixels }
    }
}

/// The result of a blocking thread, whose panic goes on in the caller.
fn result_of<T>(result: Result<T, JoinError>) -> T {
    result.unwrap_or_else(|error| std::panic::resume_unwind(error.into_panic()))
}

/// The picture of a first pass alone, for a camera that has moved on.
///
/// # Errors
/// A frame that is not the first pass of its picture.
pub(in crate::viewer) fn alone(pass: &Pass, frame: FinishedFrame) -> Result<FinishedFrame, PassError> {
    if !pass.is_first() {
        return Err(PassError::OtherView);
    }
    let mut film = Film::new(&pass.whole.rendered());
    film.add(&frame)?;
    Ok(with_pixels(&frame, film.shown(PixelFormat::Rgb8), film.develop(PixelFormat::Rgb8)))
}

/// A frame with the pixels of a view of a film, as if its samples had been rendered at once.
fn with_pixels(frame: &FinishedFrame, view: FrameView, pixels: Vec<u8>) -> FinishedFrame {
    let FinishedFrame { frame: number, request, counts, elapsed, latency, workers, threads, .. } = *frame;
    let shown = FrameView { width: request.view.width, height: request.view.height, ..view };
    FinishedFrame {
        frame: number,
        request: ViewRequest { view: shown, ..request },
        view,
        pixels: pixels.into(),
        counts,
        elapsed,
        latency,
        workers,
        threads,
        sent_bytes: frame.sent_bytes,
        received_bytes: frame.received_bytes,
        scene_bytes: frame.scene_bytes,
        account: frame.account.clone(),
    }
}
