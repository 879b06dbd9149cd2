//! The frames in flight: which begin, which give way to a newer camera, and when they are complete.

use super::forecast::Tiles;
use super::frame::Frame;
use super::{Action, FrameId, Request, Scheduler};

impl Scheduler {
    /// A request waits for its turn, in place of the one that waited before.
    pub(super) fn request(&mut self, request: Request) {
        if self.newest().is_some_and(|(width, height)| (width, height) != (request.width, request.height)) {
            self.drop_frames(request.frame);
        }
        self.supersede_newest();
        if let Some(replaced) = self.waiting.replace(request) {
            self.actions.push_back(Action::FrameDropped { frame: replaced.frame });
        }
        if self.frames.is_empty() {
            self.begin_waiting();
        }
    }

    /// The latest camera wins: the frame that idle workers have begun ahead of time gives way to a newer one while
    /// less than half of it is leased. The oldest frame never does, so that frames complete however fast the camera
    /// moves.
    fn supersede_newest(&mut self) {
        let newest = self.frames.back().filter(|frame| {
            self.frames.len() > 1 && u64::from(frame.rows_leased()) * 2 < u64::from(frame.height)
        });
        if let Some(frame) = newest.map(|frame| frame.id) {
            self.actions.push_back(Action::FrameDropped { frame });
            self.forget_frame(frame);
        }
    }

    /// Takes a frame out of flight. Workers that hold nothing else are told at once, the others when they may be: a
    /// cancellation names the first frame that is still wanted.
    pub(super) fn forget_frame(&mut self, frame: FrameId) {
        self.frames.retain(|known| known.id != frame);
        self.forget_audits(|audit| audit.lease.frame == frame);
        let before = FrameId(frame.0.saturating_add(1));
        let is_oldest = self.frames.front().is_none_or(|oldest| oldest.id > frame);
        for (&worker, known) in &mut self.workers {
            let left = known.forget(frame);
            let holds_nothing = known.leases.is_empty() && known.owed.is_empty();
            if left && (is_oldest || holds_nothing) && !known.audits_before(before) {
                known.told_to_cancel(before);
                self.actions.push_back(Action::Cancel { worker, before });
            }
        }
        if self.frames.is_empty() {
            self.begin_waiting();
        }
    }

    /// Picture size of the newest request that is not finished.
    fn newest(&self) -> Option<(u32, u32)> {
        let begun = self.frames.back().map(|frame| (frame.width, frame.height));
        self.waiting.map(|waiting| (waiting.width, waiting.height)).or(begun)
    }

    /// Gives up all that was requested before `next`: pictures of a size that nobody shows any more.
    fn drop_frames(&mut self, next: FrameId) {
        let begun = std::mem::take(&mut self.frames);
        for frame in begun {
            self.actions.push_back(Action::FrameDropped { frame: frame.id });
        }
        self.forget_audits(|_| true);
        self.cancel_leases(next);
    }

    /// Begins the request that waits, if there is one.
    pub(super) fn begin_waiting(&mut self) {
        let Some(Request { frame, width, height, tile_rows }) = self.waiting.take() else { return };
        let runs = self.policy.runs(height, self.max_rows(width));
        let tiles = Tiles { rows: tile_rows, share: self.tile_share };
        let forecast = self.costs.forecast(height, self.frames.len() + 1, tiles);
        self.frames.push_back(Frame::new(frame, (width, height), forecast, runs));
        self.actions.push_back(Action::BeginFrame { frame });
    }

    /// The most rows that one lease may have.
    pub(super) fn max_rows(&self, width: u32) -> u32 {
        let row_bytes = u64::from(width.max(1)) * 3;
        u32::try_from(self.max_segment_bytes / row_bytes).unwrap_or(u32::MAX).max(1)
    }

    /// Reports complete frames, oldest first, and lets the next one begin.
    pub(super) fn complete_frames(&mut self) {
        while let Some(frame) = self.frames.pop_front_if(|frame| frame.is_complete()) {
            self.costs.learn(&frame.forecast);
            self.outlive_audits(frame.id);
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

    /// Frees everybody who still renders for a frame before `before`, unless it verifies rows of one.
    fn cancel_leases(&mut self, before: FrameId) {
        for (&worker, known) in &mut self.workers {
            if known.cancel(before) {
                self.actions.push_back(Action::Cancel { worker, before });
            }
        }
    }
}
