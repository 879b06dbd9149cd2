//! Why a farm cannot start or go on, and what to do about it.

use std::io::ErrorKind;
use std::net::SocketAddr;

use rayfarm_tracer::scene::ValidateError;

use crate::assets::AssetError;
use rayfarm_protocol::FrameId;

/// A command names a worker that is not connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no worker {0} is connected; the status lists those that are")]
pub struct UnknownWorker(pub u64);

/// Why a farm cannot start or go on.
#[derive(Debug, thiserror::Error)]
pub enum FarmError {
    /// The address cannot be listened on.
    #[error("cannot listen for workers on {address}: {source}; {}", remedy(source, address))]
    Listen {
        /// What was asked for.
        address: SocketAddr,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The scene cannot be sent to workers.
    #[error(transparent)]
    Assets(#[from] AssetError),
    /// Segments are to be verified, and nothing draws which: workers could foresee them.
    #[error("cannot draw which segments to verify: {0}; run without --verify")]
    Random(String),
    /// A frame was requested that cannot be rendered.
    #[error("this frame cannot be rendered: {0}")]
    View(#[source] ValidateError),
    /// Every worker has refused a frame again and again.
    #[error(
        "no worker can render frame {frame} ({reasons}); look at what the workers say, or change the scene"
    )]
    Refused {
        /// Which frame.
        frame: FrameId,
        /// What the workers say.
        reasons: String,
    },
    /// Nobody is left to render: the local workers keep dying, and no other is connected.
    #[error(
        "no worker is left: {reason}; look at its messages above, or start workers by hand: \
         rayfarm-worker --master {address}"
    )]
    NoWorkers {
        /// What became of the last local worker.
        reason: String,
        /// Where workers connect.
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
            "{} is no address of this machine; --listen 0.0.0.0:{port} listens on all it has",
            address.ip()
        ),
        ErrorKind::PermissionDenied => "choose a port above 1023 with --listen ADDR:PORT".to_owned(),
        _ => "choose another address or port with --listen ADDR:PORT".to_owned(),
    }
}
