//! Trust between this master and the workers of other machines: key, token and join line.
//!
//! The key and the token are made at the first start that needs them, and stay in the state folder, so that a worker that has joined
//! once joins again. Their files have mode 0600. The folder also has the workers that have joined, and the revoked keys.

#[cfg(feature = "discovery")]
mod announcement;
mod date;
#[cfg(any(feature = "discovery", feature = "web"))]
mod host_name;
mod state;
#[cfg(feature = "web")]
mod web;
mod workers;

use rayfarm_farm::Entrance;
use rayfarm_protocol::transport::{MasterSecurity, MasterTrust};
use tokio_util::sync::CancellationToken;

use crate::app::cli::{FarmArgs, MasterArgs, TrustAction, TrustArgs};
use crate::error::CommandError;

use date::utc;
use state::MasterState;
use workers::{KnownWorker, WorkerFiles};

#[cfg(feature = "web")]
pub(crate) use web::web_security;

/// Whether and how the connections of a farm are secured: with TLS where other machines can connect, unless the user refuses it.
///
/// # Errors
/// A state folder or a file in it that cannot be used.
pub(crate) fn security(args: &FarmArgs) -> Result<MasterSecurity, CommandError> {
    let is_open = args.listens_beyond_this_machine();
    if !args.secure && (args.insecure || !is_open) {
        if is_open {
            tracing::warn!(
                "--insecure: every machine that reaches this port can join, see the scene and send wrong pixels"
            );
        }
        return Ok(MasterSecurity::Plain);
    }
    MasterState::at(args.state.as_deref())?.trust().map(MasterSecurity::Tls)
}

/// Says how to start workers on other machines, and follows changes of the token. The join line is a secret: it is written to a
/// terminal and into no file. Dropping the result withdraws the announcement in the local network. Call it inside a runtime.
pub(crate) fn announce(args: &FarmArgs, entrance: &Entrance, stop: &CancellationToken) -> Announced {
    let MasterSecurity::Tls(trust) = &entrance.security else { return Announced::default() };
    if let Ok(state) = MasterState::at(args.state.as_deref()) {
        tokio::spawn(state.follow(trust.clone(), stop.clone()));
    }
    let reachable = entrance.reachable();
    if std::io::IsTerminal::is_terminal(&std::io::stderr()) {
        tracing::info!("only machines with this line can join: {}", reachable.command());
    } else {
        tracing::info!("only machines with the join line can join; {}", reachable.for_log());
    }
    Announced::of(args, entrance, trust)
}

/// The announcement of a master in its local network, if there is one. Dropping it withdraws it.
#[derive(Default)]
pub(crate) struct Announced {
    #[cfg(feature = "discovery")]
    _announcement: Option<announcement::Announcement>,
}

impl Announced {
    #[cfg(feature = "discovery")]
    fn of(args: &FarmArgs, entrance: &Entrance, trust: &MasterTrust) -> Self {
        if !args.listens_beyond_this_machine() || args.no_announce {
            return Self::default();
        }
        let started = announcement::Announcement::start(entrance.address, trust.key_hash());
        let failed = |error| tracing::warn!("workers cannot discover this master: {error}");
        Self { _announcement: started.map_err(failed).ok() }
    }

    #[cfg(not(feature = "discovery"))]
    fn of(_args: &FarmArgs, _entrance: &Entrance, _trust: &MasterTrust) -> Self {
        Self::default()
    }
}

/// Executes `trust`.
///
/// # Errors
/// A state folder or a file in it that cannot be used.
pub(crate) fn run(args: &TrustArgs) -> Result<(), CommandError> {
    match &args.action {
        TrustAction::Show(master) => show(master),
        TrustAction::Rotate { key, master } => rotate(*key, master).and_then(|()| show(master)),
        TrustAction::Workers(state) => list_workers(&MasterState::at(state.state.as_deref())?.workers()),
        TrustAction::Revoke { worker, state } => {
            revoke(&MasterState::at(state.state.as_deref())?.workers(), worker)
        }
        TrustAction::Allow { worker, state } => {
            allow(&MasterState::at(state.state.as_deref())?.workers(), worker)
        }
    }
}

/// Makes a new token, and a new key if requested.
fn rotate(key: bool, master: &MasterArgs) -> Result<(), CommandError> {
    MasterState::at(master.state.as_deref())?.rotate(key)?;
    let effect = if key {
        "the key and the token are new: masters that run keep the old key until they end"
    } else {
        "the token is new: connected workers stay, and the old join line is refused"
    };
    tracing::info!("{effect}");
    Ok(())
}

/// Prints the workers that have joined, and the revoked keys.
fn list_workers(files: &WorkerFiles) -> Result<(), CommandError> {
    let (joined, mut revoked) = (files.joined().map_err(unreadable)?, files.revoked().map_err(unreadable)?);
    for KnownWorker { key, name, first, last } in joined {
        let state = if revoked.remove(&key) { "revoked" } else { "allowed" };
        println!("{key}  {state}  first {}  last {}  {name}", utc(first), utc(last));
    }
    for key in revoked {
        println!("{key}  revoked");
    }
    Ok(())
}

fn revoke(files: &WorkerFiles, worker: &str) -> Result<(), CommandError> {
    let key = files.find(worker).map_err(CommandError::WrongInput)?;
    files.revoke(key).map_err(|error| CommandError::Failed(format!("the key is not revoked: {error}")))?;
    println!("{key}  revoked");
    tracing::info!(
        "a master that runs disconnects the worker within a second; a machine with its join line can still join with another \
         key, until `rayfarm-master trust rotate`"
    );
    Ok(())
}

fn allow(files: &WorkerFiles, worker: &str) -> Result<(), CommandError> {
    let key = files.find(worker).map_err(CommandError::WrongInput)?;
    let failed = |error| CommandError::Failed(format!("the key is still revoked: {error}"));
    if !files.allow(key).map_err(failed)? {
        return Err(CommandError::WrongInput(format!("the key {key} is not revoked")));
    }
    println!("{key}  allowed");
    Ok(())
}

fn unreadable(error: std::io::Error) -> CommandError {
    CommandError::Failed(format!("the list of workers cannot be read: {error}"))
}

/// Prints the join line for each address of this machine.
fn show(master: &MasterArgs) -> Result<(), CommandError> {
    let state = MasterState::at(master.state.as_deref())?;
    let security = MasterSecurity::Tls(state.trust()?);
    let reachable = Entrance { address: master.listen, security }.reachable();
    for command in reachable.commands() {
        println!("{command}");
    }
    if !reachable.from_outside {
        tracing::warn!("this machine has no address that others can reach: is it connected to a network?");
    }
    Ok(())
}
