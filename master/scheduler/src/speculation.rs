//! Speculative execution: backup tasks, which render a segment again on an idle worker where that is predicted to
//! complete the frame earlier (Dean and Ghemawat, "MapReduce", OSDI 2004, section 3.6).

use std::time::Duration;

use super::adaptive::{Fleet, seconds};
use super::worker::Worker;
use super::{FrameId, Lease, Scheduler, WorkerId};

/// A segment with this many trusted holders gets no backup task.
const MAX_HOLDERS: usize = 3;
/// A holder is trusted for this long: a stuck worker answers pings and never a lease.
const HOLDER_TRUST: Duration = Duration::from_secs(10);
/// A holder that has not finished any segment yet, perhaps because it fetches the scene over a slow link, is trusted for
/// this long, and not at all when a proven worker looks for a segment.
const UNPROVEN_TRUST: Duration = Duration::from_secs(1);

/// A segment that others hold and that may be rendered once more.
#[derive(Clone, Copy, Debug)]
struct BackupTask {
    frame: FrameId,
    segment: u32,
    /// Trusted holders.
    holders: usize,
}

impl Scheduler {
    /// The backup task of the fixed policies: the oldest segment with the fewest holders, at once.
    pub(super) fn any_backup(&mut self, now: Duration, id: WorkerId) -> Option<Lease> {
        let best = self.backup_tasks(now, id).min_by_key(|task| (task.frame, task.holders, task.segment))?;
        self.frames.iter_mut().find(|known| known.id == best.frame)?.lease_to(best.segment, id)
    }

    /// Leases a proven worker rows of the oldest frame that only unproven workers hold, before it begins the next
    /// frame: an unproven worker may never deliver. Skipped in the first frame, where all workers are unproven.
    pub(super) fn back_up_unproven(&mut self, now: Duration, id: WorkerId, fleet: &mut Fleet) -> bool {
        let is_proven = |worker: &Worker| worker.segments_done > 0;
        if self.last_frame == Duration::ZERO || self.workers.values().all(is_proven) {
            return false;
        }
        let oldest = self.frames.front().map(|frame| frame.id);
        let Some(oldest) = oldest.filter(|_| self.workers.get(&id).is_some_and(is_proven)) else {
            return false;
        };
        let unsure = |task: &BackupTask| task.frame == oldest && task.holders == 0;
        let Some(BackupTask { segment, .. }) = self.backup_tasks(now, id).find(unsure) else { return false };
        let lease = self.frames.front_mut().and_then(|frame| frame.lease_to(segment, id));
        lease.into_iter().for_each(|lease| self.grant(now, id, lease, Some(&mut *fleet)));
        lease.is_some()
    }

    /// The backup tasks of the policy `adaptive`: idle workers, the fastest first, repeat the segments that they are
    /// predicted to finish earlier than the holder.
    pub(super) fn speculate(&mut self, now: Duration, fleet: &mut Fleet) {
        while let Some((id, speed, round_trip)) = fleet.fastest_idle() {
            let mut best: Option<(Duration, BackupTask)> = None;
            let mut recheck: Option<Duration> = None;
            for task in self.backup_tasks(now, id) {
                match self.backup_gain(now, task, speed, round_trip) {
                    (at, gain) if at <= now => {
                        if best.is_none_or(|(most, _)| gain > most) {
                            best = Some((gain, task));
                        }
                    }
                    (at, _) => recheck = recheck.min(Some(at)).or(Some(at)),
                }
            }
            self.recheck_at = recheck;
            let Some((_, BackupTask { frame, segment, .. })) = best else { return };
            let frame = self.frames.iter_mut().find(|known| known.id == frame);
            let Some(lease) = frame.and_then(|frame| frame.lease_to(segment, id)) else { return };
            self.grant(now, id, lease, Some(&mut *fleet));
        }
    }

    /// Unfinished segments that a worker does not hold and that have fewer than [`MAX_HOLDERS`] trusted holders.
    fn backup_tasks(&self, now: Duration, id: WorkerId) -> impl Iterator<Item = BackupTask> {
        let segments = self.frames.iter().flat_map(|f| f.segments.iter().map(|(n, s)| (f.id, *n, s)));
        let open = segments.filter(move |(_, _, segment)| !segment.done && !segment.holders.contains(&id));
        let is_proven = |worker: &Worker| worker.segments_done > 0;
        let for_proven = self.workers.get(&id).is_some_and(is_proven);
        let trust = move |worker: &Worker| match (is_proven(worker), for_proven) {
            (true, _) => HOLDER_TRUST,
            (false, false) => UNPROVEN_TRUST,
            (false, true) => Duration::ZERO,
        };
        let counted = open.map(move |(frame, segment, known)| {
            let trusted = |holder: &&WorkerId| {
                let worker = self.workers.get(holder);
                let active = worker.and_then(|worker| Some((worker, worker.leases.get(&(frame, segment))?)));
                active.is_some_and(|(worker, active)| active.granted_at.saturating_add(trust(worker)) > now)
            };
            BackupTask { frame, segment, holders: known.holders.iter().filter(trusted).count() }
        });
        counted.filter(|task| task.holders < MAX_HOLDERS)
    }

    /// Time from which a backup task pays, and the time that the segment would gain by it. It pays now if this worker is
    /// predicted to finish first, or if nothing can be predicted; otherwise once the holder is late by the time that
    /// the backup task takes.
    fn backup_gain(
        &self,
        now: Duration,
        task: BackupTask,
        speed: Option<f64>,
        round_trip: f64,
    ) -> (Duration, Duration) {
        let key = (task.frame, task.segment);
        let frame = self.frames.iter().find(|frame| frame.id == task.frame);
        let holders = frame.and_then(|frame| frame.segments.get(&task.segment)).map(|s| &s.holders);
        // Suspect holders do not count: they may be dead.
        let holders = holders.into_iter().flatten().filter_map(|holder| self.workers.get(holder));
        let active = holders.filter(|worker| !worker.is_suspect(now)).filter_map(|w| w.leases.get(&key));
        let expected = active
            .map(|active| (active.expected_at, active.work))
            .min_by_key(|(at, _)| at.unwrap_or(Duration::MAX));
        let (Some((Some(expected_at), work)), Some(speed)) = (expected, speed) else {
            return (now, Duration::MAX);
        };
        let takes = seconds(round_trip + work / speed);
        let done_at = now.saturating_add(takes);
        if done_at < expected_at {
            (now, expected_at - done_at)
        } else {
            (expected_at.saturating_add(takes), takes)
        }
    }
}
