//! The cost of a segment, as its worker measures it.

use std::ops::AddAssign;

/// Times and ray counts of one lease, by the worker's own clock: no two clocks are compared.
///
/// From the lease's arrival until its pixels are queued for sending, `wait_ns + span_ns` pass. Any further time that
/// the master measures was spent on the wire and in its queues.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Nanoseconds of tracing, summed over the render threads.
    pub trace_ns: u64,
    /// Nanoseconds from the lease's arrival to the start of its first row: earlier leases, or a scene in transfer.
    pub wait_ns: u64,
    /// Nanoseconds of encoding the pixels, summed over the render threads.
    pub encode_ns: u64,
    /// Nanoseconds of wall-clock time from the start of the first row until all rows are traced and encoded.
    pub span_ns: u64,
    /// Primary rays.
    pub primary: u64,
    /// Shadow rays.
    pub shadow: u64,
    /// Rays of reflection and transmission.
    pub secondary: u64,
}

impl AddAssign for Cost {
    /// Adds each number, saturating.
    fn add_assign(&mut self, other: Self) {
        let add = |sum: &mut u64, more| *sum = sum.saturating_add(more);
        add(&mut self.trace_ns, other.trace_ns);
        add(&mut self.wait_ns, other.wait_ns);
        add(&mut self.encode_ns, other.encode_ns);
        add(&mut self.span_ns, other.span_ns);
        add(&mut self.primary, other.primary);
        add(&mut self.shadow, other.shadow);
        add(&mut self.secondary, other.secondary);
    }
}
