//! Counters of a simulated run: where the computing power of the workers went.

use serde::Serialize;

use super::clock::SECOND;

/// Frame times, and the use of the power of all workers together. The shares `useful`, `cutting`, `wasted`,
/// `leases` and `idle` sum to 1.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Measured {
    /// Frames measured.
    pub frames: u64,
    /// Frames per second.
    pub fps: f64,
    /// Frames per second if all power were useful.
    pub ideal_fps: f64,
    /// Share of the power that became picture: the efficiency.
    pub useful: f64,
    /// Share that cutting tile bands added to tracing.
    pub cutting: f64,
    /// Share spent on rows that were done already or that no frame needed any more.
    pub wasted: f64,
    /// Share that leases cost besides tracing.
    pub leases: f64,
    /// Share of idle time.
    pub idle: f64,
    /// The part of `idle` after the last row of a frame was leased.
    pub idle_tail: f64,
    /// Mean time from a frame's first lease to its last row, in milliseconds.
    pub frame_ms: f64,
    /// Longest such time, in milliseconds.
    pub worst_frame_ms: f64,
    /// Mean time from a request to its picture, in milliseconds.
    pub latency_ms: f64,
    /// Leases granted per frame.
    pub segments: f64,
    /// Leases of rows that were leased before, per frame.
    pub repeated: f64,
    /// Share of the time in which the master's link carries pixels.
    pub link: f64,
    /// Share of the time in which the master handles messages.
    pub master: f64,
}

/// Sums since the last restart.
#[derive(Clone, Debug, Default)]
pub(crate) struct Counters {
    since: u64,
    /// Speed of all workers, and of the threads that trace now.
    pub(crate) power: f64,
    tracing: f64,
    updated_at: u64,
    /// Integrals over time, in work.
    idle: f64,
    pub(crate) cutting: f64,
    traced: f64,
    pub(crate) leases: f64,
    idle_tails: f64,
    pub(crate) frames: u64,
    pub(crate) segments: u64,
    pub(crate) repeated: u64,
    frame_ns: u64,
    worst_ns: u64,
    latency_ns: u64,
    pub(crate) banned: u64,
    pub(crate) wrong_frames: u64,
    pub(crate) link_ns: f64,
    pub(crate) master_ns: f64,
}

impl Counters {
    /// Resets all sums.
    pub(crate) fn restart(&mut self, now: u64) {
        let (power, tracing) = (self.power, self.tracing);
        *self = Self { since: now, updated_at: now, power, tracing, ..Self::default() };
    }

    /// Adds a tracing thread of this speed, or removes it where the speed is negative.
    pub(crate) fn trace(&mut self, now: u64, speed: f64) {
        self.update(now);
        self.tracing += speed;
    }

    fn update(&mut self, now: u64) {
        let seconds = now.saturating_sub(self.updated_at) as f64 / SECOND as f64;
        self.idle += seconds * (self.power - self.tracing);
        self.traced += seconds * self.tracing;
        self.updated_at = now;
    }

    /// Idle work until `now`.
    pub(crate) fn idle(&mut self, now: u64) -> f64 {
        self.update(now);
        self.idle
    }

    /// Counts a complete frame. `idle_before` is the idle work until its last row was leased.
    pub(crate) fn complete(&mut self, now: u64, idle_before: f64, elapsed_ns: u64, latency_ns: u64) {
        self.idle_tails += (self.idle(now) - idle_before).max(0.0);
        self.frames += 1;
        self.frame_ns += elapsed_ns;
        self.worst_ns = self.worst_ns.max(elapsed_ns);
        self.latency_ns += latency_ns;
    }

    /// All counters since the restart. `work` is that of one frame.
    pub(crate) fn measured(&mut self, now: u64, work: f64) -> Measured {
        self.update(now);
        let ns = now.saturating_sub(self.since).max(1) as f64;
        let all = self.power * ns / SECOND as f64;
        let frames = self.frames.max(1) as f64;
        let useful = work * self.frames as f64;
        Measured {
            frames: self.frames,
            fps: self.frames as f64 * SECOND as f64 / ns,
            ideal_fps: self.power / work,
            useful: useful / all,
            cutting: self.cutting / all,
            wasted: (self.traced - useful - self.cutting - self.leases) / all,
            leases: self.leases / all,
            idle: self.idle / all,
            idle_tail: self.idle_tails / all,
            frame_ms: self.frame_ns as f64 / frames / 1e6,
            worst_frame_ms: self.worst_ns as f64 / 1e6,
            latency_ms: self.latency_ns as f64 / frames / 1e6,
            segments: self.segments as f64 / frames,
            repeated: self.repeated as f64 / frames,
            link: self.link_ns / ns,
            master: self.master_ns / ns,
        }
    }
}
