//! Farms of a trusted worker that takes a millisecond per row, and of untrusted ones that answer at once and report a
//! nanosecond.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use super::{
    Action, Cost, Event, Finding, FrameId, HostId, Lease, Scheduler, SegmentPolicy, WorkerId, check,
};

const POLICIES: [SegmentPolicy; 3] =
    [SegmentPolicy::Adaptive, SegmentPolicy::Static(8), SegmentPolicy::Smart(8)];
const HEIGHT: u32 = 256;
const TRUSTED: WorkerId = WorkerId(1);
/// Time of the trusted worker for a row, and of the untrusted ones for a lease.
const ROW_TIME: Duration = Duration::from_millis(1);
const ANSWER_TIME: Duration = Duration::from_micros(50);

/// A farm in virtual time.
struct Farm {
    scheduler: Scheduler,
    now: Duration,
    /// Replies on their way, by time and order.
    replies: BTreeMap<(Duration, u64), (WorkerId, Lease, bool)>,
    sent: u64,
    trusted_free_at: Duration,
    /// What second renderings of untrusted rows find.
    finding: Finding,
    last_frame: u64,
    /// Rows that untrusted workers have sent, by frame.
    untrusted_rows: BTreeMap<FrameId, BTreeSet<u32>>,
    banned: Vec<WorkerId>,
    complete: u64,
}

impl Farm {
    /// A farm with a trusted worker or none, and untrusted ones.
    fn new(policy: SegmentPolicy, has_trusted: bool, untrusted: u64, finding: Finding) -> Self {
        let mut farm = Self {
            scheduler: Scheduler::new(policy, 1 << 20),
            now: Duration::ZERO,
            replies: BTreeMap::new(),
            sent: 0,
            trusted_free_at: Duration::ZERO,
            finding,
            last_frame: 0,
            untrusted_rows: BTreeMap::new(),
            banned: Vec::new(),
            complete: 0,
        };
        if has_trusted {
            farm.handle(Event::WorkerJoined { worker: TRUSTED, threads: 1, host: HostId(1), trusted: true });
        }
        for worker in 2..2 + untrusted {
            let host = HostId(worker.into());
            farm.handle(Event::WorkerJoined { worker: WorkerId(worker), threads: 64, host, trusted: false });
        }
        farm.request();
        farm.request();
        farm
    }

    fn request(&mut self) {
        self.last_frame += 1;
        let frame = FrameId(self.last_frame);
        let (width, height, row_bytes, tile_rows) = (64, HEIGHT, 192, 8);
        self.handle(Event::FrameRequested { frame, width, height, row_bytes, tile_rows });
    }

    fn handle(&mut self, event: Event) {
        self.scheduler.handle(self.now, event);
        assert_eq!(check::violated(&self.scheduler), None);
        while let Some(action) = self.scheduler.poll_action() {
            match action {
                Action::Grant { worker, lease } => self.reply(worker, lease, false),
                Action::Verify { worker, lease } => self.reply(worker, lease, true),
                Action::FrameDone { .. } => {
                    self.complete += 1;
                    self.request();
                }
                Action::Ban { worker, .. } => self.banned.push(worker),
                _ => {}
            }
        }
    }

    /// Sends the reply to a lease.
    fn reply(&mut self, worker: WorkerId, lease: Lease, verifies: bool) {
        let at = if worker == TRUSTED {
            self.trusted_free_at = self.trusted_free_at.max(self.now) + ROW_TIME * lease.row_count;
            self.trusted_free_at
        } else {
            self.now + ANSWER_TIME
        };
        self.sent += 1;
        self.replies.insert((at, self.sent), (worker, lease, verifies));
    }

    /// Runs until that many frames are complete.
    fn run(&mut self, frames: u64) {
        let limit = Duration::from_secs(60);
        while self.complete < frames {
            let next = self.replies.first_key_value().map(|((at, _), _)| *at).unwrap_or(limit);
            match self.scheduler.poll_timeout().filter(|&at| at < next) {
                Some(at) => {
                    self.now = self.now.max(at);
                    self.handle(Event::Woken);
                    (1..5).for_each(|id| self.handle(Event::Heard { worker: WorkerId(id) }));
                }
                None => self.next_reply(),
            }
            assert!(self.now < limit, "frame {} does not end", self.complete + 1);
        }
    }

    fn next_reply(&mut self) {
        let ((at, _), (worker, lease, verifies)) = self.replies.pop_first().expect("a reply");
        self.now = self.now.max(at);
        if self.banned.contains(&worker) {
            return;
        }
        let trace_ns =
            if worker == TRUSTED { ROW_TIME.as_nanos() as u64 * u64::from(lease.row_count) } else { 1 };
        let cost = Cost { trace_ns, primary: 1, ..Cost::default() };
        if verifies {
            self.handle(Event::SegmentVerified { worker, lease, cost, finding: self.finding });
            return;
        }
        if worker != TRUSTED {
            let rows = lease.first_row..lease.first_row + lease.row_count;
            self.untrusted_rows.entry(lease.frame).or_default().extend(rows);
        }
        self.handle(Event::SegmentDone { worker, lease, cost });
    }

    /// Most rows of untrusted workers in one frame.
    fn most_untrusted_rows(&self) -> u32 {
        self.untrusted_rows.values().map(|rows| rows.len() as u32).max().unwrap_or(0)
    }

    /// Rows of untrusted workers in a frame.
    fn untrusted_rows_of(&self, frame: u64) -> u32 {
        self.untrusted_rows.get(&FrameId(frame)).map_or(0, |rows| rows.len() as u32)
    }
}

#[test]
fn a_worker_that_answers_at_once_gets_a_bounded_share_of_each_frame() {
    for policy in POLICIES {
        // Its segments are rendered again, but nothing is known of the first renderings.
        let mut farm = Farm::new(policy, true, 1, Finding::Unknown);
        farm.run(20);
        let most = farm.most_untrusted_rows();
        assert!((1..=HEIGHT / 4).contains(&most), "{policy}: {most} of {HEIGHT} rows");
    }
}

#[test]
fn many_untrusted_workers_share_one_bound() {
    for policy in POLICIES {
        let mut farm = Farm::new(policy, true, 40, Finding::Unknown);
        farm.run(20);
        let most = farm.most_untrusted_rows();
        assert!((1..=HEIGHT / 4).contains(&most), "{policy}: {most} of {HEIGHT} rows");
    }
}

#[test]
fn an_untrusted_worker_with_wrong_pixels_is_banned_by_default() {
    for policy in POLICIES {
        let mut farm = Farm::new(policy, true, 1, Finding::Different);
        farm.run(3);
        assert_eq!(farm.banned, [WorkerId(2)], "{policy}");
        let rows: usize = farm.untrusted_rows.values().map(BTreeSet::len).sum();
        // A quarter of each frame until the second rendering of the first one, with two frames in flight.
        assert!(rows <= HEIGHT as usize, "{policy}: {rows} rows before the ban");
        assert_eq!(farm.scheduler.verification().mismatches, 1);
        // Another worker of the same host gets nothing, until the user lifts the ban.
        let (worker, host) = (WorkerId(3), HostId(2));
        farm.untrusted_rows.clear();
        farm.handle(Event::WorkerJoined { worker, threads: 64, host, trusted: false });
        farm.run(10);
        assert_eq!(farm.most_untrusted_rows(), 0, "{policy}");
        farm.handle(Event::BanLifted { host });
        farm.run(15);
        assert!(farm.most_untrusted_rows() > 0 && farm.banned.len() == 2, "{policy}");
    }
}

#[test]
fn confirmed_segments_end_the_bound() {
    for policy in POLICIES {
        let mut farm = Farm::new(policy, true, 1, Finding::Same);
        farm.run(30);
        let most = farm.most_untrusted_rows();
        assert!(most > HEIGHT / 2, "{policy}: {most} of {HEIGHT} rows");
        let picked = farm.scheduler.verification().picked;
        farm.run(200);
        assert!(farm.scheduler.verification().picked > picked, "some segments are rendered again later on");
        assert!(farm.banned.is_empty());
    }
}

#[test]
fn without_a_trusted_worker_untrusted_ones_render_all_rows() {
    for policy in POLICIES {
        for untrusted in [1, 3] {
            let mut farm = Farm::new(policy, false, untrusted, Finding::Unknown);
            farm.run(10);
            assert_eq!(farm.untrusted_rows_of(5), HEIGHT, "{policy}");
            assert_eq!(farm.scheduler.verification().picked, 0);
        }
    }
}

#[test]
fn the_loss_of_the_last_trusted_worker_ends_the_bound() {
    for policy in POLICIES {
        let mut farm = Farm::new(policy, true, 1, Finding::Unknown);
        farm.run(3);
        farm.handle(Event::WorkerLeft { worker: TRUSTED });
        farm.replies.retain(|_, (worker, ..)| *worker != TRUSTED);
        farm.run(8);
        assert_eq!(farm.untrusted_rows_of(7), HEIGHT, "{policy}");
    }
}
