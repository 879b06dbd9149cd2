//! Where the workers' power went.

use serde::Serialize;

use super::SECOND;

/// What frames took, and what became of the power of all workers together: the five shares sum to 1.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Measured {
    /// Frames measured.
    pub frames: u64,
    /// Frames a second.
    pub fps: f64,
    /// What the sum of the workers' speeds would reach.
    pub ideal_fps: f64,
    /// Work that became picture, as a share of all that the workers could do: the efficiency.
    pub useful: f64,
    /// Tracing that cutting tiles has added.
    pub cutting: f64,
    /// Rows traced that were here already, or that nobody wanted any more.
    pub wasted: f64,
    /// What leases cost besides tracing.
    pub leases: f64,
    /// Waiting.
    pub idle: f64,
    /// The part of `idle` after the last row of a frame was leased.
    pub idle_tail: f64,
    /// From a frame's first lease to its last row, in milliseconds: the mean and the worst.
    pub frame_ms: f64,
    /// The worst.
    pub worst_frame_ms: f64,
    /// From a request to its picture, in milliseconds, on average.
    pub latency_ms: f64,
    /// Leases granted per frame.
    pub segments: f64,
    /// Leases of rows that were leased before, per frame.
    pub repeated: f64,
    /// How much of the time the master's link carried pixels.
    pub link: f64,
    /// How much of the time the master was busy with messages.
    pub master: f64,
}

/// Sums from one moment on.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tally {
    since: u64,
    /// Speed of all workers, and of those threads that trace now.
    pub(crate) power: f64,
    tracing: f64,
    looked_at: u64,
    /// Integrals over time, in work.
    idle: f64,
    pub(crate) cutting: f64,
    traced: f64,
    pub(crate) leases: f64,
    tails: f64,
    pub(crate) frames: u64,
    pub(crate) segments: u64,
    pub(crate) repeated: u64,
    frame_ns: u64,
    worst_ns: u64,
    latency_ns: u64,
    pub(crate) expelled: u64,
    pub(crate) wrong_frames: u64,
    pub(crate) link_ns: f64,
    pub(crate) master_ns: f64,
}

impl Tally {
    /// Forgets all sums.
    pub(crate) fn restart(&mut self, now: u64) {
        let (power, tracing) = (self.power, self.tracing);
        *self = Self { since: now, looked_at: now, power, tracing, ..Self::default() };
    }

    /// A thread of this speed begins (or, negative, ends) to trace.
    pub(crate) fn trace(&mut self, now: u64, speed: f64) {
        self.look(now);
        self.tracing += speed;
    }

    fn look(&mut self, now: u64) {
        let seconds = now.saturating_sub(self.looked_at) as f64 / SECOND as f64;
        self.idle += seconds * (self.power - self.tracing);
        self.traced += seconds * self.tracing;
        self.looked_at = now;
    }

    /// Idle work up to now.
    pub(crate) fn idle(&mut self, now: u64) -> f64 {
        self.look(now);
        self.idle
    }

    /// A frame is complete. `idle_before`: the idle work up to when its last row was leased.
    pub(crate) fn complete(&mut self, now: u64, idle_before: f64, elapsed_ns: u64, latency_ns: u64) {
        self.tails += (self.idle(now) - idle_before).max(0.0);
        self.frames += 1;
        self.frame_ns += elapsed_ns;
        self.worst_ns = self.worst_ns.max(elapsed_ns);
        self.latency_ns += latency_ns;
    }

    /// Everything since the restart. `work`: of one frame.
    pub(crate) fn measured(&mut self, now: u64, work: f64) -> Measured {
        self.look(now);
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
            idle_tail: self.tails / all,
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
