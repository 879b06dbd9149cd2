//! Pixels of several sessions are decoded at the same time.

use std::sync::{Arc, Condvar, Mutex};

use super::*;

/// A point where several threads meet.
#[derive(Default)]
struct Rendezvous {
    arrived: Mutex<usize>,
    changed: Condvar,
    timeouts: Mutex<usize>,
}

impl Rendezvous {
    /// Blocks until `count` threads have arrived. After the time limit it counts a timeout and returns.
    fn wait_for(&self, count: usize) {
        let mut arrived = self.arrived.lock().unwrap();
        *arrived += 1;
        self.changed.notify_all();
        let (_arrived, wait) =
            self.changed.wait_timeout_while(arrived, TIMEOUT, |arrived| *arrived < count).unwrap();
        *self.timeouts.lock().unwrap() += usize::from(wait.timed_out());
    }
}

/// Each of two sessions blocks in its decoder until the other session is in its own. If a session held a lock of the driver
/// or of the framebuffers there, the other one could not arrive.
#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn two_sessions_decode_at_the_same_time() {
    let mut farm = farm(SegmentPolicy::Static(8)).await;
    for _ in 0..2 {
        fake_worker::start(farm.address(), Script::Correct).await;
    }
    until_workers(&farm, 2).await;
    let rendezvous = Arc::new(Rendezvous::default());
    let decoders = rendezvous.clone();
    farm.on_decode(move || decoders.wait_for(2));
    render(&mut farm, view()).await;
    farm.shut_down().await;
    assert_eq!(
        *rendezvous.timeouts.lock().unwrap(),
        0,
        "one session decodes while the other waits for a lock"
    );
    assert!(*rendezvous.arrived.lock().unwrap() >= 2);
}
