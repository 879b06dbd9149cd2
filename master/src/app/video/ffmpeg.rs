//! MP4 and WebM through the program ffmpeg, which reads raw frames from its standard input.

use std::io::{ErrorKind, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStderr, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use rayfarm_text::printable;
use rayfarm_tracer::image::RgbImage;

use super::{Encoder, VideoError, VideoFormat, VideoSettings};

const PROGRAM: &str = "ffmpeg";
/// Bytes that are kept of the last messages of ffmpeg.
const MAX_MESSAGES: usize = 2048;
/// Interval between checks whether ffmpeg has ended.
const POLL_EVERY: Duration = Duration::from_millis(5);
/// Time that ffmpeg has to end after it has closed its input.
const END_TIMEOUT: Duration = Duration::from_secs(5);

/// Reason for which ffmpeg cannot be run, and the remedy.
pub(super) fn refusal() -> Option<String> {
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let name = format!("{PROGRAM}{}", std::env::consts::EXE_SUFFIX);
    let is_installed = std::env::split_paths(&paths).any(|folder| folder.join(&name).is_file());
    (!is_installed).then(|| {
        "ffmpeg encodes .mp4 and .webm, and there is no program of that name in the folders of PATH: install it (as with apt \
         install ffmpeg, brew install ffmpeg or winget install ffmpeg), or write .gif or .apng, which need no other program"
            .to_owned()
    })
}

/// The running program, which another thread may end.
pub(super) type Process = Arc<Mutex<Child>>;

/// Ends a program at once, if it still runs.
pub(super) fn kill(process: &Process) {
    let mut child = process.lock().unwrap_or_else(PoisonError::into_inner);
    if !matches!(child.try_wait(), Ok(Some(_))) {
        // A failure means that it has just ended.
        let _ = child.kill();
        let _ = child.wait();
    }
}

/// An encoder that passes frames to ffmpeg. It is killed when dropped before its end.
pub(super) struct FfmpegEncoder {
    process: Process,
    input: Option<ChildStdin>,
    messages: Option<JoinHandle<String>>,
    frames: u64,
}

impl FfmpegEncoder {
    /// Starts ffmpeg, which writes a file at `path`, an absolute one.
    pub(super) fn start(path: &Path, settings: &VideoSettings) -> Result<Self, VideoError> {
        let mut command = Command::new(PROGRAM);
        command.args(arguments(settings)).arg(path);
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        // Ctrl-C is for the master, which ends ffmpeg itself.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn().map_err(|error| match error.kind() {
            ErrorKind::NotFound => VideoError::new(refusal().unwrap_or_else(|| error.to_string())),
            _ => VideoError::new(format!("ffmpeg cannot be started: {error}")),
        })?;
        let input = child.stdin.take();
        let messages = child.stderr.take().map(|stderr| std::thread::spawn(move || last_messages(stderr)));
        Ok(Self { process: Arc::new(Mutex::new(child)), input, messages, frames: 0 })
    }

    /// The program, for a thread that ends it.
    pub(super) fn process(&self) -> Process {
        self.process.clone()
    }

    /// Waits until ffmpeg has ended, and kills it after a limited time.
    fn wait(&self, timeout: Duration) -> Result<ExitStatus, VideoError> {
        let mut waited = Duration::ZERO;
        loop {
            // The lock is released in between: another thread may kill the process.
            let state = self.process.lock().unwrap_or_else(PoisonError::into_inner).try_wait();
            match state {
                Ok(Some(status)) => return Ok(status),
                Ok(None) if waited >= timeout => kill(&self.process),
                Ok(None) => std::thread::sleep(POLL_EVERY),
                Err(error) => return Err(VideoError::new(format!("cannot wait for ffmpeg: {error}"))),
            }
            waited += POLL_EVERY;
        }
    }

    /// The failure of ffmpeg, with its last messages.
    fn failure(&mut self, status: ExitStatus, cause: &str) -> VideoError {
        let messages = self.messages.take().and_then(|thread| thread.join().ok()).unwrap_or_default();
        let said = match messages.trim() {
            "" => "it reported nothing".to_owned(),
            messages => format!("it reported: {messages}"),
        };
        VideoError::new(format!("ffmpeg ended after {} frames {cause} ({status}); {said}", self.frames))
    }
}

impl Encoder for FfmpegEncoder {
    fn add(&mut self, frame: &RgbImage) -> Result<(), VideoError> {
        let Some(input) = &mut self.input else { return Err(VideoError::new("the video has ended")) };
        if let Err(error) = input.write_all(&frame.pixels) {
            self.input = None;
            let status = self.wait(END_TIMEOUT)?;
            return Err(self.failure(status, &format!("and did not read the next one: {error}")));
        }
        self.frames += 1;
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<(), VideoError> {
        // The end of its input is the end of the video.
        self.input = None;
        let status = self.wait(Duration::MAX)?;
        if status.success() { Ok(()) } else { Err(self.failure(status, "without a video")) }
    }
}

impl Drop for FfmpegEncoder {
    fn drop(&mut self) {
        self.input = None;
        kill(&self.process);
    }
}

/// Arguments of ffmpeg before the name of the file.
fn arguments(settings: &VideoSettings) -> Vec<String> {
    let VideoSettings { format, width, height, rate, .. } = *settings;
    // Both formats halve the resolution of colours, which needs an even width and height.
    let pad = if width % 2 + height % 2 > 0 { "pad=ceil(iw/2)*2:ceil(ih/2)*2," } else { "" };
    let filter = format!(
        "{pad}scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+full_chroma_int,format=yuv420p"
    );
    let input = format!(
        "-hide_banner -loglevel error -nostdin -y -f rawvideo -pixel_format rgb24 -video_size {width}x{height} \
         -framerate {rate} -i pipe:0 -an -vf {filter} -colorspace bt709 -color_primaries bt709 -color_trc iec61966-2-1 \
         -color_range tv"
    );
    let output = match format {
        VideoFormat::WebM => "-c:v libvpx-vp9 -crf 24 -b:v 0 -row-mt 1 -f webm",
        _ => "-c:v libx264 -crf 18 -preset medium -movflags +faststart -f mp4",
    };
    input.split_whitespace().chain(output.split_whitespace()).map(str::to_owned).collect()
}

/// The last messages of ffmpeg, printable.
fn last_messages(mut stderr: ChildStderr) -> String {
    let (mut last, mut buffer) = (Vec::new(), [0; 1024]);
    while let Ok(count) = stderr.read(&mut buffer) {
        if count == 0 {
            break;
        }
        last.extend_from_slice(buffer.get(..count).unwrap_or_default());
        last.drain(..last.len().saturating_sub(MAX_MESSAGES));
    }
    let text = String::from_utf8_lossy(&last);
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    printable(&lines.collect::<Vec<_>>().join("; ")).into_owned()
}
