//! Commands to workers, as displays send them.

use rayfarm_farm::{FarmControl, UnknownWorker};

/// Reason that a kicked worker receives.
pub(crate) const KICK_REASON: &str = "it was kicked by the master's user";

/// A command to one or more workers, each named by its number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum WorkerCommand {
    /// Grants these workers no more leases.
    Pause(Vec<u64>),
    /// Grants these workers leases again.
    Resume(Vec<u64>),
    /// Disconnects a worker after it has finished its leases.
    Drain(u64),
    /// Disconnects a worker at once and refuses it from then on.
    Kick(u64),
    /// Admits all kicked workers again and restarts local ones.
    BringBack,
}

impl WorkerCommand {
    /// Sends the command to the farm. A worker that has disconnected meanwhile is skipped.
    pub(super) fn perform(&self, farm: &FarmControl) {
        let each = |ids: &[u64], act: fn(&FarmControl, u64) -> Result<(), UnknownWorker>| {
            for &id in ids {
                let _ = act(farm, id);
            }
        };
        match self {
            Self::Pause(ids) => each(ids, FarmControl::pause),
            Self::Resume(ids) => each(ids, FarmControl::resume),
            Self::Drain(id) => each(&[*id], FarmControl::drain),
            Self::Kick(id) => each(&[*id], |farm, id| farm.ban(id, KICK_REASON)),
            Self::BringBack => farm.allow_all(),
        }
    }
}
