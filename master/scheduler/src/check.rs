//! Invariants that hold after every event. Debug builds and tests check them each time.

use std::collections::BTreeSet;

use super::frame::Frame;
use super::limits::{FIXED_POLICY_WINDOW, MAX_WINDOW, TRAILING_FRAMES};
use super::verification::{MAX_FOR_MASTER, MAX_PENDING, SecondRenderer, Stage};
use super::worker::Worker;
use super::{Scheduler, SegmentPolicy};

/// Describes the first violated invariant; `None` if all of these hold:
///
/// - every row of a frame in flight is in exactly one of the states queued, leased to a live worker, done;
/// - frames and workers agree on every lease;
/// - leases of a worker never exceed the window;
/// - a worker has a stall timer if, and only if, it holds leases or has overdue ones;
/// - rows are not queued while all ready workers are idle;
/// - under the fixed policies, no ready worker is idle while rows are queued, except for those on probation;
/// - at most two frames are in flight, in order, and none of them is complete;
/// - pending verifications are bounded, of frames in flight or recently complete, and no worker verifies its own rows;
/// - without workers nothing is leased.
pub fn violated(scheduler: &Scheduler) -> Option<String> {
    frames_are_in_order(scheduler)
        .or_else(|| scheduler.frames.iter().find_map(rows_are_somewhere))
        .or_else(|| scheduler.frames.iter().find_map(|frame| holders_hold(scheduler, frame)))
        .or_else(|| leases_are_known(scheduler))
        .or_else(|| stalls_are_timed(scheduler))
        .or_else(|| verifications_are_valid(scheduler))
        .or_else(|| no_worker_is_idle(scheduler))
}

fn frames_are_in_order(scheduler: &Scheduler) -> Option<String> {
    let frames = &scheduler.frames;
    let most = scheduler.max_frames();
    let numbers: Vec<_> = frames.iter().map(|f| f.id).chain(scheduler.waiting.map(|w| w.frame)).collect();
    if frames.len() > most {
        return Some(format!("{} frames in flight, at most {most} expected", frames.len()));
    }
    if frames.front().is_some_and(Frame::is_complete) {
        return Some(format!("{:?} is complete and still in flight", numbers[0]));
    }
    if frames.is_empty() && scheduler.waiting.is_some() {
        return Some("a request waits although no frame is in flight".to_owned());
    }
    (!numbers.is_sorted_by(|a, b| a < b)).then(|| format!("frames out of order: {numbers:?}"))
}

fn rows_are_somewhere(frame: &Frame) -> Option<String> {
    let queued = frame.queue.iter().map(|range| (range.first, range.count));
    let leased = frame.segments.values().map(|segment| (segment.first, segment.count));
    let mut parts: Vec<_> = queued.chain(leased).collect();
    parts.sort_unstable();
    let mut next = 0;
    for (first, count) in parts {
        if first != next || count == 0 {
            return Some(format!("{:?}: rows {first}+{count} follow row {next}", frame.id));
        }
        next = first + count;
    }
    let done: u32 = frame.segments.values().filter(|s| s.done).map(|s| s.count).sum();
    if next != frame.height || done != frame.rows_done {
        let (height, rows_done) = (frame.height, frame.rows_done);
        return Some(format!("{:?}: {next} of {height} rows, {done} done, {rows_done} counted", frame.id));
    }
    None
}

fn holders_hold(scheduler: &Scheduler, frame: &Frame) -> Option<String> {
    frame.segments.iter().find_map(|(number, segment)| {
        let lost = segment.holders.iter().find(|&holder| {
            let worker = scheduler.workers.get(holder);
            !worker.is_some_and(|worker| worker.leases.contains_key(&(frame.id, *number)))
        });
        let place = format!("{:?} segment {number}", frame.id);
        match (lost, segment.done, segment.holders.is_empty()) {
            (Some(holder), ..) => Some(format!("{place} is held by {holder}, which does not hold it")),
            (None, true, false) => Some(format!("{place} is done and held")),
            (None, false, true) => Some(format!("{place} is neither queued, nor held, nor done")),
            (None, ..) => None,
        }
    })
}

fn leases_are_known(scheduler: &Scheduler) -> Option<String> {
    let window = if scheduler.policy == SegmentPolicy::Adaptive { MAX_WINDOW } else { FIXED_POLICY_WINDOW };
    scheduler.workers.iter().find_map(|(id, worker)| {
        if worker.leases.len() > window {
            return Some(format!("{id} holds {} leases, at most {window} expected", worker.leases.len()));
        }
        worker.leases.iter().find_map(|(&(frame, number), active)| {
            if active.verifies {
                let pending = scheduler.verifications.pending.get(&(frame, number));
                let known = pending.is_some_and(|pending| pending.stage == Stage::Leased(*id));
                return (!known)
                    .then(|| format!("{id} verifies {:?}, which is not leased to it", active.lease));
            }
            let known = scheduler.frames.iter().find(|known| known.id == frame);
            let segment = known.and_then(|frame| frame.segments.get(&number));
            let rows = (active.lease.first_row, active.lease.row_count);
            let fits = segment.is_some_and(|segment| {
                rows == (segment.first, segment.count) && (segment.done || segment.holders.contains(id))
            });
            (!fits).then(|| format!("{id} holds {:?}, which its frame does not know", active.lease))
        })
    })
}

fn stalls_are_timed(scheduler: &Scheduler) -> Option<String> {
    scheduler.workers.iter().find_map(|(id, worker)| {
        let count = worker.leases.len() + worker.overdue.len();
        let timed = worker.stall_deadline(scheduler.stall_timeout).is_some();
        (timed != (count > 0)).then(|| format!("{id} holds {count} leases, stall timer: {timed}"))
    })
}

fn verifications_are_valid(scheduler: &Scheduler) -> Option<String> {
    let queue = &scheduler.verifications;
    // Those for the master may be of any age.
    let trailing = queue.pending.iter().filter(|(_, pending)| !pending.stage.is_for_master());
    let frames: BTreeSet<_> = trailing.map(|((frame, _), _)| frame).collect();
    if queue.pending.len() > MAX_PENDING || frames.len() > scheduler.max_frames() + TRAILING_FRAMES {
        return Some(format!("{} verifications of {} frames are pending", queue.pending.len(), frames.len()));
    }
    if queue.waiting_for_master() > MAX_FOR_MASTER {
        return Some(format!("{} verifications wait for the master", queue.waiting_for_master()));
    }
    queue.pending.iter().find_map(|(&(frame, number), pending)| {
        let place = format!("{frame:?} verification {number}");
        if let Stage::Waiting(SecondRenderer::Worker(second)) = pending.stage {
            let able = second != pending.first.worker && scheduler.workers.contains_key(&second);
            return (!able).then(|| format!("{place} waits for {second}, which cannot render it"));
        }
        let Stage::Leased(holder) = pending.stage else { return None };
        let worker = scheduler.workers.get(&holder);
        let holds = worker.is_some_and(|worker| worker.leases.contains_key(&(frame, number)));
        if !holds {
            return Some(format!("{place} is held by {holder}, which does not hold it"));
        }
        (holder == pending.first.worker).then(|| format!("{holder} verifies its own rows"))
    })
}

/// Under `adaptive`, rows may wait for a busy worker that will have done them sooner than an idle one.
fn no_worker_is_idle(scheduler: &Scheduler) -> Option<String> {
    let rows_are_queued = scheduler.frames.iter().any(|frame| !frame.queue.is_empty());
    let ready = || scheduler.workers.iter().filter(|(_, worker)| worker.is_ready(scheduler.handled_at));
    // Workers on probation wait where the share of all of them is used up: a trusted worker is ready then.
    let is_idle = |worker: &Worker| worker.leases.is_empty() && !scheduler.standings.is_on_probation(worker);
    let idle = ready().find(|(_, worker)| is_idle(worker)).filter(|_| rows_are_queued);
    let is_busy = |worker: &Worker| !worker.leases.is_empty() && !scheduler.standings.is_on_probation(worker);
    let busy = ready().any(|(_, worker)| is_busy(worker));
    let forbidden = !busy || scheduler.policy != SegmentPolicy::Adaptive;
    idle.filter(|_| forbidden).map(|(id, _)| format!("{id} is idle while rows are queued"))
}
