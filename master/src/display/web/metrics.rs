//! Figures in the text format of Prometheus. docs/operations.md lists the names.

use std::collections::BTreeMap;
use std::fmt::{Display, Write};

use rayfarm_farm::FarmStatus;
use rayfarm_farm::accounting::PART_NAMES;

use super::pictures::EncoderWork;
use crate::viewer::Statistics;

/// Content type of the format.
pub(super) const CONTENT_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";

/// Text with one family of samples after the other.
#[derive(Debug, Default)]
struct Families(String);

impl Families {
    /// Begins a family. `kind`: `counter` or `gauge`.
    fn begin(&mut self, name: &str, kind: &str, help: &str) {
        // Writing to a string does not fail.
        let _ = writeln!(self.0, "# HELP {name} {help}\n# TYPE {name} {kind}");
    }

    /// Adds a sample with labels.
    fn sample(&mut self, name: &str, labels: &[(&str, &str)], value: impl Display) {
        let label = |(name, value): &(&str, &str)| format!("{name}=\"{}\"", escaped(value));
        let labels: Vec<String> = labels.iter().map(label).collect();
        let labels = if labels.is_empty() { String::new() } else { format!("{{{}}}", labels.join(",")) };
        let _ = writeln!(self.0, "{name}{labels} {value}");
    }

    /// Adds a family of one sample.
    fn single(&mut self, name: &str, kind: &str, help: &str, value: impl Display) {
        self.begin(name, kind, help);
        self.sample(name, &[], value);
    }
}

/// Escaped value of a label. The name of a worker may have any characters.
fn escaped(value: &str) -> String {
    value.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}

/// All figures now; `clients`: number of open pages.
pub(super) fn metrics(
    statistics: &Statistics,
    farm: &FarmStatus,
    encoder: &[EncoderWork],
    clients: usize,
) -> String {
    let mut text = Families::default();
    text.begin("rayfarm_build_info", "gauge", "Version of the master; the value is 1.");
    text.sample("rayfarm_build_info", &[("version", env!("CARGO_PKG_VERSION"))], 1);
    of_view(statistics, &mut text);
    of_farm(farm, &mut text);
    of_workers(statistics, farm, &mut text);
    of_pages(encoder, clients, &mut text);
    text.0
}

fn of_view(statistics: &Statistics, text: &mut Families) {
    text.single("rayfarm_frames_total", "counter", "Completed frames.", statistics.completed);
    text.single(
        "rayfarm_frames_per_second",
        "gauge",
        "Frames per second over about a second.",
        statistics.fps,
    );
    let frame_time = statistics.frame_time.as_secs_f64();
    text.single("rayfarm_frame_duration_seconds", "gauge", "Mean time of a frame.", frame_time);
    if let Some(latency) = statistics.latency {
        let help = "Median time from an input to its picture on the screen.";
        text.single("rayfarm_input_latency_seconds", "gauge", help, latency.as_secs_f64());
    }
    let help = "Whether the picture is complete and nothing moves.";
    text.single("rayfarm_view_at_rest", "gauge", help, u8::from(statistics.resting));
}

fn of_farm(farm: &FarmStatus, text: &mut Families) {
    let mut states: BTreeMap<String, u64> = BTreeMap::new();
    for worker in &farm.workers {
        *states.entry(worker.state.to_string()).or_default() += 1;
    }
    text.begin("rayfarm_workers", "gauge", "Connected workers by state.");
    for state in ["working", "paused", "draining", "resting", "silent"] {
        text.sample("rayfarm_workers", &[("state", state)], states.get(state).copied().unwrap_or(0));
    }
    text.single("rayfarm_kicked_workers", "gauge", "Banned workers.", farm.banned.len());
    let help = "Finished frames with rows of workers that sent wrong pixels.";
    text.single("rayfarm_wrong_frames_total", "counter", help, farm.wrong_frames);
    let totals = &farm.totals;
    text.single("rayfarm_sent_bytes_total", "counter", "Bytes sent to workers.", totals.sent_bytes);
    text.single(
        "rayfarm_received_bytes_total",
        "counter",
        "Bytes received from workers.",
        totals.received_bytes,
    );
    let help = "The part of the sent bytes that describes what to draw.";
    text.single("rayfarm_scene_bytes_total", "counter", help, totals.scene_bytes);
    text.single("rayfarm_pending_connections", "gauge", "Connections in their handshake.", farm.pending);
    let help = "Connections that were closed in their handshake for others.";
    text.single("rayfarm_refused_connections_total", "counter", help, farm.refused);
    if let Some(verification) = farm.verification {
        let help = "Segments that were rendered twice and compared.";
        text.single("rayfarm_verified_segments_total", "counter", help, verification.verified);
        let help = "Segments whose renderings differed.";
        text.single("rayfarm_mismatched_segments_total", "counter", help, verification.mismatches);
    }
}

fn of_workers(statistics: &Statistics, farm: &FarmStatus, text: &mut Families) {
    let ids: Vec<String> = farm.workers.iter().map(|worker| worker.id.to_string()).collect();
    let workers = || farm.workers.iter().zip(&ids);
    text.begin("rayfarm_worker_threads", "gauge", "Render threads of a worker.");
    for (worker, id) in workers() {
        text.sample("rayfarm_worker_threads", &[("id", id), ("worker", &worker.name)], worker.threads);
    }
    text.begin("rayfarm_worker_segments_total", "counter", "Segments that a worker has finished.");
    for (worker, id) in workers() {
        let labels = [("id", id.as_str()), ("worker", &worker.name)];
        text.sample("rayfarm_worker_segments_total", &labels, worker.segments_done);
    }
    let help = "Rows of average cost that a worker renders in a second.";
    text.begin("rayfarm_worker_rows_per_second", "gauge", help);
    for (worker, id) in workers() {
        text.sample("rayfarm_worker_rows_per_second", &[("id", id), ("worker", &worker.name)], worker.speed);
    }
    let help = "Share of a worker's thread time by use, over the last seconds in which frames were rendered; 0 to 1.";
    text.begin("rayfarm_worker_thread_time_ratio", "gauge", help);
    for (worker, id) in workers() {
        let Some(account) = statistics.accounts.of(worker.id) else { continue };
        for (part, percent) in PART_NAMES.iter().zip(account.percent) {
            let labels = [("id", id.as_str()), ("worker", &worker.name), ("part", part)];
            text.sample("rayfarm_worker_thread_time_ratio", &labels, percent / 100.0);
        }
    }
}

fn of_pages(encoder: &[EncoderWork], clients: usize, text: &mut Families) {
    text.single("rayfarm_web_clients", "gauge", "Open pages of the web display.", clients);
    text.begin("rayfarm_web_pictures_total", "counter", "Pictures that the web display has encoded.");
    for work in encoder {
        text.sample("rayfarm_web_pictures_total", &[("format", work.format.name())], work.pictures);
    }
    text.begin("rayfarm_web_encoding_seconds_total", "counter", "Time that one core has spent on that.");
    for work in encoder {
        let seconds = work.time.as_secs_f64();
        text.sample("rayfarm_web_encoding_seconds_total", &[("format", work.format.name())], seconds);
    }
    text.begin("rayfarm_web_encoded_bytes_total", "counter", "Bytes of these pictures.");
    for work in encoder {
        text.sample("rayfarm_web_encoded_bytes_total", &[("format", work.format.name())], work.bytes);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::time::Duration;

    use rayfarm_farm::accounting::{Fading, FrameAccount, Parts, WorkerAccount};
    use rayfarm_farm::{Verification, WorkerState, WorkerStatus};

    use super::super::pictures::Format;
    use super::*;

    /// Figures with every family.
    fn everything() -> String {
        let name = "a \"mill\" \\ \n".to_owned();
        let worker = WorkerStatus {
            id: 7,
            name: name.clone(),
            local: false,
            address: ([127, 0, 0, 1], 1).into(),
            threads: 4,
            segments_done: 9,
            speed: 12.5,
            state: WorkerState::Paused,
            last_failure: None,
        };
        let parts = Parts { trace: 3, wait: 1, ..Parts::default() };
        let account = WorkerAccount { id: 7, name, threads: 4, parts, segments: 1, rows: 1, bytes: 1 };
        let account = FrameAccount { workers: vec![account], segments: Vec::new() };
        let mut accounts = Fading::default();
        accounts.add(Duration::from_secs(1), &account);
        let statistics = Statistics {
            latency: Some(Duration::from_millis(20)),
            accounts: accounts.into(),
            ..Statistics::default()
        };
        let verification = Some(Verification { percent: 1, picked: 1, verified: 1, mismatches: 0, open: 0 });
        let farm = FarmStatus { workers: vec![worker], verification, ..FarmStatus::default() };
        let work =
            EncoderWork { format: Format::Jpeg, pictures: 1, time: Duration::from_millis(5), bytes: 10 };
        metrics(&statistics, &farm, &[work], 2)
    }

    #[test]
    fn each_sample_has_a_family_and_a_number() {
        let text = everything();
        let mut family = None;
        for line in text.lines() {
            if let Some(comment) = line.strip_prefix("# ") {
                let words: Vec<&str> = comment.splitn(3, ' ').collect();
                match words[..] {
                    ["HELP", name, help] => {
                        assert!(!help.is_empty());
                        family = Some(name.to_owned());
                    }
                    ["TYPE", name, kind] => {
                        assert_eq!(Some(name), family.as_deref());
                        assert!(["counter", "gauge"].contains(&kind));
                        assert_eq!(kind == "counter", name.ends_with("_total"), "{name}");
                    }
                    _ => panic!("{line}"),
                }
                continue;
            }
            let (sample, value) = line.rsplit_once(' ').unwrap();
            assert!(value.parse::<f64>().unwrap().is_finite(), "{line}");
            let name = sample.split('{').next().unwrap();
            assert_eq!(Some(name), family.as_deref(), "{line}");
        }
        assert!(text.contains(r#"rayfarm_worker_threads{id="7",worker="a \"mill\" \\ \n"} 4"#), "{text}");
        assert!(text.contains(r#"worker="a \"mill\" \\ \n",part="trace"} 0.75"#), "{text}");
        assert!(text.contains("rayfarm_workers{state=\"paused\"} 1"));
    }

    #[test]
    fn the_documentation_lists_all_names_and_no_others() {
        let document = include_str!("../../../../docs/operations.md");
        let spans = document.split('`').skip(1).step_by(2);
        let documented: BTreeSet<&str> = spans.filter(|span| span.starts_with("rayfarm_")).collect();
        let text = everything();
        let names = text.lines().filter_map(|line| line.strip_prefix("# TYPE ")?.split(' ').next());
        assert_eq!(names.collect::<BTreeSet<&str>>(), documented);
    }
}
