//! Errors of a farm, with remedies.

use std::io::ErrorKind;
use std::net::SocketAddr;

use rayfarm_protocol::FrameId;
use rayfarm_tracer::scene::ValidateError;

use crate::assets::AssetError;

/// A command names a worker that is not connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no worker {0} is connected; the status lists the connected ones")]
pub struct UnknownWorker(pub u64);

/// An error that keeps a farm from starting or from completing a frame.
#[derive(Debug, thiserror::Error)]
pub enum FarmError {
    /// Binding the listening address failed.
    #[error("cannot listen for workers on {address}: {source}; {}", remedy(source, address))]
    Listen {
        /// The requested address.
        address: SocketAddr,
        /// The operating system's error.
        source: std::io::Error,
    },
    /// The scene cannot be sent to workers.
    #[error(transparent)]
    Assets(#[from] AssetError),
    /// Segments are to be verified, and the system has no random numbers: workers could predict the choice.
    #[error("cannot draw the segments to verify: {0}; run without --verify")]
    Random(String),
    /// A requested view cannot be rendered.
    #[error("this frame cannot be rendered: {0}")]
    View(#[source] ValidateError),
    /// Every worker has refused a frame several times.
    #[error(
        "no worker can render frame {frame} ({reasons}); check the workers' messages, or change the scene"
    )]
    Refused {
        /// The frame.
        frame: FrameId,
        /// The workers' reasons.
        reasons: String,
    },
    /// All local workers have exited, and no other worker is connected.
    #[error(
        "no worker is left: {reason}; check its messages above, or start workers by hand: \
         rayfarm-worker --master {address}"
    )]
    NoWorkers {
        /// Reason for which the last local worker ended.
        reason: String,
        /// The address where workers connect.
        address: SocketAddr,
    },
}

fn remedy(error: &std::io::Error, address: &SocketAddr) -> String {
    let port = address.port();
    match error.kind() {
        ErrorKind::AddrInUse => format!(
            "port {port} belongs to another program (another rayfarm-master?): end it, or choose another port with \
             --listen {}:PORT",
            address.ip()
        ),
        ErrorKind::AddrNotAvailable => format!(
            "{} is no address of this machine; --listen 0.0.0.0:{port} listens on all its addresses",
            address.ip()
        ),
        ErrorKind::PermissionDenied => "choose a port above 1023 with --listen ADDR:PORT".to_owned(),
        _ => "choose another address or port with --listen ADDR:PORT".to_owned(),
    }
}
