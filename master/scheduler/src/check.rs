//! What holds after every event. Debug builds and tests check it each time.

use std::collections::BTreeSet;

use super::audits::{MAX_AUDITS, Stage, TRAILING_FRAMES};
use super::frame::Frame;
use super::policy::{MAX_WINDOW, SEED_WINDOW};
use super::second::{MAX_FOR_MASTER, Second};
use super::{Scheduler, SegmentPolicy};

/// The first invariant that does not hold, in words:
///
/// - every row of a frame in flight is queued, leased to a live worker, or done, and exactly one of these;
/// - every lease of a worker is known to its frame, and the other way round;
/// - leases never exceed the window;
/// - rows do not wait for anybody while all who could render them are idle;
/// - under the seed's policies, nobody is idle while rows wait;
/// - at most two frames are in flight, in order, and none of them is complete;
/// - audits are few, of frames in flight or lately complete, and nobody verifies what it has rendered itself;
/// - without workers nothing is leased.
pub fn violated(scheduler: &Scheduler) -> Option<String> {
    frames_are_in_order(scheduler)
        .or_else(|| scheduler.frames.iter().find_map(rows_are_somewhere))
        .or_else(|| scheduler.frames.iter().find_map(|frame| holders_hold(scheduler, frame)))
        .or_else(|| leases_are_known(scheduler))
        .or_else(|| audits_are_in_order(scheduler))
        .or_else(|| nobody_is_idle(scheduler))
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
        return Some("a frame waits although none is in flight".to_owned());
    }
    (!numbers.is_sorted_by(|a, b| a < b)).then(|| format!("frames out of order: {numbers:?}"))
}

fn rows_are_somewhere(frame: &Frame) -> Option<String> {
    let queued = frame.queue.iter().map(|run| (run.first, run.count));
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
    let window = if scheduler.policy == SegmentPolicy::Adaptive { MAX_WINDOW } else { SEED_WINDOW };
    scheduler.workers.iter().find_map(|(id, worker)| {
        if worker.leases.len() > window {
            return Some(format!("{id} holds {} leases, at most {window} expected", worker.leases.len()));
        }
        worker.leases.iter().find_map(|(&(frame, number), held)| {
            if held.audit {
                let audit = scheduler.audits.open.get(&(frame, number));
                let known = audit.is_some_and(|audit| audit.stage == Stage::Leased(*id));
                return (!known)
                    .then(|| format!("{id} verifies {:?}, which nobody asked it for", held.lease));
            }
            let known = scheduler.frames.iter().find(|known| known.id == frame);
            let segment = known.and_then(|frame| frame.segments.get(&number));
            let rows = (held.lease.first_row, held.lease.row_count);
            let fits = segment.is_some_and(|segment| {
                rows == (segment.first, segment.count) && (segment.done || segment.holders.contains(id))
            });
            (!fits).then(|| format!("{id} holds {:?}, which its frame does not know", held.lease))
        })
    })
}

fn audits_are_in_order(scheduler: &Scheduler) -> Option<String> {
    let audits = &scheduler.audits;
    // The master may take its time.
    let trailing = audits.open.iter().filter(|(_, audit)| !audit.stage.is_masters());
    let frames: BTreeSet<_> = trailing.map(|((frame, _), _)| frame).collect();
    if audits.open.len() > MAX_AUDITS || frames.len() > scheduler.max_frames() + TRAILING_FRAMES {
        return Some(format!("{} audits of {} frames are open", audits.open.len(), frames.len()));
    }
    if audits.waiting_for_master() > MAX_FOR_MASTER {
        return Some(format!("{} audits wait for the master", audits.waiting_for_master()));
    }
    audits.open.iter().find_map(|(&(frame, number), audit)| {
        if let Stage::Waiting(Second::Worker(second)) = audit.stage {
            let able = second != audit.painter && scheduler.workers.contains_key(&second);
            return (!able).then(|| format!("{frame:?} audit {number} waits for {second}, which cannot"));
        }
        let Stage::Leased(holder) = audit.stage else { return None };
        let worker = scheduler.workers.get(&holder);
        let holds = worker.is_some_and(|worker| worker.leases.contains_key(&(frame, number)));
        if !holds {
            return Some(format!("{frame:?} audit {number} is held by {holder}, which does not hold it"));
        }
        (holder == audit.painter).then(|| format!("{holder} verifies what it has rendered itself"))
    })
}

/// Under `adaptive` rows may wait for somebody who will have done them sooner than those who are idle.
fn nobody_is_idle(scheduler: &Scheduler) -> Option<String> {
    let rows_wait = scheduler.frames.iter().any(|frame| !frame.queue.is_empty());
    let ready = || scheduler.workers.iter().filter(|(_, worker)| worker.is_ready(scheduler.handled_at));
    let idle = ready().find(|(_, worker)| worker.leases.is_empty()).filter(|_| rows_wait);
    let busy = ready().any(|(_, worker)| !worker.leases.is_empty());
    let forbidden = !busy || scheduler.policy != SegmentPolicy::Adaptive;
    idle.filter(|_| forbidden).map(|(id, _)| format!("{id} is idle while rows wait"))
}
