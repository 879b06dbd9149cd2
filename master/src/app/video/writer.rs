//! The thread that encodes a video, and the file under its temporary name.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::JoinHandle;

use rayfarm_tracer::files::Temporary;
use rayfarm_tracer::image::RgbImage;
use tokio::sync::{mpsc, oneshot};

use super::apng::ApngEncoder;
use super::ffmpeg::{FfmpegEncoder, Process, kill};
use super::gif::GifEncoder;
use super::{Encoder, VideoError, VideoFormat, VideoSettings};

/// Largest number of frames that wait for the encoder.
const MAX_PENDING: usize = 2;

/// Makes a frame; called by the thread that encodes.
type MakeFrame = Box<dyn FnOnce() -> Result<RgbImage, VideoError> + Send>;

enum Message {
    Frame(MakeFrame),
    /// All frames have been sent. Without it the video is dropped.
    End,
}

/// A writer of a video. Its file appears when all frames are in it; dropped before, it leaves nothing.
#[derive(Debug)]
pub(crate) struct VideoWriter {
    /// `None` after the end.
    frames: Option<mpsc::Sender<Message>>,
    result: oneshot::Receiver<Result<(), VideoError>>,
    /// The first failure, for later calls.
    failure: Option<VideoError>,
    encoded: Arc<AtomicU64>,
    /// The program that encodes, if one does.
    process: Option<Process>,
    thread: Option<JoinHandle<()>>,
}

impl VideoWriter {
    /// Starts the encoder of a video at `path`.
    ///
    /// # Errors
    /// A file that cannot be created; a rate that the format does not have; a program that cannot be started.
    pub(crate) fn start(path: &Path, settings: VideoSettings) -> Result<Self, VideoError> {
        let failed = |error: std::io::Error| VideoError::new(format!("{}: {error}", path.display()));
        let path = std::path::absolute(path).map_err(failed)?;
        let (temporary, file) = Temporary::create_next_to(&path).map_err(failed)?;
        let mut process = None;
        let encoder: Box<dyn Encoder> = match settings.format {
            VideoFormat::Apng => Box::new(ApngEncoder::new(file, &settings)?),
            VideoFormat::Gif => Box::new(GifEncoder::new(file, &settings)?),
            VideoFormat::Mp4 | VideoFormat::WebM => {
                drop(file);
                let ffmpeg = FfmpegEncoder::start(temporary.path(), &settings)?;
                process = Some(ffmpeg.process());
                Box::new(ffmpeg)
            }
        };
        let (frames, received) = mpsc::channel(MAX_PENDING);
        let (report, result) = oneshot::channel();
        let encoded = Arc::new(AtomicU64::new(0));
        let counter = encoded.clone();
        let thread = std::thread::Builder::new().name("video".to_owned()).spawn(move || {
            let file = VideoFile { temporary, path, settings };
            let result = encode(file, encoder, received, &counter);
            // The receiver of a video that was dropped is gone.
            let _ = report.send(result);
        });
        let thread = thread.map_err(|error| VideoError::new(format!("no thread for the video: {error}")))?;
        Ok(Self { frames: Some(frames), result, failure: None, encoded, process, thread: Some(thread) })
    }

    /// Number of frames in the video so far.
    pub(crate) fn encoded(&self) -> u64 {
        self.encoded.load(Ordering::Relaxed)
    }

    /// Waits until another frame can be accepted. Cancel safe.
    ///
    /// # Errors
    /// The failure of the encoder.
    pub(crate) async fn ready(&mut self) -> Result<(), VideoError> {
        match &self.frames {
            Some(frames) if frames.reserve().await.is_ok() => Ok(()),
            _ => Err(self.result().await.err().unwrap_or_else(|| VideoError::new("the video has ended"))),
        }
    }

    /// Accepts the next frame. At most one call per completion of [`Self::ready`].
    pub(crate) fn write(&mut self, frame: MakeFrame) {
        if let Some(frames) = &self.frames {
            // Never full after `ready`. An encoder that has failed reports that at the next call.
            let _ = frames.try_send(Message::Frame(frame));
        }
    }

    /// Waits until the video is complete and has its name.
    ///
    /// # Errors
    /// The failure of the encoder; frames that are missing. There is no file then.
    pub(crate) async fn finish(&mut self) -> Result<(), VideoError> {
        if let Some(frames) = self.frames.take() {
            // An encoder that has failed has a result.
            let _ = frames.send(Message::End).await;
        }
        self.result().await
    }

    /// Ends the encoder at once, without a file.
    pub(crate) async fn abort(&mut self) {
        self.frames = None;
        self.process.iter().for_each(kill);
        // The failure is the reason of the abortion, and has been reported.
        let _ = self.result().await;
    }

    async fn result(&mut self) -> Result<(), VideoError> {
        if let Some(failure) = &self.failure {
            return Err(failure.clone());
        }
        let ended = || Err(VideoError::new("the thread that encodes the video has ended"));
        let result = (&mut self.result).await.unwrap_or_else(|_| ended());
        self.failure = result.clone().err().or_else(|| Some(VideoError::new("the video has ended")));
        result
    }
}

impl Drop for VideoWriter {
    fn drop(&mut self) {
        self.frames = None;
        self.process.iter().for_each(kill);
        if let Some(thread) = self.thread.take() {
            // It has removed its temporary file when it has ended. A panic has been reported.
            let _ = thread.join();
        }
    }
}

/// The file of a video.
struct VideoFile {
    temporary: Temporary,
    path: std::path::PathBuf,
    settings: VideoSettings,
}

/// Encodes frames until the end, then gives the file its name.
fn encode(
    file: VideoFile,
    mut encoder: Box<dyn Encoder>,
    mut frames: mpsc::Receiver<Message>,
    encoded: &AtomicU64,
) -> Result<(), VideoError> {
    let VideoFile { temporary, path, settings } = file;
    loop {
        match frames.blocking_recv() {
            Some(Message::Frame(make)) => {
                let frame = make()?;
                if (frame.width, frame.height) != (settings.width, settings.height) {
                    let VideoSettings { width, height, .. } = settings;
                    let RgbImage { width: w, height: h, .. } = frame;
                    return Err(VideoError::new(format!(
                        "a frame has {w}x{h} pixels, the video {width}x{height}"
                    )));
                }
                encoder.add(&frame)?;
                encoded.fetch_add(1, Ordering::Relaxed);
            }
            Some(Message::End) => break,
            None => return Err(VideoError::new("the video was dropped before its last frame")),
        }
    }
    let count = encoded.load(Ordering::Relaxed);
    if count != u64::from(settings.frames) {
        return Err(VideoError::new(format!("the video has {count} of its {} frames", settings.frames)));
    }
    encoder.finish()?;
    let failed = |error: std::io::Error| VideoError::new(format!("{}: {error}", path.display()));
    // Open for writing: Windows flushes no others.
    let written = std::fs::OpenOptions::new().write(true).open(temporary.path()).map_err(failed)?;
    written.sync_all().map_err(failed)?;
    drop(written);
    temporary.rename_to(&path).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::VideoRate;

    fn settings(format: VideoFormat, frames: u32) -> VideoSettings {
        VideoSettings { format, width: 6, height: 4, frames, rate: VideoRate::default() }
    }

    /// A picture of its own for each number.
    fn picture(number: u8) -> RgbImage {
        let pixels = (0..6 * 4 * 3).map(|i: u8| i.wrapping_mul(number.wrapping_mul(7) | 1)).collect();
        RgbImage { width: 6, height: 4, pixels }
    }

    async fn write(path: &Path, settings: VideoSettings, count: u8) -> Result<(), VideoError> {
        let mut writer = VideoWriter::start(path, settings)?;
        for number in 0..count {
            writer.ready().await?;
            writer.write(Box::new(move || Ok(picture(number))));
            assert!(!path.exists(), "the file appears when it is whole");
        }
        writer.finish().await?;
        assert_eq!(writer.encoded(), u64::from(count));
        assert!(writer.ready().await.is_err());
        Ok(())
    }

    #[tokio::test]
    async fn animated_png_has_every_frame_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.apng");
        write(&path, settings(VideoFormat::Apng, 5), 5).await.unwrap();
        let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let control = reader.info().animation_control().copied().unwrap();
        assert_eq!((control.num_frames, control.num_plays), (5, 0));
        for number in 0..5 {
            let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut pixels).unwrap();
            assert_eq!(pixels, picture(number).pixels);
            let control = reader.info().frame_control().copied().unwrap();
            assert_eq!((control.delay_num, control.delay_den), (1, 25));
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[tokio::test]
    async fn a_gif_shows_every_frame() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.gif");
        write(&path, settings(VideoFormat::Gif, 4), 4).await.unwrap();
        let file = std::fs::File::open(&path).unwrap();
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(std::io::BufReader::new(file)).unwrap();
        let mut shown = vec![0; 6 * 4 * 3];
        for number in 0..4 {
            let frame = decoder.read_next_frame().unwrap().unwrap().clone();
            assert_eq!(frame.delay, 4);
            for (at, rgba) in frame.buffer.chunks_exact(4).enumerate() {
                let (x, y) = (at % usize::from(frame.width), at / usize::from(frame.width));
                let first = 3 * ((y + usize::from(frame.top)) * 6 + x + usize::from(frame.left));
                if rgba[3] > 0 {
                    shown[first..first + 3].copy_from_slice(&rgba[..3]);
                }
            }
            assert_eq!(shown, picture(number).pixels, "24 colours are exact");
        }
        assert!(decoder.read_next_frame().unwrap().is_none());
    }

    #[tokio::test]
    async fn an_incomplete_video_leaves_no_file() {
        for format in [VideoFormat::Apng, VideoFormat::Gif] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("a.video");
            let missing = write(&path, settings(format, 5), 4).await.unwrap_err().to_string();
            assert!(missing.contains("4 of its 5"), "{missing}");
            let mut writer = VideoWriter::start(&path, settings(format, 2)).unwrap();
            writer.ready().await.unwrap();
            writer.write(Box::new(|| Ok(picture(0))));
            writer.abort().await;
            let mut writer = VideoWriter::start(&path, settings(format, 2)).unwrap();
            writer.ready().await.unwrap();
            writer.write(Box::new(|| Ok(RgbImage::new(7, 4))));
            assert!(writer.finish().await.unwrap_err().to_string().contains("7x4"));
            drop(VideoWriter::start(&path, settings(format, 2)).unwrap());
            assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        }
    }

    #[tokio::test]
    async fn a_frame_that_fails_ends_the_video() {
        let folder = tempfile::tempdir().unwrap();
        let mut writer =
            VideoWriter::start(&folder.path().join("a.apng"), settings(VideoFormat::Apng, 9)).unwrap();
        writer.write(Box::new(|| Err(VideoError::new("no frame"))));
        let failure = async {
            while writer.ready().await.is_ok() {
                writer.write(Box::new(|| Ok(picture(1))));
            }
            writer.ready().await.unwrap_err().to_string()
        };
        assert_eq!(failure.await, "no frame");
    }

    #[test]
    fn rates_that_a_gif_does_not_have_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let rate = VideoRate::parse("60").unwrap();
        let settings = VideoSettings { rate, ..settings(VideoFormat::Gif, 2) };
        let message = VideoWriter::start(&folder.path().join("a.gif"), settings).unwrap_err().to_string();
        assert!(message.contains("50") && message.contains(".apng"), "{message}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
