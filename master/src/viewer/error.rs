//! Errors that end a viewer.

use rayfarm_farm::FarmError;

use super::frame_log::FrameLogError;

/// Reason for which a viewer ended before its displays did.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ViewerError {
    /// The farm cannot render the requested frame, or has no worker left for a sequence.
    #[error(transparent)]
    Farm(#[from] FarmError),
    /// The frame log cannot be written.
    #[error(transparent)]
    Log(#[from] FrameLogError),
}
