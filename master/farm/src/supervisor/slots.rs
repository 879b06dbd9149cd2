//! Slots of local workers: which are empty, and requests to restart their workers.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use tokio::sync::Notify;

/// One slot for each local worker.
#[derive(Debug, Default)]
pub(crate) struct LocalSlots {
    slots: Vec<Slot>,
    empty: AtomicU32,
}

/// The slot of one local worker. It is empty while its worker has exited and is not restarted automatically.
#[derive(Debug, Default)]
pub(super) struct Slot {
    is_empty: AtomicBool,
    restart: Notify,
}

impl LocalSlots {
    pub(super) fn new(count: u32) -> Self {
        Self { slots: (0..count).map(|_| Slot::default()).collect(), empty: AtomicU32::new(0) }
    }

    /// The slot with this number, from 1.
    pub(super) fn get(&self, number: u32) -> Option<&Slot> {
        self.slots.get((number as usize).checked_sub(1)?)
    }

    /// Number of empty slots.
    pub(crate) fn empty(&self) -> u32 {
        self.empty.load(Ordering::Acquire)
    }

    /// Restarts the worker of each empty slot whose number, from 1, `which` selects. Returns how many were restarted.
    pub(crate) fn restart(&self, which: impl Fn(u32) -> bool) -> u32 {
        let mut restarted = 0;
        for (_, slot) in (1..).zip(&self.slots).filter(|(number, _)| which(*number)) {
            if slot.is_empty.swap(false, Ordering::AcqRel) {
                self.empty.fetch_sub(1, Ordering::AcqRel);
                slot.restart.notify_one();
                restarted += 1;
            }
        }
        restarted
    }

    /// Marks a slot as empty. Returns whether all slots are empty now.
    pub(super) fn vacate(&self, slot: &Slot) -> bool {
        slot.is_empty.store(true, Ordering::Release);
        self.empty.fetch_add(1, Ordering::AcqRel) + 1 == self.slots.len() as u32
    }
}

impl Slot {
    /// Waits until the slot's worker is to be restarted.
    pub(super) async fn restarted(&self) {
        self.restart.notified().await;
    }
}
