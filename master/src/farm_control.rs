//! A farm's other handle: for whoever steers it beside the one who asks for frames.

use std::sync::Arc;

use tokio::runtime::Handle;

use crate::driver::Driver;
use crate::farm::{FarmStatus, UnknownWorker};
use crate::scheduler::{Event, WorkerId};

/// Looks at a farm and commands its workers, from any thread. Once the farm is shut down, no worker is there.
#[derive(Clone)]
pub struct FarmControl {
    driver: Arc<Driver>,
    /// Goodbyes are said on the farm's runtime, whatever thread asks for them.
    runtime: Handle,
}

impl FarmControl {
    /// Call it inside the farm's runtime.
    pub(crate) fn new(driver: Arc<Driver>) -> Self {
        Self { driver, runtime: Handle::current() }
    }

    /// What is going on right now.
    pub fn status(&self) -> FarmStatus {
        self.driver.status()
    }

    /// Lets a worker finish what it holds and then leave for good; a worker of the same name may come later.
    ///
    /// # Errors
    /// [`UnknownWorker`], as for all commands to a worker.
    pub fn drain(&self, worker: u64) -> Result<(), UnknownWorker> {
        self.command(worker, |worker| Event::DrainRequested { worker })
    }

    /// Gives a worker no more leases until [`FarmControl::resume`]. It stays connected and finishes what it holds. A farm
    /// whose workers are all paused renders nothing.
    ///
    /// # Errors
    /// [`UnknownWorker`].
    pub fn pause(&self, worker: u64) -> Result<(), UnknownWorker> {
        self.command(worker, |worker| Event::PauseRequested { worker })
    }

    /// Gives a paused worker leases again. One that drains goes on draining.
    ///
    /// # Errors
    /// [`UnknownWorker`].
    pub fn resume(&self, worker: u64) -> Result<(), UnknownWorker> {
        self.command(worker, |worker| Event::ResumeRequested { worker })
    }

    /// Sends a worker away at once, with the reason; others render what it held. From then on, whoever connects under
    /// its name from its address is refused, until [`FarmControl::allow`] or the end of this master.
    ///
    /// # Errors
    /// [`UnknownWorker`].
    pub fn kick(&self, worker: u64, reason: &str) -> Result<(), UnknownWorker> {
        let _runtime = self.runtime.enter();
        found(worker, self.driver.kick(WorkerId(worker), reason))
    }

    /// Lets kicked workers of this name connect again. Returns how many were kept out.
    pub fn allow(&self, name: &str) -> usize {
        self.driver.allow(name)
    }

    fn command(&self, worker: u64, event: impl FnOnce(WorkerId) -> Event) -> Result<(), UnknownWorker> {
        let _runtime = self.runtime.enter();
        found(worker, self.driver.command(WorkerId(worker), event(WorkerId(worker))))
    }
}

fn found(worker: u64, found: bool) -> Result<(), UnknownWorker> {
    if found { Ok(()) } else { Err(UnknownWorker(worker)) }
}
