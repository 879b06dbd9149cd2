//! Bounds on everything that a peer can make this side hold, and on how long it can make it wait.

use std::time::Duration;

/// Largest body of a control message, and of every message of a handshake, in bytes (4 KiB).
pub const MAX_CONTROL_BYTES: usize = 4 << 10;

/// Number of bytes of the proof of a token.
pub const PROOF_BYTES: usize = 32;

/// Most bytes of a connection with TLS, records included, until the peer's hello has been read (16 KiB).
pub const MAX_UNAUTHENTICATED_BYTES: usize = 16 << 10;

/// Most tags of a worker.
pub const MAX_TAGS: usize = 16;

/// Largest tag of a worker, in bytes.
pub const MAX_TAG_BYTES: usize = 64;

/// Largest size of a worker's name, of its SIMD level and of its software version, in bytes each.
pub const MAX_NAME_BYTES: usize = 255;

/// Largest thread count accepted in a [`Hello`](crate::Hello).
pub const MAX_THREADS: u32 = 65_535;

/// Largest reason in a refusal, a failure or a disconnect, in bytes. Longer reasons are cut before they are sent.
pub const MAX_REASON_BYTES: usize = 2 << 10;

/// Largest opaque view of a frame, in bytes.
pub const MAX_VIEW_BYTES: usize = 4 << 10;

/// Largest width and largest height of a frame, in pixels.
pub const MAX_FRAME_SIDE: u32 = 32_768;

/// Largest asset, in bytes (2 GiB). The bound of a worker's own cache is usually far smaller and applies first.
pub const MAX_ASSET_BYTES: u64 = 2 << 30;

/// Most bytes of an asset in one envelope (256 KiB). A control message waits for one chunk at most: about 2 ms on gigabit
/// Ethernet.
pub const MAX_CHUNK_BYTES: usize = 256 << 10;

/// Most peers to which a worker sends assets at a time. More of them wait, after their requests have been checked.
pub const MAX_PEER_CLIENTS: usize = 8;

/// Time for which a worker keeps a complete asset for its peers after the last request for it.
pub const PEER_CACHE_TIME: Duration = Duration::from_secs(20);

/// Most bytes of complete assets that a worker keeps for its peers (512 MiB).
pub const MAX_PEER_CACHE_BYTES: usize = 512 << 20;

/// Time within which a peer must accept a connection.
pub const PEER_CONNECT_TIMEOUT: Duration = Duration::from_secs(2);

/// Interval of the keepalives that a worker sends to a peer while it waits for bytes of an asset itself.
pub const PEER_KEEPALIVE_INTERVAL: Duration = Duration::from_millis(500);

/// Most consecutive keepalives without a chunk of that asset between them.
pub const MAX_PEER_KEEPALIVES: u32 = 120;

/// Time without a chunk of any asset after which a transfer between workers has stalled, next to the master.
pub const PEER_STALL_LIMIT: Duration = Duration::from_secs(3);

/// Time that is added to [`PEER_STALL_LIMIT`] for each worker between the master and a worker.
pub const PEER_STALL_PER_HOP: Duration = Duration::from_millis(500);

/// Most workers between the master and a worker that count.
pub const MAX_PEER_HOPS: u64 = 24;

/// Longest silence of a peer in the middle of a transfer.
pub const PEER_TIMEOUT: Duration = Duration::from_secs(3);

/// Most pixel bytes of one segment (32 MiB: a whole frame of 3840 x 2160 pixels fits).
pub const MAX_PIXELS_BYTES: usize = 32 << 20;

/// Longest value that [`crate::codec`] decodes, in bytes (256 MiB): a scene body with a million triangles and spheres.
pub const MAX_DECODE_BYTES: usize = 256 << 20;

/// Capacity of a session's queue of outgoing control messages.
pub const CONTROL_QUEUE: usize = 256;

/// Capacity of a session's queue of outgoing bulk messages.
pub const BULK_QUEUE: usize = 8;

/// Capacity of a session's queue of received messages.
pub const INBOX_QUEUE: usize = 256;

/// Most body bytes in the queue of received messages. While there are more, the session does not read.
pub const INBOX_BYTES: usize = 2 * (MAX_PIXELS_BYTES + MAX_CONTROL_BYTES);

/// Most bytes of pixels that all sessions of a master receive at a time, the queues of received messages included (256 MiB).
pub const MAX_RECEIVING_BYTES: usize = 256 << 20;

/// Time limit from the first byte of the preamble to the end of the handshake.
pub const HANDSHAKE_DEADLINE: Duration = Duration::from_secs(5);

/// Time within which a master must receive the first byte of a connection.
pub const FIRST_BYTE_DEADLINE: Duration = Duration::from_secs(1);

/// Time for which a session reads on after its writer has failed or has written a disconnect: the peer's own disconnect
/// may be in the receive buffer.
pub const CLOSE_GRACE: Duration = Duration::from_millis(500);

/// Lowest data rate that is accepted in the middle of an envelope.
const MIN_BYTES_PER_SECOND: u64 = 256 << 10;

/// Lowest data rate that is accepted in the middle of pixels while other sessions wait for room.
const MIN_CONTENDED_BYTES_PER_SECOND: u64 = 8 << 20;

/// Time limit for an envelope with a body of `body_bytes`, in either direction, from its first byte to its last. The time
/// between two envelopes is unlimited.
pub const fn envelope_deadline(body_bytes: usize) -> Duration {
    Duration::from_millis(10_000 + body_bytes as u64 * 1000 / MIN_BYTES_PER_SECOND)
}

/// Time limit for a body with pixels of `body_bytes` while other sessions wait for its share of [`MAX_RECEIVING_BYTES`]: 2 s, and
/// 1 s for each 8 MiB.
pub const fn contended_deadline(body_bytes: usize) -> Duration {
    Duration::from_millis(2000 + body_bytes as u64 * 1000 / MIN_CONTENDED_BYTES_PER_SECOND)
}
