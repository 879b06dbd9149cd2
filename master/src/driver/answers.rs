//! What workers answer: pixels into their place, or beside what is there; failures.

use rayfarm_protocol::{FrameId, Lease, PixelsHeader};

use super::Driver;
use crate::framebuffer::{Misfit, Written};
use crate::lease_book::Standing;
use crate::scheduler::{Event, WorkerId};

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
