//! What workers answer: pixels into their place, or beside what is there; failures.

use rayfarm_protocol::{Cost, FrameId, Lease, PixelsHeader};
use rayfarm_tracer::scene::FrameView;

use super::Driver;
use crate::framebuffer::{Misfit, Written};
use crate::sessions::lease_book::Standing;
use rayfarm_scheduler::{Event, WorkerId};

/// Why an answer ends its session.
#[derive(Debug, thiserror::Error)]
pub(crate) enum AnswerError {
    /// The worker answers what it was not asked.
    #[error("it sent pixels of {0}, which it does not hold")]
    NotHeld(Lease),
    /// The pixels do not fit.
    #[error("its pixels do not fit: {0}")]
    Misfit(#[from] Misfit),
}

/// Rows whose rays may be counted with a lease although they are not in it: those of a band of tiles at either end.
const MORE_ROWS: u64 = 32;
/// Rays for a pixel beyond its samples: at its corners and through its centre.
const MORE_RAYS: u64 = 4;
/// Rays that one ray may lead to: more lights or bounces no picture waits for.
const RAYS_FROM_ONE: u64 = 1 << 16;

/// A cost with no more rays than rows of a view can take: a worker may claim any number.
fn plausible(cost: Cost, view: &FrameView, rows: u32) -> Cost {
    let pixels = u64::from(view.width).saturating_mul(u64::from(rows) + MORE_ROWS);
    let primary = pixels.saturating_mul(u64::from(view.samples) + MORE_RAYS);
    let others = primary.saturating_mul(RAYS_FROM_ONE);
    Cost {
        primary: cost.primary.min(primary),
        shadow: cost.shadow.min(others),
        secondary: cost.secondary.min(others),
        ..cost
    }
}

impl Driver {
    /// Pixels have arrived: checks them against what this very worker holds, and puts them into the picture. They
    /// are there before the scheduler hears of them.
    pub(crate) fn pixels(
        &self,
        worker: WorkerId,
        header: PixelsHeader,
        bytes: &[u8],
    ) -> Result<(), AnswerError> {
        let PixelsHeader { lease, encoding, cost } = header;
        let standing = match self.lock().roster.get_mut(worker) {
            Some(session) => session.leases.answer(&lease),
            None => Standing::Revoked,
        };
        match standing {
            Standing::Granted => match self.framebuffers.write(worker, lease, encoding, bytes)? {
                Written::Kept { decode } => {
                    let mut inner = self.lock();
                    inner.accounts.taken_in(worker, bytes.len(), decode);
                    let view = inner.views.get(&lease.frame).map(|requested| requested.view);
                    let cost = view.map_or(cost, |view| plausible(cost, &view, lease.row_count));
                    self.drive(&mut inner, Event::SegmentDone { worker, lease, cost });
                }
                Written::Superseded => {}
            },
            Standing::Verifying => self.verify(worker, header, bytes)?,
            Standing::Revoked => {}
            Standing::Unknown => return Err(AnswerError::NotHeld(lease)),
        }
        Ok(())
    }

    /// A worker cannot render a frame.
    pub(crate) fn failed(&self, worker: WorkerId, frame: FrameId, reason: String) {
        let mut inner = self.lock();
        if let Some(session) = inner.roster.get_mut(worker) {
            session.leases.fail(frame);
            tracing::warn!("{worker} ({}) cannot render frame {frame}: {reason}", session.hello.name);
            session.trouble = Some(reason);
        }
        self.drive(&mut inner, Event::WorkerFailed { worker, frame });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::test_scene::view;

    #[test]
    fn a_claim_of_more_rays_than_rows_can_take_is_cut() {
        let honest = Cost { trace_ns: 9, primary: 100, shadow: 300, secondary: 50, ..Cost::default() };
        assert_eq!(plausible(honest, &view(), 1), honest);
        let absurd = Cost { primary: u64::MAX, shadow: u64::MAX, secondary: u64::MAX, ..honest };
        let cut = plausible(absurd, &view(), 8);
        let samples = u64::from(view().width) * 8 * u64::from(view().samples);
        assert!(cut.primary >= samples && cut.primary < 100 * samples, "{cut:?}");
        assert!(cut.shadow < u64::MAX >> 16 && cut.secondary < u64::MAX >> 16, "{cut:?}");
        let endless = FrameView { width: u32::MAX, samples: u32::MAX, ..view() };
        assert_eq!(plausible(absurd, &endless, u32::MAX).primary, u64::MAX);
    }
}
