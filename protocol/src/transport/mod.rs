//! Connections, plain and encrypted, and the keys and tokens by which their ends know each other.
//!
//! 1. [`PrivateKey`]: the P-256 key of a master or a worker. Its public half, hashed ([`KeyHash`]), is the identity.
//! 2. [`JoinLine`]: address, key and token of a master as one line of text.
//! 3. [`MasterSecurity`] and [`WorkerSecurity`]: whether an end uses TLS, and with what.
//! 4. [`read_private`], [`write_private`]: small files of mode 0600.
//! 5. [`Connection`]: the stream that results from a handshake, with [`Connection::peer_key`].
//! 6. [`BrowserAcceptor`]: TLS for the web page of a master.
//!
//! Names and dates of certificates are ignored, so nothing depends on a clock.

mod bounded;
mod browser;
mod certificate;
mod connection;
mod join_line;
mod private_file;
mod private_key;
mod proof;
mod security;
pub(crate) mod tls;

pub use crate::key_hash::{KeyHash, KeyHashError};
pub use bounded::Bounded;
pub use browser::{BrowserAcceptor, BrowserStream};
pub use connection::Connection;
pub use join_line::{JoinLine, JoinLineError, JoinToken};
pub use private_file::{read_private, write_private};
pub use private_key::{PrivateKey, PrivateKeyError};
pub(crate) use proof::Proof;
pub use security::{JoinedWorker, MasterSecurity, MasterTrust, WorkerSecurity};
