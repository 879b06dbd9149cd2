//! Thread time, split into the parts of an account.

/// Number of parts.
pub const PART_COUNT: usize = 7;

/// The names of the parts, in the order of [`Parts::percent`].
pub const PART_NAMES: [&str; PART_COUNT] =
    ["trace", "wait", "encode", "send", "decode", "idle_tail", "scene"];

/// Thread time in nanoseconds, by part. [`crate::accounting`] defines the parts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Parts {
    /// Rendering.
    pub trace: u64,
    /// Idle, with leases or without a requested frame.
    pub wait: u64,
    /// Encoding pixels.
    pub encode: u64,
    /// Idle, while leases or pixels were on the wire.
    pub send: u64,
    /// Idle, while the master decoded pixels.
    pub decode: u64,
    /// Idle, or rendering rows that are in no picture, while other workers finished the frame.
    pub idle_tail: u64,
    /// Idle, while the scene was in transfer.
    pub scene: u64,
}

/// Claims of a worker's replies about its thread time, in nanoseconds. No more is accepted than has passed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Claim {
    pub(super) trace: u64,
    pub(super) encode: u64,
    pub(super) decode: u64,
    pub(super) send: u64,
}

impl Claim {
    pub(super) fn add(&mut self, other: Self) {
        self.trace = self.trace.saturating_add(other.trace);
        self.encode = self.encode.saturating_add(other.encode);
        self.decode = self.decode.saturating_add(other.decode);
        self.send = self.send.saturating_add(other.send);
    }

    /// Splits `budget` nanoseconds: first the work of the threads, then decoding and sending; the rest is waiting.
    pub(super) fn split(self, budget: u64) -> Parts {
        let mut left = budget;
        let mut take = |claimed: u64| {
            let taken = claimed.min(left);
            left -= taken;
            taken
        };
        let (trace, encode) = (take(self.trace), take(self.encode));
        let (decode, send) = (take(self.decode), take(self.send));
        Parts { trace, encode, decode, send, wait: left, ..Parts::default() }
    }
}

impl Parts {
    /// The parts in the order of [`PART_NAMES`].
    pub(crate) fn values(&self) -> [u64; PART_COUNT] {
        let Self { trace, wait, encode, send, decode, idle_tail, scene } = *self;
        [trace, wait, encode, send, decode, idle_tail, scene]
    }

    /// The total thread time, in nanoseconds.
    pub fn total(&self) -> u64 {
        self.values().into_iter().fold(0, u64::saturating_add)
    }

    /// Adds the parts of another account.
    pub(crate) fn add(&mut self, other: &Self) {
        let Self { trace, wait, encode, send, decode, idle_tail, scene } = self;
        let sums = [trace, wait, encode, send, decode, idle_tail, scene];
        for (sum, value) in sums.into_iter().zip(other.values()) {
            *sum = sum.saturating_add(value);
        }
    }

    /// Percentages of the total, in the order of [`PART_NAMES`], rounded to three decimals so that they sum to 100; all zero
    /// where no time has passed.
    pub fn percent(&self) -> [f64; PART_COUNT] {
        const WHOLE: u128 = 100_000;
        let values = self.values().map(u128::from);
        let total: u128 = values.iter().sum();
        if total == 0 {
            return [0.0; PART_COUNT];
        }
        let mut thousandths = values.map(|value| value * WHOLE / total);
        // The largest remainder method: the units lost by rounding down go to the parts with the largest remainders.
        let mut by_remainder: [usize; PART_COUNT] = std::array::from_fn(|part| part);
        by_remainder.sort_by_key(|&part| std::cmp::Reverse(values[part] * WHOLE % total));
        let missing = WHOLE.saturating_sub(thousandths.iter().sum());
        for part in by_remainder.into_iter().take(usize::try_from(missing).unwrap_or(PART_COUNT)) {
            thousandths[part] += 1;
        }
        thousandths.map(|value| value as f64 / 1000.0)
    }
}
