//! Time and rays that a segment has taken.

/// Time and rays that a segment has taken on its worker. Times are intervals of the worker's clock, so no two clocks are
/// compared.
///
/// `wait_ns + span_ns` is the time from the lease's arrival until the worker's session has the pixels. The rest of the
/// time that the master measures is spent on the wire and in its queues.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Nanoseconds of tracing, summed over the render threads.
    pub trace_ns: u64,
    /// Nanoseconds from the lease's arrival until its first row begins: earlier leases, and loading of the scene.
    pub wait_ns: u64,
    /// Nanoseconds of encoding the pixels, summed over the render threads.
    pub encode_ns: u64,
    /// Nanoseconds of wall-clock time from the beginning of the first row until all rows are traced and encoded.
    pub span_ns: u64,
    /// Number of primary rays.
    pub primary: u64,
    /// Number of shadow rays.
    pub shadow: u64,
    /// Number of reflected and transmitted rays.
    pub secondary: u64,
}

impl std::ops::AddAssign for Cost {
    /// Adds the cost of another segment. A sum that overflows stays at the largest number.
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
