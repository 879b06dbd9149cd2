//! The wire protocol of rayfarm: the messages between a master and its workers, over any byte stream.
//!
//! The crate renders nothing and opens no connection. Scenes, frames and pixels are opaque bytes, and a session runs over
//! any `AsyncRead + AsyncWrite`, an in-memory pipe included. [`tcp`] configures connections that its caller has opened.
//!
//! From the wire upwards:
//!
//! 1. [`handshake`]: a preamble of magic, version and role, then the worker's [`Hello`]. The preamble uses no codec, so
//!    that any two versions can report their mismatch.
//! 2. [`envelope`]: eight bytes (length, type, flags, stream) in front of every message, checked against [`limits`] before
//!    anything is allocated.
//! 3. [`message`]: [`ToWorker`] and [`ToMaster`]. Small messages are bincode ([`codec`]). Frames, asset chunks and pixels
//!    have heads of a fixed layout, and their bodies are not copied on the way out.
//! 4. [`peer`]: transfer of assets between workers, over connections of their own.
//! 5. [`session`]: one task that writes (control before bulk), one task that reads, bounded queues to the user.
//!
//! The feature `transport`, on by default, has everything that reads or writes a connection. Without it the crate has
//! ids, limits, messages and their bytes, and pixels, and depends on no async runtime.

#[cfg(feature = "transport")]
pub mod address;
pub mod codec;
mod cost;
pub mod envelope;
mod error;
#[cfg(feature = "transport")]
pub mod handshake;
mod ids;
pub mod limits;
pub mod message;
pub mod peer;
pub mod pixels;
#[cfg(feature = "transport")]
pub mod session;
#[cfg(feature = "transport")]
pub mod tcp;
mod token;

pub use cost::Cost;
pub use error::{ProtocolError, Role};
pub use ids::{AssetId, FrameId, Lease};
pub use message::{FrameAnnounce, Hello, Reconnect, ToMaster, ToWorker, Welcome};
pub use pixels::{Encoding, PixelFormat, PixelsHeader};

/// Version of everything after the preamble. It grows with every change that an older peer would misread.
pub const PROTOCOL_VERSION: u16 = 4;
