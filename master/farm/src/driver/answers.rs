//! Replies of workers: pixels for the picture, pixels to verify, failures.

use std::time::{Duration, Instant};

use bytes::Bytes;
use rayfarm_protocol::{Cost, FrameId, Lease, PixelsHeader};
use rayfarm_scheduler::{Event, WorkerId};
use rayfarm_tracer::RayCounts;
use rayfarm_tracer::scene::{FrameView, MAX_LIGHTS, MAX_SHADOW_SAMPLES};

use super::Driver;
use super::reply::Reply;
use crate::framebuffer::{Misfit, Written};
use crate::line_budget::more;
use crate::sessions::causes::PongStatus;
use crate::sessions::lease_book::LeaseStatus;
use crate::verification::SegmentDigest;

/// An error in a reply, which ends its session.
#[derive(Debug, thiserror::Error)]
pub(crate) enum AnswerError {
    /// The worker does not hold the lease.
    #[error("it sent pixels of {0}, which it does not hold")]
    NotHeld(Lease),
    /// It reports a failure without a cause.
    #[error("it reports more failures than it was sent frames and segments")]
    Failures,
    /// It sends pongs without pings.
    #[error("it sends pongs that answer no ping")]
    Pongs,
    /// The pixels do not fit the lease.
    #[error("its pixels do not fit: {0}")]
    Misfit(#[from] Misfit),
}

/// Rows beyond those of a lease whose rays a worker may count with it: one band of tiles at either end.
const MORE_ROWS: u64 = 32;
/// Primary rays of a pixel beyond its samples: at its corners and through its centre.
const MORE_RAYS: u64 = 4;
/// Upper bound of the reflected and transmitted rays of one primary ray.
const SECONDARY_FROM_ONE: u64 = RayCounts::MAX_SECONDARY as u64;
/// Upper bound of the shadow rays of one primary ray: from each surface to each point of each light.
const SHADOW_FROM_ONE: u64 = (1 + SECONDARY_FROM_ONE) * MAX_LIGHTS as u64 * MAX_SHADOW_SAMPLES as u64;

/// Limits the ray counts of a reply, which a worker may set to any number, to what rows of a view can take.
fn plausible(cost: Cost, view: &FrameView, rows: u32) -> Cost {
    let pixels = u64::from(view.width).saturating_mul(u64::from(rows) + MORE_ROWS);
    let primary = pixels.saturating_mul(u64::from(view.samples) + MORE_RAYS);
    Cost {
        primary: cost.primary.min(primary),
        shadow: cost.shadow.min(primary.saturating_mul(SHADOW_FROM_ONE)),
        secondary: cost.secondary.min(primary.saturating_mul(SECONDARY_FROM_ONE)),
        ..cost
    }
}

impl Driver {
    /// Handles pixels: checks their lease, writes them into the picture, and then reports them to the scheduler. They are
    /// decoded and hashed outside of the driver's lock.
    ///
    /// # Errors
    /// The worker does not hold the lease, or the pixels do not fit it.
    pub(crate) fn pixels(
        &self,
        worker: WorkerId,
        header: PixelsHeader,
        bytes: &Bytes,
    ) -> Result<(), AnswerError> {
        let PixelsHeader { lease, encoding, cost } = header;
        let status = match self.lock().sessions.get_mut(worker) {
            Some(session) => session.check_reply(&lease),
            None => LeaseStatus::Revoked,
        };
        match status {
            LeaseStatus::Granted => match self.framebuffers.write(worker, lease, encoding, bytes)? {
                Written::Kept { rows, all_new, elapsed } => {
                    let reply = Reply { worker, lease, rows: rows.clone(), all_new };
                    let digests = self.segment_done(reply, cost, bytes.len(), elapsed);
                    digests.iter().for_each(SegmentDigest::compute);
                    self.framebuffers.recycle(rows);
                }
                Written::Superseded => {}
            },
            LeaseStatus::Verifying => self.verify(worker, header, bytes)?,
            LeaseStatus::Revoked => {}
            LeaseStatus::Unknown => return Err(AnswerError::NotHeld(lease)),
        }
        Ok(())
    }

    /// Reports a reply whose rows are in their picture. Returns the digests to compute without the lock.
    fn segment_done(&self, reply: Reply, cost: Cost, bytes: usize, elapsed: Duration) -> Vec<SegmentDigest> {
        let Reply { worker, lease, .. } = reply;
        let mut inner = self.lock();
        inner.accounts.received(worker, bytes, elapsed);
        let view = inner.requests.get(&lease.frame).map(|request| request.view);
        let cost = view.map_or(cost, |view| plausible(cost, &view, lease.row_count));
        inner.reply = Some(reply);
        self.drive(&mut inner, Event::SegmentDone { worker, lease, cost });
        inner.reply = None;
        std::mem::take(&mut inner.uncomputed)
    }

    /// Handles a pong.
    ///
    /// # Errors
    /// More than a few pongs that answer no open ping.
    pub(crate) fn pong(&self, worker: WorkerId, nonce: u64, progressed: bool) -> Result<(), AnswerError> {
        let mut inner = self.lock();
        let Some(session) = inner.sessions.get_mut(worker) else { return Ok(()) };
        match session.causes.pong(nonce) {
            PongStatus::Open => self.drive(&mut inner, Event::Pong { worker, nonce, progressed }),
            PongStatus::Stray => {}
            PongStatus::TooMany => return Err(AnswerError::Pongs),
        }
        Ok(())
    }

    /// Handles a worker's report that it cannot render a frame.
    ///
    /// # Errors
    /// More failures than frames and leases were sent.
    pub(crate) fn failed(&self, worker: WorkerId, frame: FrameId, reason: String) -> Result<(), AnswerError> {
        let mut inner = self.lock();
        if let Some(session) = inner.sessions.get_mut(worker) {
            if !session.causes.failed() {
                return Err(AnswerError::Failures);
            }
            session.leases.fail(frame);
            let name = &session.hello.name;
            // The same reason for each frame of a moving camera is one line.
            let is_new = session.last_failure.as_ref() != Some(&reason);
            match is_new.then(|| session.failure_lines.next(Instant::now())).flatten() {
                Some(left_out) => {
                    let more = more(left_out);
                    tracing::warn!("{worker} ({name}) cannot render frame {frame}: {reason}{more}");
                }
                None => tracing::debug!("{worker} ({name}) cannot render frame {frame}: {reason}"),
            }
            session.last_failure = Some(reason);
        }
        self.drive(&mut inner, Event::WorkerFailed { worker, frame });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::test_scene::view;

    #[test]
    fn ray_counts_are_limited_to_what_the_rows_can_take() {
        let genuine = Cost { trace_ns: 9, primary: 100, shadow: 300, secondary: 50, ..Cost::default() };
        assert_eq!(plausible(genuine, &view(), 1), genuine);
        let absurd = Cost { primary: u64::MAX, shadow: u64::MAX, secondary: u64::MAX, ..genuine };
        let cut = plausible(absurd, &view(), 8);
        let samples = u64::from(view().width) * 8 * u64::from(view().samples);
        assert!(cut.primary >= samples && cut.primary < 100 * samples, "{cut:?}");
        assert_eq!(cut.secondary, cut.primary * 1024, "at most 1024 reflected and transmitted rays");
        assert!(cut.shadow > cut.secondary && cut.shadow < u64::MAX, "{cut:?}");
        let endless = FrameView { width: u32::MAX, samples: u32::MAX, ..view() };
        assert_eq!(plausible(absurd, &endless, u32::MAX).primary, u64::MAX);
    }
}
