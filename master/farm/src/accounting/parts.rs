//! A sum of time, split into the parts of the account.

/// How many parts there are.
pub const PART_COUNT: usize = 7;

/// The parts' names, in the order of [`Parts::values`].
pub const PART_NAMES: [&str; PART_COUNT] =
    ["trace", "wait", "encode", "send", "decode", "idle_tail", "scene"];

/// What threads did, in nanoseconds of thread time. See [`crate::accounting`] for what each part is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Parts {
    /// Rendering.
    pub trace: u64,
    /// Nothing, with leases at hand or without a frame to render.
    pub wait: u64,
    /// Making pixels small.
    pub encode: u64,
    /// Nothing, while something was on the wire.
    pub send: u64,
    /// Nothing, while the master took pixels in.
    pub decode: u64,
    /// Nothing, or nothing useful, while others finished the frame.
    pub idle_tail: u64,
    /// Nothing, for want of the scene.
    pub scene: u64,
}

/// What a worker's answers say about the time since they were asked for, in nanoseconds of thread time. Whatever it
/// says, no more is put down than has passed.
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

    /// Splits `budget` nanoseconds: first what the threads did, then what kept them from doing more, then the rest,
    /// for which nobody has a better name than waiting.
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
    /// In the order of [`PART_NAMES`].
    pub(crate) fn values(&self) -> [u64; PART_COUNT] {
        let Self { trace, wait, encode, send, decode, idle_tail, scene } = *self;
        [trace, wait, encode, send, decode, idle_tail, scene]
    }

    /// All thread time, in nanoseconds.
    pub fn total(&self) -> u64 {
        self.values().into_iter().fold(0, u64::saturating_add)
    }

    /// Adds another account.
    pub(crate) fn add(&mut self, other: &Self) {
        let Self { trace, wait, encode, send, decode, idle_tail, scene } = self;
        let sums = [trace, wait, encode, send, decode, idle_tail, scene];
        for (sum, value) in sums.into_iter().zip(other.values()) {
            *sum = sum.saturating_add(value);
        }
    }

    /// Per cent of the total, in the order of [`PART_NAMES`], rounded to three digits in such a way that they sum to
    /// 100; all zero where no time has passed.
    pub fn percent(&self) -> [f64; PART_COUNT] {
        const WHOLE: u128 = 100_000;
        let values = self.values().map(u128::from);
        let total: u128 = values.iter().sum();
        if total == 0 {
            return [0.0; PART_COUNT];
        }
        let mut thousandths = values.map(|value| value * WHOLE / total);
        // The method of largest remainders: what rounding down has left goes to those that lost most.
        let mut by_remainder: [usize; PART_COUNT] = std::array::from_fn(|part| part);
        by_remainder.sort_by_key(|&part| std::cmp::Reverse(values[part] * WHOLE % total));
        let missing = WHOLE.saturating_sub(thousandths.iter().sum());
        for part in by_remainder.into_iter().take(usize::try_from(missing).unwrap_or(PART_COUNT)) {
            thousandths[part] += 1;
        }
        thousandths.map(|value| value as f64 / 1000.0)
    }
}
