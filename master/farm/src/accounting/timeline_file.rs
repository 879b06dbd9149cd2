//! A file with the timeline of a run, as trace events for Perfetto or chrome://tracing.
//!
//! The format is the JSON array of Chrome's trace event format: one track for the master's frames and one for each
//! worker, complete events (`"ph":"X"`), times in microseconds since the farm was started.
//!
//! Recording never waits for the disk: marks go through a bounded queue to a writing thread, and marks that find the queue
//! full are dropped and counted. Each write ends with the closing bracket of the array, which the next write overwrites:
//! the file is valid JSON between two writes, even if the process is killed.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

use rayfarm_protocol::Lease;
use serde_json::{Value, json};

use super::span::{Mark, Span, What};

/// Capacity of the queue to the writing thread, in marks.
const QUEUE: usize = 1 << 16;
/// Marks that arrive within this time are written together.
const GATHER: Duration = Duration::from_millis(50);
/// Size from which a chunk is written at once.
const CHUNK_BYTES: usize = 1 << 18;
const OPENING: &[u8] = b"[\n";
const CLOSING: &[u8] = b"\n]\n";
const PROCESS: u32 = 1;
const MASTER_TRACK: u64 = 0;

/// Why a timeline cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum TimelineError {
    /// The file cannot be created.
    #[error("{name}: cannot write the timeline: {source}")]
    Create {
        /// The path, as given.
        name: String,
        /// The operating system's error.
        source: io::Error,
    },
    /// The path names a pipe or a device. The end of the file is overwritten, which only a regular file supports.
    #[error("{name}: a timeline needs a regular file, because its end is overwritten")]
    NotSeekable {
        /// The path, as given.
        name: String,
    },
    /// The writing thread cannot be started.
    #[error(transparent)]
    Thread(io::Error),
    /// Writing has failed; the events before that are a valid timeline.
    #[error("{name}: {source}")]
    Write {
        /// The path, as given.
        name: String,
        /// The operating system's error.
        source: io::Error,
    },
}

/// A timeline that is being written.
pub struct TimelineFile {
    sink: TimelineSink,
    writer: JoinHandle<io::Result<()>>,
    name: String,
}

/// The writing thread's queue.
#[derive(Clone, Debug)]
pub struct TimelineSink {
    queue: SyncSender<Message>,
    lost: Arc<AtomicU64>,
}

#[derive(Debug)]
enum Message {
    Mark(Mark),
    End,
}

impl TimelineFile {
    /// Creates a file with an empty timeline, and starts its writing thread. The file ends with a last event near
    /// `max_bytes` bytes; later marks are counted and not written.
    ///
    /// # Errors
    /// The file cannot be written, or is not a regular file.
    pub fn create(path: &Path, max_bytes: u64) -> Result<Self, TimelineError> {
        let name = path.display().to_string();
        let failed = |source| TimelineError::Create { name: name.clone(), source };
        let file = File::create(path).map_err(failed)?;
        if !file.metadata().is_ok_and(|metadata| metadata.is_file()) {
            return Err(TimelineError::NotSeekable { name });
        }
        let mut events = Events::begin(file, max_bytes).map_err(failed)?;
        let (queue, marks) = sync_channel(QUEUE);
        let sink = TimelineSink { queue, lost: Arc::default() };
        let lost = Arc::clone(&sink.lost);
        let writer = std::thread::Builder::new()
            .name("timeline".to_owned())
            .spawn(move || events.write_all(&marks, &lost))
            .map_err(TimelineError::Thread)?;
        Ok(Self { sink, writer, name })
    }

    /// A handle to record marks with.
    pub fn sink(&self) -> TimelineSink {
        self.sink.clone()
    }

    /// Writes all recorded marks and closes the file.
    ///
    /// # Errors
    /// Writing fails, for example because the disk is full. The file then has a valid timeline of earlier events.
    pub fn finish(self) -> Result<(), TimelineError> {
        // Sending fails if the thread has ended with an error, which `join` returns.
        let _ = self.sink.queue.send(Message::End);
        let written = self.writer.join().unwrap_or_else(|_| Err(io::Error::other("the writer failed")));
        let lost = self.sink.lost.load(Relaxed);
        if lost > 0 {
            tracing::warn!("{}: {lost} events are left out, because the disk was too slow", self.name);
        }
        written.map_err(|source| TimelineError::Write { name: self.name, source })
    }
}

impl TimelineSink {
    /// Records a mark, or counts it as dropped if the queue is full.
    pub(crate) fn record(&self, mark: Mark) {
        if self.queue.try_send(Message::Mark(mark)).is_err() {
            self.lost.fetch_add(1, Relaxed);
        }
    }
}

/// The JSON array of events.
struct Events<W> {
    out: W,
    /// Offset of the closing bracket in the file.
    end: u64,
    chunk: Vec<u8>,
    empty: bool,
    /// Size of the file from which no more marks are written.
    max_bytes: u64,
    /// Marks that are not written because the file has reached that size.
    beyond: u64,
}

impl<W: Write + Seek> Events<W> {
    fn begin(out: W, max_bytes: u64) -> io::Result<Self> {
        let chunk = OPENING.to_vec();
        let mut events = Self { out, end: 0, chunk, empty: true, max_bytes, beyond: 0 };
        events.add(&metadata("process_name", MASTER_TRACK, json!({ "name": "rayfarm" })));
        events.add(&metadata("thread_name", MASTER_TRACK, json!({ "name": "master: frames" })));
        events.put()?;
        Ok(events)
    }

    /// Writes marks until [`Message::End`], or until all senders are dropped.
    fn write_all(&mut self, marks: &Receiver<Message>, lost: &AtomicU64) -> io::Result<()> {
        while let Ok(first) = marks.recv() {
            let mut next = Some(first);
            while let Some(message) = next {
                match message {
                    Message::Mark(mark) => self.add_mark(&mark),
                    Message::End => {
                        self.add_lost(lost.load(Relaxed).saturating_add(self.beyond));
                        return self.put();
                    }
                }
                if self.chunk.len() >= CHUNK_BYTES {
                    self.put()?;
                }
                next = marks.try_recv().ok();
            }
            self.put()?;
            std::thread::sleep(GATHER);
        }
        Ok(())
    }

    /// Adds a mark, or counts it once the file has its largest size.
    fn add_mark(&mut self, mark: &Mark) {
        if self.end + self.chunk.len() as u64 >= self.max_bytes {
            if self.beyond == 0 {
                let bytes = self.max_bytes;
                tracing::warn!(
                    "the timeline has reached its limit of {bytes} bytes; later events are left out"
                );
                self.add(&metadata("limit_reached", MASTER_TRACK, json!({ "bytes": bytes })));
            }
            self.beyond += 1;
            return;
        }
        match mark {
            Mark::Named { worker, name, threads } => {
                let label = format!("{worker}: {name}, {threads} threads");
                self.add(&metadata("thread_name", worker.0, json!({ "name": label })));
                self.add(&metadata("thread_sort_index", worker.0, json!({ "sort_index": worker.0 })));
            }
            Mark::Span(span) => self.add(&complete(span)),
        }
    }

    fn add_lost(&mut self, lost: u64) {
        if lost > 0 {
            self.add(&metadata("left_out", MASTER_TRACK, json!({ "events": lost })));
        }
    }

    fn add(&mut self, event: &Value) {
        if !std::mem::replace(&mut self.empty, false) {
            self.chunk.extend_from_slice(b",\n");
        }
        self.chunk.extend_from_slice(event.to_string().as_bytes());
    }

    /// Writes the chunk and a closing bracket, over the previous closing bracket.
    fn put(&mut self) -> io::Result<()> {
        let next_end = self.end + self.chunk.len() as u64;
        self.chunk.extend_from_slice(CLOSING);
        self.out.seek(SeekFrom::Start(self.end))?;
        self.out.write_all(&self.chunk)?;
        self.out.flush()?;
        self.end = next_end;
        self.chunk.clear();
        Ok(())
    }
}

fn metadata(name: &str, track: u64, args: Value) -> Value {
    json!({ "name": name, "ph": "M", "pid": PROCESS, "tid": track, "args": args })
}

fn complete(span: &Span) -> Value {
    let (name, category, args) = match span.what {
        What::Frame { frame, elapsed } => {
            (format!("frame {frame}"), "frame", json!({ "ms_since_its_first_lease": ms(elapsed) }))
        }
        What::Segment { lease, bytes } => {
            let Lease { frame, segment, attempt, first_row, row_count } = lease;
            let args = json!({ "frame": frame.0, "segment": segment, "attempt": attempt, "bytes": bytes });
            let last_row = u64::from(first_row) + u64::from(row_count.saturating_sub(1));
            (format!("rows {first_row} to {last_row}"), "segment", args)
        }
        What::Part(name) => (name.to_owned(), "part", json!({})),
    };
    json!({
        "name": name,
        "cat": category,
        "ph": "X",
        "ts": us(span.from),
        "dur": us(span.to.saturating_sub(span.from)),
        "pid": PROCESS,
        "tid": span.worker.map_or(MASTER_TRACK, |worker| worker.0),
        "args": args,
    })
}

/// Whole nanoseconds as microseconds.
fn us(time: Duration) -> f64 {
    time.as_nanos() as f64 / 1e3
}

fn ms(time: Duration) -> f64 {
    time.as_nanos() as f64 / 1e6
}

#[cfg(test)]
mod tests {
    use rayfarm_protocol::FrameId;

    use super::*;
    use rayfarm_scheduler::WorkerId;

    fn frame(number: u64) -> Mark {
        let at = Duration::from_millis(number);
        let what = What::Frame { frame: FrameId(number), elapsed: at };
        Mark::Span(Span { worker: None, from: at, to: at + Duration::from_nanos(1_000_500), what })
    }

    fn parsed(path: &Path) -> Vec<Value> {
        serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
    }

    #[test]
    fn a_timeline_is_always_valid() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("timeline.json");
        let timeline = TimelineFile::create(&path, u64::MAX).unwrap();
        assert_eq!(parsed(&path).len(), 2);
        let sink = timeline.sink();
        let name = "a \"quoted\"\nname".to_owned();
        sink.record(Mark::Named { worker: WorkerId(7), name, threads: 2 });
        (0..100).for_each(|number| sink.record(frame(number)));
        timeline.finish().unwrap();
        let events = parsed(&path);
        assert_eq!(events.len(), 2 + 2 + 100);
        assert_eq!(events[2]["args"]["name"], "worker 7: a \"quoted\"\nname, 2 threads");
        assert_eq!((&events[5]["ts"], &events[5]["dur"]), (&json!(1000.0), &json!(1000.5)));
        sink.record(frame(1));
    }

    #[test]
    fn each_write_leaves_a_valid_array() {
        let mut events = Events::begin(io::Cursor::new(Vec::new()), u64::MAX).unwrap();
        for number in 0..20 {
            (0..number % 4).for_each(|_| events.add_mark(&frame(number)));
            events.put().unwrap();
            let array: Vec<Value> = serde_json::from_slice(events.out.get_ref()).unwrap();
            assert_eq!(array.len() as u64, 2 + (0..=number).map(|n| n % 4).sum::<u64>());
        }
    }

    #[test]
    fn a_timeline_ends_at_its_limit_and_counts_the_rest() {
        let mut events = Events::begin(io::Cursor::new(Vec::new()), 2_000).unwrap();
        let (sender, marks) = sync_channel(2_000);
        (0..1_000).for_each(|number| sender.send(Message::Mark(frame(number))).unwrap());
        sender.send(Message::End).unwrap();
        events.write_all(&marks, &AtomicU64::new(0)).unwrap();
        let bytes = events.out.get_ref();
        assert!(bytes.len() < 2_600, "{} bytes", bytes.len());
        let array: Vec<Value> = serde_json::from_slice(bytes).unwrap();
        let frames = array.iter().filter(|event| event["cat"] == "frame").count() as u64;
        assert!(frames > 0);
        let named = |name: &str| array.iter().filter(|event| event["name"] == name).collect::<Vec<_>>();
        assert_eq!(named("limit_reached").len(), 1);
        assert_eq!(named("left_out")[0]["args"]["events"], 1_000 - frames);
    }

    #[test]
    fn only_regular_files_are_accepted() {
        let folder = tempfile::tempdir().unwrap();
        assert!(TimelineFile::create(folder.path(), u64::MAX).is_err());
        if cfg!(unix) {
            let error = TimelineFile::create(Path::new("/dev/null"), u64::MAX).err().unwrap().to_string();
            assert!(error.contains("/dev/null"), "{error}");
        }
    }
}
