//! Errors that end a worker.

use rayfarm_protocol::ProtocolError;

/// Error that ends a worker, or a session where the worker reconnects.
#[derive(Debug, thiserror::Error)]
pub enum WorkerError {
    /// The master's address does not resolve on this machine.
    #[error("cannot resolve the master's address {master}: {source}; expected HOST:PORT with a known host")]
    Resolve {
        /// Address of the master.
        master: String,
        /// Error of the resolver.
        source: std::io::Error,
    },

    /// No process accepts connections at the master's address.
    #[error(
        "cannot connect to the master at {master}: {source}; is it running, listening there, and not behind a firewall?"
    )]
    Connect {
        /// Address of the master.
        master: String,
        /// Error of the system.
        source: std::io::Error,
    },

    /// The handshake with the process at the master's address failed.
    #[error("no session with the master at {master}: {source}")]
    Handshake {
        /// Address of the master.
        master: String,
        /// Error of the handshake.
        source: ProtocolError,
    },

    /// A session ended without a disconnect.
    #[error("lost the master at {master}: {why}")]
    Lost {
        /// Address of the master.
        master: String,
        /// Reason for the end.
        why: String,
    },

    /// The system does not start the threads.
    #[error("cannot start {threads} render threads: {source}; request fewer with --threads")]
    Threads {
        /// Number of threads requested.
        threads: usize,
        /// Error of the system.
        source: std::io::Error,
    },
}

impl WorkerError {
    /// Whether a later attempt to connect can succeed.
    ///
    /// `encrypted`: whether the worker connects through TLS. Only a master that has proved its key ends a worker for good.
    pub(crate) fn is_transient(&self, encrypted: bool) -> bool {
        match self {
            Self::Resolve { .. } | Self::Connect { .. } | Self::Lost { .. } => true,
            Self::Handshake { source, .. } => !source.is_final(encrypted),
            Self::Threads { .. } => false,
        }
    }
}
