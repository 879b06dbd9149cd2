//! `--trace FILE`: the timeline of a run as trace events, for Perfetto or chrome://tracing.
//!
//! The format is the JSON array of Chrome's trace event format: one track for the master's frames and one for each
//! worker, complete events (`"ph":"X"`), times in microseconds since the farm was started.
//!
//! Whoever has something to tell never waits for the disk: marks go through a bounded queue to a thread that writes,
//! and what the queue has no room for is left out, and counted. After each piece the array is closed, and the next
//! piece overwrites the closing: between two writes the file is valid JSON, whatever ends the process there.

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
use crate::error::CommandError;

/// Marks between those who tell and the thread that writes.
const QUEUE: usize = 1 << 16;
/// Marks are written together that come within this time.
const GATHER: Duration = Duration::from_millis(50);
/// Bytes that are written at once.
const PIECE_BYTES: usize = 1 << 18;
const OPENING: &[u8] = b"[\n";
const CLOSING: &[u8] = b"\n]\n";
const PROCESS: u32 = 1;
const MASTER_TRACK: u64 = 0;

/// A trace that is being written.
pub(crate) struct TraceFile {
    sink: TraceSink,
    writer: JoinHandle<io::Result<()>>,
    name: String,
}

/// Where marks go.
#[derive(Clone, Debug)]
pub(crate) struct TraceSink {
    queue: SyncSender<Message>,
    lost: Arc<AtomicU64>,
}

#[derive(Debug)]
enum Message {
    Mark(Mark),
    End,
}

impl TraceFile {
    /// Creates the file: an empty trace, which is valid already.
    ///
    /// # Errors
    /// A place that cannot be written, or is no file on a disk.
    pub(crate) fn create(path: &Path) -> Result<Self, CommandError> {
        let name = path.display().to_string();
        let refuse = |problem: String| CommandError::WrongInput(format!("{name}: {problem}"));
        let file = File::create(path).map_err(|error| refuse(format!("cannot write the trace: {error}")))?;
        if !file.metadata().is_ok_and(|metadata| metadata.is_file()) {
            return Err(refuse(
                "a trace goes to a file on a disk, because its end is overwritten".to_owned(),
            ));
        }
        let mut events = Events::begin(file).map_err(|error| refuse(error.to_string()))?;
        let (queue, marks) = sync_channel(QUEUE);
        let sink = TraceSink { queue, lost: Arc::default() };
        let lost = Arc::clone(&sink.lost);
        let writer = std::thread::Builder::new()
            .name("trace".to_owned())
            .spawn(move || events.write_all(&marks, &lost))
            .map_err(CommandError::failed)?;
        Ok(Self { sink, writer, name })
    }

    /// Where marks go.
    pub(crate) fn sink(&self) -> TraceSink {
        self.sink.clone()
    }

    /// Waits until everything told so far is on the disk.
    ///
    /// # Errors
    /// A full disk, for one; what was written before is a valid trace.
    pub(crate) fn finish(self) -> Result<(), CommandError> {
        // It fails where the thread has ended with an error, which comes next.
        let _ = self.sink.queue.send(Message::End);
        let written = self.writer.join().unwrap_or_else(|_| Err(io::Error::other("the writer failed")));
        let lost = self.sink.lost.load(Relaxed);
        if lost > 0 {
            tracing::warn!("{}: {lost} events are left out, because the disk was too slow", self.name);
        }
        written.map_err(|error| CommandError::Failed(format!("{}: {error}", self.name)))
    }
}

impl TraceSink {
    /// Takes a mark, or counts it where there is no room.
    pub(crate) fn tell(&self, mark: Mark) {
        if self.queue.try_send(Message::Mark(mark)).is_err() {
            self.lost.fetch_add(1, Relaxed);
        }
    }
}

/// The array of events on its way to the disk.
struct Events<W> {
    out: W,
    /// Where the closing stands.
    end: u64,
    piece: Vec<u8>,
    empty: bool,
}

impl<W: Write + Seek> Events<W> {
    fn begin(out: W) -> io::Result<Self> {
        let mut events = Self { out, end: 0, piece: OPENING.to_vec(), empty: true };
        events.add(&metadata("process_name", MASTER_TRACK, json!({ "name": "rayfarm" })));
        events.add(&metadata("thread_name", MASTER_TRACK, json!({ "name": "master: frames" })));
        events.put()?;
        Ok(events)
    }

    /// Writes what comes until the end is told, or nobody is left to tell it.
    fn write_all(&mut self, marks: &Receiver<Message>, lost: &AtomicU64) -> io::Result<()> {
        while let Ok(first) = marks.recv() {
            let mut next = Some(first);
            while let Some(message) = next {
                match message {
                    Message::Mark(mark) => self.add_mark(&mark),
                    Message::End => {
                        self.add_lost(lost.load(Relaxed));
                        return self.put();
                    }
                }
                if self.piece.len() >= PIECE_BYTES {
                    self.put()?;
                }
                next = marks.try_recv().ok();
            }
            self.put()?;
            std::thread::sleep(GATHER);
        }
        Ok(())
    }

    fn add_mark(&mut self, mark: &Mark) {
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
            self.piece.extend_from_slice(b",\n");
        }
        self.piece.extend_from_slice(event.to_string().as_bytes());
    }

    /// Writes the piece and the closing over the closing before.
    fn put(&mut self) -> io::Result<()> {
        let next_end = self.end + self.piece.len() as u64;
        self.piece.extend_from_slice(CLOSING);
        self.out.seek(SeekFrom::Start(self.end))?;
        self.out.write_all(&self.piece)?;
        self.out.flush()?;
        self.end = next_end;
        self.piece.clear();
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
    use crate::scheduler::WorkerId;

    fn frame(number: u64) -> Mark {
        let at = Duration::from_millis(number);
        let what = What::Frame { frame: FrameId(number), elapsed: at };
        Mark::Span(Span { worker: None, from: at, to: at + Duration::from_nanos(1_000_500), what })
    }

    fn parsed(path: &Path) -> Vec<Value> {
        serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
    }

    #[test]
    fn a_trace_is_valid_from_its_first_byte_to_its_last() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trace.json");
        let trace = TraceFile::create(&path).unwrap();
        assert_eq!(parsed(&path).len(), 2);
        let sink = trace.sink();
        let name = "a \"quoted\"\nname".to_owned();
        sink.tell(Mark::Named { worker: WorkerId(7), name, threads: 2 });
        (0..100).for_each(|number| sink.tell(frame(number)));
        trace.finish().unwrap();
        let events = parsed(&path);
        assert_eq!(events.len(), 2 + 2 + 100);
        assert_eq!(events[2]["args"]["name"], "worker 7: a \"quoted\"\nname, 2 threads");
        assert_eq!((&events[5]["ts"], &events[5]["dur"]), (&json!(1000.0), &json!(1000.5)));
        sink.tell(frame(1));
    }

    #[test]
    fn every_piece_leaves_a_whole_array() {
        let mut events = Events::begin(io::Cursor::new(Vec::new())).unwrap();
        for number in 0..20 {
            (0..number % 4).for_each(|_| events.add_mark(&frame(number)));
            events.put().unwrap();
            let array: Vec<Value> = serde_json::from_slice(events.out.get_ref()).unwrap();
            assert_eq!(array.len() as u64, 2 + (0..=number).map(|n| n % 4).sum::<u64>());
        }
    }

    #[test]
    fn places_without_an_end_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        assert!(TraceFile::create(folder.path()).is_err());
        if cfg!(unix) {
            let error = TraceFile::create(Path::new("/dev/null")).err().unwrap().to_string();
            assert!(error.contains("/dev/null") && error.contains("file on a disk"), "{error}");
        }
    }
}
