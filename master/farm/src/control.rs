//! A farm's other handle: for whoever steers it beside the one who asks for frames.

use std::sync::Arc;

use tokio::runtime::Handle;

use crate::verification::delivered::FrameSet;
use crate::driver::Driver;
use crate::error::UnknownWorker;
use crate::status::FarmStatus;
use crate::sessions::identity::Identity;
use crate::supervisor::Places;
use crate::sessions::Kicked;
use rayfarm_scheduler::{Event, WorkerId};

/// Looks at a farm and commands its workers, from any thread. Once the farm is shut down, no worker is there.
#[derive(Clone)]
pub struct FarmControl {
    driver: Arc<Driver>,
    places: Arc<Places>,
    /// Goodbyes are said on the farm's runtime, whatever thread asks for them.
    runtime: Handle,
}

impl FarmControl {
    /// Call it inside the farm's runtime.
    pub(crate) fn new(driver: Arc<Driver>, places: Arc<Places>) -> Self {
        Self { driver, places, runtime: Handle::current() }
    }

    /// What is going on right now.
    pub fn status(&self) -> FarmStatus {
        FarmStatus { local_gone: self.places.gone(), ..self.driver.status() }
    }

    /// As [`FarmStatus::wrong_frames`], by their numbers.
    pub fn wrong_frames(&self) -> FrameSet {
        self.driver.wrong_frames()
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

    /// Sends a worker away at once, with the reason; others render what it held. It is refused when it connects again,
    /// until [`FarmControl::allow`] or the end of this master. A local worker is known by its process, any other by
    /// its name and address.
    ///
    /// # Errors
    /// [`UnknownWorker`].
    pub fn kick(&self, worker: u64, reason: &str) -> Result<(), UnknownWorker> {
        let _runtime = self.runtime.enter();
        found(worker, self.driver.kick(WorkerId(worker), reason))
    }

    /// Lets all kicked workers of this name connect again; local ones are started. Returns how many were kept out.
    pub fn allow(&self, name: &str) -> usize {
        self.let_in(|kicked| kicked.identity.name() == name)
    }

    /// Lets the kicked worker that had this number connect again; a local one is started. Whether it was kept out.
    pub fn allow_worker(&self, worker: u64) -> bool {
        self.let_in(|kicked| kicked.worker == WorkerId(worker)) > 0
    }

    /// Lets all kicked workers connect again, and starts the local ones that are not running.
    pub fn bring_back(&self) {
        self.driver.allow(|_| true);
        self.places.start_again(|_| true);
    }

    fn let_in(&self, which: impl Fn(&Kicked) -> bool) -> usize {
        let allowed = self.driver.allow(which);
        self.places.start_again(|number| allowed.contains(&Identity::Local(number)));
        allowed.len()
    }

    fn command(&self, worker: u64, event: impl FnOnce(WorkerId) -> Event) -> Result<(), UnknownWorker> {
        let _runtime = self.runtime.enter();
        found(worker, self.driver.command(WorkerId(worker), event(WorkerId(worker))))
    }
}

fn found(worker: u64, found: bool) -> Result<(), UnknownWorker> {
    if found { Ok(()) } else { Err(UnknownWorker(worker)) }
}
