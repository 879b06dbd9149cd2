//! A second handle to a farm, for commands to its workers.

use std::sync::Arc;

use rayfarm_scheduler::{Event, WorkerId};
use tokio::runtime::Handle;

use crate::driver::Driver;
use crate::error::UnknownWorker;
use crate::sessions::PastWorker;
use crate::sessions::identity::Identity;
use crate::status::FarmStatus;
use crate::supervisor::LocalSlots;
use crate::verification::delivered::FrameSet;

/// Reads a farm's status and sends commands to its workers, from any thread. After the farm is shut down, there are no
/// workers.
#[derive(Clone)]
pub struct FarmControl {
    driver: Arc<Driver>,
    slots: Arc<LocalSlots>,
    /// Disconnect messages are sent on the farm's runtime, whatever thread calls.
    runtime: Handle,
}

impl FarmControl {
    /// A handle. Call it inside the farm's runtime.
    pub(crate) fn new(driver: Arc<Driver>, slots: Arc<LocalSlots>) -> Self {
        Self { driver, slots, runtime: Handle::current() }
    }

    /// The current status.
    pub fn status(&self) -> FarmStatus {
        FarmStatus { local_exited: self.slots.empty(), ..self.driver.status() }
    }

    /// Finished frames that may be wrong: the ones that [`FarmStatus::wrong_frames`] counts.
    pub fn wrong_frames(&self) -> FrameSet {
        self.driver.wrong_frames()
    }

    /// Drains a worker: it finishes its leases and leaves for good. A worker of the same name may connect later.
    ///
    /// # Errors
    /// [`UnknownWorker`], when no worker of that number is connected.
    pub fn drain(&self, worker: u64) -> Result<(), UnknownWorker> {
        self.command(worker, |worker| Event::DrainRequested { worker })
    }

    /// Grants a worker no more leases until [`FarmControl::resume`]. It stays connected and finishes its leases. A farm
    /// whose workers are all paused renders nothing.
    ///
    /// # Errors
    /// [`UnknownWorker`], when no worker of that number is connected.
    pub fn pause(&self, worker: u64) -> Result<(), UnknownWorker> {
        self.command(worker, |worker| Event::PauseRequested { worker })
    }

    /// Grants a paused worker leases again. A draining worker continues to drain.
    ///
    /// # Errors
    /// [`UnknownWorker`], when no worker of that number is connected.
    pub fn resume(&self, worker: u64) -> Result<(), UnknownWorker> {
        self.command(worker, |worker| Event::ResumeRequested { worker })
    }

    /// Disconnects a worker at once, with the reason, and bans it until [`FarmControl::allow`] or the end of this master.
    /// Other workers render its leases. A local worker is identified by its process, any other by name and address.
    ///
    /// # Errors
    /// [`UnknownWorker`], when no worker of that number is connected.
    pub fn ban(&self, worker: u64, reason: &str) -> Result<(), UnknownWorker> {
        let _runtime = self.runtime.enter();
        known(worker, self.driver.ban(WorkerId(worker), reason))
    }

    /// Lifts the bans of all workers of this name; local ones are restarted. Returns how many bans were lifted.
    pub fn allow(&self, name: &str) -> usize {
        self.lift(|banned| banned.identity.name() == name)
    }

    /// Lifts the ban of the worker that had this number; a local one is restarted. Returns whether it was banned.
    pub fn allow_worker(&self, worker: u64) -> bool {
        self.lift(|banned| banned.worker == WorkerId(worker)) > 0
    }

    /// Lifts all bans and restarts the local workers that are not running.
    pub fn allow_all(&self) {
        self.driver.allow(|_| true);
        self.slots.restart(|_| true);
    }

    fn lift(&self, which: impl Fn(&PastWorker) -> bool) -> usize {
        let allowed = self.driver.allow(which);
        self.slots.restart(|number| allowed.contains(&Identity::Local(number)));
        allowed.len()
    }

    fn command(&self, worker: u64, event: impl FnOnce(WorkerId) -> Event) -> Result<(), UnknownWorker> {
        let _runtime = self.runtime.enter();
        known(worker, self.driver.command(WorkerId(worker), event(WorkerId(worker))))
    }
}

fn known(worker: u64, is_known: bool) -> Result<(), UnknownWorker> {
    if is_known { Ok(()) } else { Err(UnknownWorker(worker)) }
}
