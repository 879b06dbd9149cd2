//! The number of requests in flight.

/// Requests in flight: the frame being rendered, and the next one, which workers begin when the first has no rows left.
pub(crate) const OPEN_REQUESTS: usize = 2;
