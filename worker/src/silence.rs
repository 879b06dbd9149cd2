//! A master that has vanished without a word: its machine lost power, a cable was pulled. TCP alone would not notice for
//! as long as nothing is sent.

use std::time::Duration;

use rayfarm_protocol::limits::{MAX_CHUNK_BYTES, envelope_deadline};

/// How often it is looked.
pub(crate) const LOOK_EVERY: Duration = Duration::from_secs(3);

/// Looks in a row without a message: a master sends a ping every 2 s, and the longest message may take
/// [`envelope_deadline`].
const LIMIT: u32 = 5;

const _: () = assert!(LIMIT as u64 * LOOK_EVERY.as_secs() > envelope_deadline(MAX_CHUNK_BYTES).as_secs());

/// Counts looks, and not time: a worker that stood still itself has missed looks as well as messages.
#[derive(Debug, Default)]
pub(crate) struct Silence {
    received_bytes: u64,
    looks: u32,
}

impl Silence {
    /// Whether it has lasted too long, now that so many bytes have come in all.
    pub(crate) fn is_too_long(&mut self, received_bytes: u64) -> bool {
        if received_bytes != self.received_bytes {
            *self = Self { received_bytes, looks: 0 };
        }
        self.looks += 1;
        self.looks > LIMIT
    }

    /// For people.
    pub(crate) fn reason() -> String {
        format!("the master has been silent for {} s", u64::from(LIMIT) * LOOK_EVERY.as_secs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_message_breaks_it() {
        let mut silence = Silence::default();
        for received in [0, 0, 0, 0, 0, 8, 8, 8, 8, 8, 9] {
            assert!(!silence.is_too_long(received));
        }
        let looks = (0..20).take_while(|_| !silence.is_too_long(9)).count();
        assert_eq!(looks, LIMIT as usize - 1);
    }
}
