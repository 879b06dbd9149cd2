//! Frames in flight: which begin, which a newer request supersedes, and when they are complete.

use super::forecast::Tiles;
use super::frame::Frame;
use super::{Action, FrameId, Scheduler};

/// A requested frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Request {
    pub(super) frame: FrameId,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) row_bytes: u64,
    pub(super) tile_rows: u32,
}

impl Scheduler {
    /// Queues a request, in place of a waiting one.
    pub(super) fn request(&mut self, request: Request) {
        self.supersede_newest();
        if let Some(replaced) = self.waiting.replace(request) {
            self.actions.push_back(Action::FrameDropped { frame: replaced.frame });
        }
        if self.frames.is_empty() {
            self.begin_waiting();
        }
    }

    /// Drops the second frame in flight for a newer request while less than half of it is leased: the latest camera
    /// wins. The oldest frame stays, so that frames complete however fast the camera moves.
    fn supersede_newest(&mut self) {
        let newest = self.frames.back().filter(|frame| {
            self.frames.len() > 1 && u64::from(frame.rows_leased()) * 2 < u64::from(frame.height)
        });
        if let Some(frame) = newest.map(|frame| frame.id) {
            self.actions.push_back(Action::FrameDropped { frame });
            self.forget_frame(frame);
        }
    }

    /// Removes a frame from flight. A cancellation names the first frame that is still requested, so workers with
    /// leases of older frames get theirs later.
    pub(super) fn forget_frame(&mut self, frame: FrameId) {
        self.frames.retain(|known| known.id != frame);
        self.drop_verifications(|pending| pending.lease.frame == frame);
        let before = FrameId(frame.0.saturating_add(1));
        let is_oldest = self.frames.front().is_none_or(|oldest| oldest.id > frame);
        for (&worker, known) in &mut self.workers {
            let dropped = known.drop_frame(frame);
            let holds_nothing = known.leases.is_empty() && known.overdue.is_empty();
            if dropped && (is_oldest || holds_nothing) && !known.verifies_before(before) {
                known.mark_cancelled(before);
                self.actions.push_back(Action::Cancel { worker, before });
            }
        }
        if self.frames.is_empty() {
            self.begin_waiting();
        }
    }

    /// Drops all frames in flight and the waiting request: only frames from `next` on are still requested.
    pub(super) fn drop_requests(&mut self, next: FrameId) {
        let begun = std::mem::take(&mut self.frames).into_iter().map(|frame| frame.id);
        let waiting = self.waiting.take().map(|request| request.frame);
        self.actions.extend(begun.chain(waiting).map(|frame| Action::FrameDropped { frame }));
        self.drop_verifications(|_| true);
        self.cancel_leases(next);
    }

    /// Whether the waiting request may begin while other frames are in flight. A request of another size waits until
    /// they are complete: costs of rows and speeds are known for one size at a time.
    pub(super) fn may_pipeline(&self) -> bool {
        let size = self.waiting.map(|request| (request.width, request.height));
        let same_size = self.frames.iter().all(|frame| Some((frame.width, frame.height)) == size);
        self.frames.len() < self.max_frames() && same_size
    }

    /// Begins the waiting request, if there is one.
    pub(super) fn begin_waiting(&mut self) {
        let Some(Request { frame, width, height, row_bytes, tile_rows }) = self.waiting.take() else {
            return;
        };
        self.set_width(width);
        let max_rows = self.max_rows(row_bytes);
        let ranges = self.policy.ranges(height, max_rows);
        let tiles = Tiles { rows: tile_rows, share: self.tile_share };
        let forecast = self.costs.forecast(height, self.frames.len() + 1, tiles);
        self.frames.push_back(Frame::new(frame, (width, height), forecast, ranges).with_max_rows(max_rows));
        self.actions.push_back(Action::BeginFrame { frame });
    }

    /// Sets the width of the next frame and rescales speeds, which count rows: the time of a row is in proportion to its
    /// width.
    fn set_width(&mut self, width: u32) {
        let before = std::mem::replace(&mut self.width, width);
        if before != width && before > 0 && width > 0 {
            let factor = f64::from(before) / f64::from(width);
            self.workers.values_mut().for_each(|worker| worker.speed.rescale(factor));
        }
    }

    /// Largest number of rows of one lease.
    fn max_rows(&self, row_bytes: u64) -> u32 {
        u32::try_from(self.max_segment_bytes / row_bytes.max(1)).unwrap_or(u32::MAX).max(1)
    }

    /// Reports complete frames, oldest first, and lets the next one begin.
    pub(super) fn complete_frames(&mut self) {
        while let Some(frame) = self.frames.pop_front_if(|frame| frame.is_complete()) {
            self.costs.learn(&frame.forecast);
            self.expire_verifications(frame.id);
            let next = FrameId(frame.id.0.saturating_add(1));
            self.cancel_leases(self.frames.front().map_or(next, |frame| frame.id));
            let elapsed = self.handled_at.saturating_sub(frame.started_at.unwrap_or(self.handled_at));
            self.last_frame = elapsed;
            self.actions.push_back(Action::FrameDone { frame: frame.id, cost: frame.cost(), elapsed });
            if self.frames.is_empty() {
                self.begin_waiting();
            }
        }
    }

    /// Cancels the leases of frames before `before`, except those of second renderings.
    fn cancel_leases(&mut self, before: FrameId) {
        for (&worker, known) in &mut self.workers {
            if known.cancel(before) {
                self.actions.push_back(Action::Cancel { worker, before });
            }
        }
    }
}
