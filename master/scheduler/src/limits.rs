//! Bounds that several parts of the scheduler share.

/// Frames in flight at most: the oldest, and one that idle workers begin while the last rows of the oldest are rendered.
pub(super) const MAX_FRAMES: usize = 2;
/// Complete frames whose verifications may still be pending.
pub(super) const TRAILING_FRAMES: usize = 2;
/// Leases of one worker at most under the policies `static` and `smart`: one to render and one to continue with.
pub(super) const FIXED_POLICY_WINDOW: usize = 2;
/// Leases of one worker at most under any policy.
pub(super) const MAX_WINDOW: usize = 64;
