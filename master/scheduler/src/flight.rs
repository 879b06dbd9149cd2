//! The frames in flight: which begin, which give way to a newer camera, and when they are complete.

use super::forecast::Tiles;
use super::frame::Frame;
use super::{Action, FrameId, Request, Scheduler};

impl Scheduler {
    /// A request waits for its turn, in place of the one that waited before.
    pub(super) fn request(&mut self, request: Request) {
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

    /// Gives up all that was requested before `next`: nobody wants it any more.
    pub(super) fn give_up(&mut self, next: FrameId) {
        let begun = std::mem::take(&mut self.frames).into_iter().map(|frame| frame.id);
        let waiting = self.waiting.take().map(|request| request.frame);
        self.actions.extend(begun.chain(waiting).map(|frame| Action::FrameDropped { frame }));
        self.forget_audits(|_| true);
        self.cancel_leases(next);
    }

    /// Whether the request that waits may begin beside the frames in flight. One of another size waits until they are
    /// complete: what is known of rows and of speeds is of one size at a time.
    pub(super) fn may_begin_beside(&self) -> bool {
        let size = self.waiting.map(|request| (request.width, request.height));
        let same_size = self.frames.iter().all(|frame| Some((frame.width, frame.height)) == size);
        self.frames.len() < self.max_frames() && same_size
    }

    /// Begins the request that waits, if there is one.
    pub(super) fn begin_waiting(&mut self) {
        let Some(Request { frame, width, height, tile_rows }) = self.waiting.take() else { return };
        self.take_width(width);
        let runs = self.policy.runs(height, self.max_rows(width));
        let tiles = Tiles { rows: tile_rows, share: self.tile_share };
        let forecast = self.costs.forecast(height, self.frames.len() + 1, tiles);
        self.frames.push_back(Frame::new(frame, (width, height), forecast, runs));
        self.actions.push_back(Action::BeginFrame { frame });
    }

    /// Speeds are told in rows, and rows of another width take another time.
    fn take_width(&mut self, width: u32) {
        let before = std::mem::replace(&mut self.width, width);
        if before != width && before > 0 && width > 0 {
            let factor = f64::from(before) / f64::from(width);
            self.workers.values_mut().for_each(|worker| worker.speed.rescale(factor));
        }
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
