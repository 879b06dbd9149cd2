//! Every bound on what a peer can make this side hold, and for how long.

use std::time::Duration;

/// Body of a control message, and of anything sent before the handshake is done.
pub const MAX_CONTROL_BYTES: usize = 4 << 10;

/// A worker's name, its SIMD level, its software version: each.
pub const MAX_NAME_BYTES: usize = 255;

/// Render threads of a worker: more than its command line takes are a lie.
pub const MAX_THREADS: u32 = 65_535;

/// The reason in a refusal, a failure or a goodbye. Longer ones are cut before they are sent.
pub const MAX_REASON_BYTES: usize = 2 << 10;

/// The opaque view of one frame.
pub const MAX_VIEW_BYTES: usize = 4 << 10;

/// Width and height of a frame, in pixels.
pub const MAX_FRAME_SIDE: u32 = 32_768;

/// Bytes of one asset (2 GiB). A worker's own cache bound is usually far smaller and decides first.
pub const MAX_ASSET_BYTES: u64 = 2 << 30;

/// Bytes of an asset in one envelope. Small enough that a control message waits at most some 2 ms behind it on gigabit.
pub const MAX_CHUNK_BYTES: usize = 256 << 10;

/// Workers that one worker passes assets on to at a time; more wait.
pub const MAX_FOLLOWERS: usize = 8;

/// How long a worker keeps a whole asset ready to be passed on after it was last asked for.
pub const SHELF_TIME: Duration = Duration::from_secs(20);

/// Bytes of whole assets that a worker keeps for that alone (512 MiB).
pub const MAX_SHELF_BYTES: usize = 512 << 20;

/// How long another worker may take to accept a connection.
pub const PEER_CONNECT: Duration = Duration::from_secs(2);

/// A worker that passes on what it has yet to receive says so this often while it waits...
pub const PEER_PULSE: Duration = Duration::from_millis(500);

/// ...and so often in a row at most.
pub const MAX_PULSES: u32 = 240;

/// How long a worker may be silent in the middle of what it passes on.
pub const PEER_PATIENCE: Duration = Duration::from_secs(3);

/// Pixel bytes of one segment (32 MiB: a whole 3840 x 2160 frame fits). See [`max_lease_rows`].
pub const MAX_PIXELS_BYTES: usize = 32 << 20;

/// The longest value that [`crate::codec`] decodes (256 MiB): a scene body with a million single triangles and spheres.
pub const MAX_DECODE_BYTES: usize = 256 << 20;

/// Control messages that wait for the writer of a session.
pub const CONTROL_QUEUE: usize = 256;

/// Bulk messages that wait for the writer of a session.
pub const BULK_QUEUE: usize = 8;

/// Messages that were received and wait for the user of a session.
pub const INBOX_QUEUE: usize = 256;

/// Body bytes of those messages; the reader stops reading while they are more.
pub const INBOX_BYTES: usize = 2 * (MAX_PIXELS_BYTES + MAX_CONTROL_BYTES);

/// From the first byte of the preamble to the end of the handshake.
pub const HANDSHAKE_DEADLINE: Duration = Duration::from_secs(5);

/// How long the reader goes on after the writer has failed: the peer's last word may still be on its way in.
pub const LAST_WORD_GRACE: Duration = Duration::from_millis(500);

/// The slowest peer that is waited for in the middle of an envelope.
const SLOWEST_BYTES_PER_SECOND: u64 = 256 << 10;

/// How long an envelope with a body of `body_bytes` may take once it has begun, in either direction.
/// Between envelopes a peer may be silent for ever.
pub const fn envelope_deadline(body_bytes: usize) -> Duration {
    Duration::from_millis(10_000 + body_bytes as u64 * 1000 / SLOWEST_BYTES_PER_SECOND)
}

/// The most rows of a frame that one lease may cover, so that their raw pixels fit into one envelope; at least 1.
pub fn max_lease_rows(width: u32) -> u32 {
    let row_bytes = (width.max(1) as usize).saturating_mul(3);
    u32::try_from(MAX_PIXELS_BYTES / row_bytes).unwrap_or(u32::MAX).max(1)
}
