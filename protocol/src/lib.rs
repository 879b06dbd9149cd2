//! The wire of rayfarm: what a master and its workers say to each other, over any byte stream.
//!
//! Nothing here renders or opens a socket: scenes, frames and pixels are bytes that pass through uninterpreted, and
//! sessions run over any `AsyncRead + AsyncWrite`, so one over an in-memory pipe is a session. ([`tcp`] only sets up
//! connections that somebody else has opened.)
//!
//! From the wire upwards:
//!
//! 1. [`handshake`]: a preamble of magic, version and role, then who the worker is. Done by hand, before any codec, so
//!    that two versions can always tell each other apart.
//! 2. [`envelope`]: eight bytes (length, type, flags, stream) in front of every message. What they announce is
//!    checked against [`limits`] before anything is allocated.
//! 3. [`message`]: [`ToWorker`] and [`ToMaster`]. Small ones are bincode ([`codec`]); frames, asset chunks and pixels
//!    have hand-laid heads and their bytes are never copied on the way out.
//! 4. [`passing`]: assets from worker to worker, over connections of their own.
//! 5. [`session`]: one task that writes (control before bulk), one that reads, bounded queues between them and the user.

pub mod address;
pub mod codec;
pub mod envelope;
mod error;
pub mod handshake;
mod ids;
pub mod limits;
pub mod message;
pub mod passing;
pub mod pixels;
pub mod session;
pub mod tcp;

pub use error::{ProtocolError, Role};
pub use ids::{AssetId, FrameId, Lease};
pub use message::{FrameAnnounce, Hello, Reconnect, ToMaster, ToWorker, Welcome};
pub use pixels::{Cost, Encoding, PixelsHeader};

/// Version of everything behind the preamble. It grows with every change that an older peer would misread.
pub const PROTOCOL_VERSION: u16 = 4;
