//! Options of `trust`.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;

use clap::{Args, Subcommand};
use rayfarm_farm::DEFAULT_PORT;

use super::values::listen_address;

/// Options of `trust`.
#[derive(Clone, Debug, Args)]
pub(crate) struct TrustArgs {
    #[command(subcommand)]
    pub(crate) action: TrustAction,
}

/// Actions of `trust`.
#[derive(Clone, Debug, Subcommand)]
pub(crate) enum TrustAction {
    /// Print the command that starts a worker on another machine, one line for each address of this machine. The line contains a
    /// secret.
    Show(MasterArgs),
    /// Make a new token: connected workers stay, and the old join line is refused. Print the new line.
    Rotate {
        /// Make a new key as well: no worker that has joined before trusts this master any more.
        #[arg(long)]
        key: bool,
        #[command(flatten)]
        master: MasterArgs,
    },
    /// List the workers that have joined, by key, name and time, the most recent first, and the revoked keys.
    Workers(StateArgs),
    /// Refuse a worker for good, by its key: a master that runs disconnects it.
    Revoke {
        /// Name of the worker, its key, or at least eight first digits of the key.
        #[arg(value_name = "NAME|KEY")]
        worker: String,
        #[command(flatten)]
        state: StateArgs,
    },
    /// Admit a revoked worker again.
    Allow {
        /// Name of the worker, its key, or at least eight first digits of the key.
        #[arg(value_name = "NAME|KEY")]
        worker: String,
        #[command(flatten)]
        state: StateArgs,
    },
}

/// The state folder of a master.
#[derive(Clone, Debug, Args)]
pub(crate) struct StateArgs {
    /// Folder with the key and the token of the master; without it, in the user's state folder.
    #[arg(long, value_name = "DIR")]
    pub(crate) state: Option<PathBuf>,
}

/// The master whose join line is meant.
#[derive(Clone, Debug, Args)]
pub(crate) struct MasterArgs {
    /// Address at which the master listens or will listen.
    #[arg(long, value_name = "ADDR:PORT", value_parser = listen_address,
          default_value_t = SocketAddr::from((Ipv4Addr::UNSPECIFIED, DEFAULT_PORT)))]
    pub(crate) listen: SocketAddr,
    /// Folder with the key and the token of the master; without it, in the user's state folder.
    #[arg(long, value_name = "DIR")]
    pub(crate) state: Option<PathBuf>,
}
