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
//!
//! # Example
//!
//! A message as bytes on the wire, and back:
//!
//! ```
//! use rayfarm_protocol::envelope::{read_body, read_header};
//! use rayfarm_protocol::message::Message;
//! use rayfarm_protocol::{FrameId, Lease, ToWorker};
//!
//! # #[tokio::main(flavor = "current_thread")]
//! # async fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let lease = Lease { frame: FrameId(7), segment: 3, attempt: 0, first_row: 48, row_count: 16 };
//! let mut wire = Vec::new();
//! ToWorker::Segment(lease).to_envelope()?.write(&mut wire).await?;
//!
//! let mut stream = wire.as_slice();
//! let header = read_header(&mut stream).await?.ok_or("the stream is empty")?;
//! let body = read_body(&mut stream, header).await?;
//! assert_eq!(ToWorker::from_body(header.kind, body)?, ToWorker::Segment(lease));
//! # Ok(())
//! # }
//! ```

#[cfg(feature = "transport")]
pub mod address;
#[cfg(feature = "transport")]
pub mod admission;
pub mod codec;
mod cost;
pub mod envelope;
mod error;
#[cfg(feature = "transport")]
pub mod handshake;
mod hex;
mod ids;
mod key_hash;
mod kind;
pub mod limits;
pub mod message;
pub mod peer;
pub mod pixels;
#[cfg(feature = "transport")]
pub mod session;
#[cfg(feature = "transport")]
pub mod tcp;
mod token;
#[cfg(feature = "transport")]
pub mod transport;

pub use cost::Cost;
pub use error::{ProtocolError, Role};
pub use ids::{AssetId, FrameId, Lease};
pub use key_hash::{KeyHash, KeyHashError};
pub use message::{FrameAnnounce, Hello, Reconnect, ToMaster, ToWorker, Welcome};
pub use pixels::{Encoding, PixelFormat, PixelsHeader};

/// Version of everything after the preamble. It grows with every change that an older peer would misread.
pub const PROTOCOL_VERSION: u16 = 7;
