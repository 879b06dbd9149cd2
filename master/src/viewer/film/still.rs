//! The film of an interactive view: what the displays show after each pass.

use std::time::Instant;

use rayfarm_farm::{FinishedFrame, FrameId, ViewRequest};
use rayfarm_tracer::PixelFormat;
use rayfarm_tracer::scene::FrameView;

use super::{Film, FilmProgress, FilmTarget, Pace, PassError};

/// A pass of the picture at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::viewer) struct Pass {
    /// Number of its film: each start of a picture has a film of its own.
    pub(in crate::viewer) film: u64,
    /// The request for the whole picture.
    pub(in crate::viewer) whole: ViewRequest,
    /// Its first sample.
    pub(in crate::viewer) first: u32,
    /// Its number of samples.
    pub(in crate::viewer) samples: u32,
}

/// A film with its number.
#[derive(Debug)]
struct Numbered {
    number: u64,
    film: Film,
    target: FilmTarget,
    pace: Pace,
}

/// The film of an interactive view, if it is at rest and rendered in passes.
#[derive(Debug)]
pub(in crate::viewer) struct StillFilm {
    started: Instant,
    current: Option<Box<Numbered>>,
}

impl StillFilm {
    /// The state before the first pass.
    pub(in crate::viewer) fn new() -> Self {
        Self { started: Instant::now(), current: None }
    }

    /// Adds a pass of a film to it; the first pass of another film replaces the film. Returns the frame with the picture that the film
    /// shows, and its progress. Runs on a blocking thread, because a large picture takes tens of milliseconds.
    ///
    /// # Errors
    /// A frame that is not the next pass of its film, which is dropped then.
    pub(in crate::viewer) async fn add(
        &mut self,
        pass: Pass,
        frame: FinishedFrame,
    ) -> Result<(FinishedFrame, FilmProgress), PassError> {
        let at = self.started.elapsed();
        let film = self.current.take().filter(|current| current.number == pass.film);
        let work = move || {
            let mut film = film.unwrap_or_else(|| Box::new(Numbered::new(&pass)));
            film.film.add(&frame)?;
            film.pace.record(at, film.film.samples());
            let progress = film.pace.progress(&film.target, film.film.error());
            Ok((developed(&film.film, frame), progress, film))
        };
        let (frame, progress, film) = match tokio::task::spawn_blocking(work).await {
            Ok(done) => done?,
            Err(error) => std::panic::resume_unwind(error.into_panic()),
        };
        self.current = Some(film);
        Ok((frame, progress))
    }

    /// Frames whose pixels are in the film.
    pub(in crate::viewer) fn frames(&self) -> &[FrameId] {
        self.current.as_ref().map_or(&[], |current| current.film.frames())
    }

    /// Drops the film.
    pub(in crate::viewer) fn clear(&mut self) {
        self.current = None;
    }
}

impl Numbered {
    /// The empty film of a pass.
    fn new(pass: &Pass) -> Self {
        let whole = &pass.whole;
        let film = Film::new(&whole.rendered());
        Self { number: pass.film, film, target: FilmTarget::of(&whole.view), pace: Pace::default() }
    }
}

/// The picture of a first pass alone, for a camera that has moved on.
///
/// # Errors
/// A frame that is not the first pass of its picture.
pub(in crate::viewer) fn alone(pass: &Pass, frame: FinishedFrame) -> Result<FinishedFrame, PassError> {
    let mut film = Film::new(&pass.whole.rendered());
    film.add(&frame)?;
    Ok(developed(&film, frame))
}

/// A frame with the picture that a film shows, as if its samples had been rendered at once.
fn developed(film: &Film, frame: FinishedFrame) -> FinishedFrame {
    let (view, request) = (film.shown(PixelFormat::Rgb8), frame.request);
    let shown = FrameView { width: request.view.width, height: request.view.height, ..view };
    FinishedFrame {
        view,
        request: ViewRequest { view: shown, ..request },
        pixels: film.develop(PixelFormat::Rgb8).into(),
        ..frame
    }
}
