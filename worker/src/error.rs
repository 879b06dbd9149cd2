//! Why a worker ends without having been asked to.

use rayfarm_protocol::ProtocolError;

/// Why a worker gave up.
#[derive(Debug, thiserror::Error)]
pub enum WorkerError {
    /// The master's address has no meaning on this machine.
    #[error(
        "cannot resolve the master's address {master}: {source}; it must be HOST:PORT, and the host known here"
    )]
    Resolve {
        /// What was asked for.
        master: String,
        /// The resolver's answer.
        source: std::io::Error,
    },

    /// Nobody answers there.
    #[error(
        "cannot connect to the master at {master}: {source}; is it running, listening there, and not behind a firewall?"
    )]
    Connect {
        /// What was asked for.
        master: String,
        /// The system's answer.
        source: std::io::Error,
    },

    /// Somebody answers, but we did not come to terms.
    #[error("no session with the master at {master}: {source}")]
    Handshake {
        /// What was asked for.
        master: String,
        /// Why.
        source: ProtocolError,
    },

    /// A session ended without a goodbye.
    #[error("lost the master at {master}: {why}")]
    Lost {
        /// What was asked for.
        master: String,
        /// Why.
        why: String,
    },

    /// This machine does not give us threads.
    #[error("cannot start {threads} render threads: {source}; ask for fewer with --threads")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// The system's answer.
        source: std::io::Error,
    },
}

impl WorkerError {
    /// Whether connecting again later can help.
    pub(crate) fn is_passing(&self) -> bool {
        match self {
            Self::Resolve { .. } | Self::Connect { .. } | Self::Lost { .. } => true,
            Self::Handshake { source, .. } => !source.is_final(),
            Self::Threads { .. } => false,
        }
    }
}
