//! Results of verifications: second renderings that are compared with the first, disputes, and bans.

use std::time::Duration;

use super::verification::{ArbiterResult, Finding, MAX_BANNED, Renderer, Stage};
use super::{Action, Cost, FrameId, HostId, Lease, Scheduler, WorkerId};

impl Scheduler {
    /// Applies the comparison of a second rendering.
    pub(super) fn segment_verified(
        &mut self,
        now: Duration,
        id: WorkerId,
        lease: Lease,
        cost: Cost,
        finding: Finding,
    ) {
        let key = (lease.frame, lease.segment);
        let was_held = self.finish_lease(now, id, lease, cost).is_some();
        let pending = self.verifications.pending.get_mut(&key);
        let open = pending.filter(|pending| !matches!(pending.stage, Stage::Arbitrating(_)));
        let Some(pending) = open.filter(|_| was_held) else { return };
        let (first, first_lease) = (pending.first, pending.lease);
        let decides = !first.trusted && self.workers.get(&id).is_some_and(|worker| worker.trusted);
        match finding {
            // There is no arbiter without a share to verify: the trusted worker decides.
            Finding::Different if self.verifications.counts.percent == 0 => {
                self.verifications.counts.verified += 1;
                self.verifications.counts.mismatches += 1;
                self.close_verification(key);
                if decides {
                    self.ban(first, first_lease, "a trusted worker's rendering");
                }
            }
            Finding::Different => {
                let before = std::mem::replace(&mut pending.stage, Stage::Arbitrating(Some(id)));
                let (frame, segment) = key;
                self.actions.push_back(Action::Arbitrate { frame, segment });
                self.revoke_verification(before, key);
            }
            Finding::Same | Finding::Unknown => {
                self.verifications.counts.verified += u64::from(finding == Finding::Same);
                if decides && finding == Finding::Same {
                    self.standings.confirm(first.host);
                }
                self.close_verification(key);
            }
        }
    }

    /// Applies the arbiter's result: bans every worker whose rendering differs from the master's.
    pub(super) fn segment_arbitrated(&mut self, frame: FrameId, segment: u32, result: ArbiterResult) {
        let Some(pending) = self.verifications.pending.get(&(frame, segment)) else { return };
        let (lease, first, Stage::Arbitrating(second)) = (pending.lease, pending.first, pending.stage) else {
            return;
        };
        self.verifications.counts.verified += u64::from(result.rendered);
        self.verifications.counts.mismatches += u64::from(second.is_some() || result.first_differs);
        self.close_verification((frame, segment));
        let second = second.filter(|_| result.second_differs).map(|worker| self.renderer(worker));
        if result.rendered && !result.first_differs && !first.trusted {
            self.standings.confirm(first.host);
        }
        for renderer in [Some(first).filter(|_| result.first_differs), second].into_iter().flatten() {
            self.ban(renderer, lease, "the master's rendering");
        }
    }

    /// A worker as a renderer. One that has left counts as trusted: its host is not known any more.
    fn renderer(&self, worker: WorkerId) -> Renderer {
        let known = self.workers.get(&worker).map(|known| (known.host, known.trusted));
        let (host, trusted) = known.unwrap_or((HostId(0), true));
        Renderer { worker, host, trusted }
    }

    /// Bans a worker once, for rows that differ from the rendering that decides.
    fn ban(&mut self, renderer: Renderer, lease: Lease, decides: &str) {
        let Renderer { worker, host, trusted } = renderer;
        if self.verifications.banned.contains(&worker) {
            return;
        }
        self.verifications.banned.push_back(worker);
        if self.verifications.banned.len() > MAX_BANNED {
            self.verifications.banned.pop_front();
        }
        let Lease { frame, first_row, row_count, .. } = lease;
        let reason = format!(
            "it sent wrong pixels: rows {first_row}+{row_count} of frame {frame} differ from {decides}"
        );
        if !trusted {
            self.standings.ban(host);
        }
        self.remove_worker(worker);
        self.drop_verifications(|pending| pending.first.worker == worker);
        self.actions.push_back(Action::Ban { worker, reason });
    }
}
