//! Writing of frames in the background: a file each, or a video of all.

use std::collections::VecDeque;
use std::path::Path;
use std::time::Duration;

use rayfarm_tracer::image;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

use super::output::OutputPattern;
use super::picture::Picture;
use super::video::VideoWriter;
use crate::error::CommandError;

/// Largest number of frames being written; each holds a whole picture.
const MAX_PENDING: usize = 2;
/// Further attempts to write a picture while too many files are open, and the delay between two of them.
const MAX_RETRIES: u32 = 20;
const RETRY_DELAY: Duration = Duration::from_millis(250);

/// Saves a picture. A full table of open files is no reason to lose a frame: connections that took its places end.
fn save(picture: &Picture, path: &Path) -> Result<(), image::ImageError> {
    with_retries(|| picture.save(path), is_out_of_descriptors, RETRY_DELAY)
}

/// Whether a picture was not written because the process, or the system, has too many open files.
fn is_out_of_descriptors(error: &image::ImageError) -> bool {
    // EMFILE and ENFILE have these numbers on all Unix systems.
    let numbers: &[i32] = if cfg!(unix) { &[24, 23] } else { &[] };
    match error {
        image::ImageError::Write { source, .. } => {
            source.raw_os_error().is_some_and(|number| numbers.contains(&number))
        }
        _ => false,
    }
}

/// Repeats `save` while it fails for a reason that passes, up to [`MAX_RETRIES`] times.
fn with_retries<E>(
    save: impl Fn() -> Result<(), E>,
    passes: impl Fn(&E) -> bool,
    delay: Duration,
) -> Result<(), E> {
    for _ in 0..MAX_RETRIES {
        match save() {
            Err(error) if passes(&error) => std::thread::sleep(delay),
            result => return result,
        }
    }
    save()
}

/// Writer of frames: encodes and writes on blocking threads, at most [`MAX_PENDING`] frames at a time, or in one file by a
/// [`VideoWriter`].
#[derive(Debug)]
pub(crate) struct FrameWriter {
    pattern: OutputPattern,
    pending: VecDeque<JoinHandle<Result<(), image::ImageError>>>,
    video: Option<VideoWriter>,
    written: u64,
}

impl FrameWriter {
    /// A writer before its first frame.
    pub(crate) fn new(pattern: OutputPattern) -> Self {
        Self { pattern, pending: VecDeque::new(), video: None, written: 0 }
    }

    /// The same, with the writer of the video that the pattern names.
    #[must_use]
    pub(crate) fn with_video(self, video: Option<VideoWriter>) -> Self {
        Self { video, ..self }
    }

    /// Waits until another frame can be accepted. Cancel safe.
    ///
    /// # Errors
    /// The failure of an earlier frame.
    pub(crate) async fn ready(&mut self) -> Result<(), CommandError> {
        if let Some(video) = &mut self.video {
            return video.ready().await.map_err(CommandError::failed);
        }
        while self.pending.len() >= MAX_PENDING {
            self.finish_one().await?;
        }
        Ok(())
    }

    /// Accepts frame `index`, and calls `picture` if it has a file. At most one call per completion of
    /// [`FrameWriter::ready`]. The function that `picture` returns runs on a blocking thread.
    pub(crate) fn write<P, I>(&mut self, index: u64, picture: impl FnOnce() -> P)
    where
        P: FnOnce() -> Result<I, image::ImageError> + Send + 'static,
        I: Into<Picture>,
    {
        let Some(path) = self.pattern.path(index) else { return };
        let picture = picture();
        if let Some(video) = &mut self.video {
            video.write(Box::new(move || picture()?.into().into_srgb()));
            return;
        }
        self.pending.push_back(tokio::task::spawn_blocking(move || save(&picture()?.into(), &path)));
    }

    /// Completes the files after the last frame. A video that lacks frames, because the run has ended early, or that `interrupted`
    /// ends, leaves no file.
    ///
    /// # Errors
    /// As [`Self::finish`].
    pub(crate) async fn conclude(
        &mut self,
        is_complete: bool,
        interrupted: &CancellationToken,
    ) -> Result<(), CommandError> {
        let Some(video) = &mut self.video else { return self.finish().await };
        if is_complete {
            tokio::select! {
                biased;
                () = interrupted.cancelled() => {}
                finished = video.finish() => return finished.map_err(CommandError::failed),
            }
        }
        video.abort().await;
        if is_complete { Err(CommandError::Interrupted(String::new())) } else { Ok(()) }
    }

    /// Waits until all accepted frames are on the disk.
    ///
    /// # Errors
    /// The first failure; the other frames are written all the same.
    pub(crate) async fn finish(&mut self) -> Result<(), CommandError> {
        let mut result = Ok(());
        while !self.pending.is_empty() {
            let one = self.finish_one().await;
            result = result.and(one);
        }
        result
    }

    /// Whether frames have files.
    pub(crate) fn has_files(&self) -> bool {
        self.pattern != OutputPattern::None
    }

    /// Whether the frames are those of a video.
    pub(crate) fn is_video(&self) -> bool {
        self.video.is_some()
    }

    /// Number of frames that are completely on the disk, or in the video.
    pub(crate) fn written(&self) -> u64 {
        self.video.as_ref().map_or(self.written, VideoWriter::encoded)
    }

    async fn finish_one(&mut self) -> Result<(), CommandError> {
        let Some(save) = self.pending.front_mut() else { return Ok(()) };
        let saved = save.await;
        self.pending.pop_front();
        saved.map_err(CommandError::failed)?.map_err(CommandError::failed)?;
        self.written += 1;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use rayfarm_tracer::image::RgbImage;

    use super::*;

    #[test]
    fn a_picture_is_written_again_while_too_many_files_are_open() {
        let attempts = std::cell::Cell::new(0);
        let out_of = |number| image::ImageError::Write {
            path: PathBuf::from("a.png"),
            source: std::io::Error::from_raw_os_error(number),
        };
        let save = |failures: u32, number: i32| {
            attempts.set(0);
            let attempt = || {
                attempts.set(attempts.get() + 1);
                if attempts.get() > failures { Ok(()) } else { Err(out_of(number)) }
            };
            with_retries(attempt, is_out_of_descriptors, Duration::ZERO).is_ok()
        };
        if cfg!(unix) {
            assert_eq!((save(3, 24), attempts.get()), (true, 4));
            assert_eq!((save(100, 23), attempts.get()), (false, MAX_RETRIES + 1));
        }
        // A full disk is an error at once.
        assert_eq!((save(1, 28), attempts.get()), (false, 1));
    }

    #[tokio::test]
    async fn frames_are_written_whole_and_counted() {
        let folder = tempfile::tempdir().unwrap();
        let pattern = OutputPattern::parse(&folder.path().join("f%d.ppm"), 5).unwrap();
        let mut writer = FrameWriter::new(pattern);
        for index in 0..5u8 {
            let picture = RgbImage { width: 2, height: 1, pixels: vec![index; 6] };
            writer.ready().await.unwrap();
            writer.write(u64::from(index), || move || Ok(picture));
        }
        writer.finish().await.unwrap();
        assert_eq!(writer.written(), 5);
        for index in 0..5u8 {
            let picture = image::load(&folder.path().join(format!("f{index}.ppm"))).unwrap();
            assert_eq!(picture.pixels, [index; 6]);
        }
    }

    #[tokio::test]
    async fn a_failed_write_is_an_error_and_not_counted() {
        let folder = tempfile::tempdir().unwrap();
        let pattern = OutputPattern::parse(&folder.path().join("gone/f%d.ppm"), 2).unwrap();
        let mut writer = FrameWriter::new(pattern);
        writer.write(0, || || Ok(RgbImage { width: 1, height: 1, pixels: vec![0; 3] }));
        assert!(writer.finish().await.is_err());
        assert_eq!(writer.written(), 0);
    }
}
