//! The masters that a command line selects, and the commands for remembered masters.

use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;

use rayfarm_protocol::transport::{JoinLine, PrivateKey};

use super::{FarmArgs, StartError};
use crate::app::discovery;
use crate::app::target::Target;
use crate::app::trust::{JoinInput, MasterList, RememberedMaster, load_identity, state_folder};

/// Advice where no master is selected and none is remembered.
const NO_MASTER: &str = "no master is named and none is remembered: paste the join line that the master prints \
                         (rayfarm-worker --join rf1:...), search with --discover, or name a master without encryption \
                         with --master HOST:PORT";

/// Returns the masters to try, in order: those of the command line, of the environment, or the remembered ones.
///
/// # Errors
/// A join line that cannot be read, an unreadable file of masters, or no master at all.
pub(super) fn targets(farm: &FarmArgs, remember: bool) -> Result<Vec<Target>, StartError> {
    if let Some(master) = &farm.master {
        return Ok(vec![Target::plain(master)]);
    }
    if farm.discover {
        let known = load_masters().map(|list| list.masters().to_vec()).unwrap_or_default();
        let master = discovery::choose(&known).map_err(StartError::Failure)?;
        return Ok(vec![Target::encrypted(&identity()?, master, remember)]);
    }
    let line = match &farm.join {
        Some(input) => Some(input.line().map_err(StartError::Usage)?),
        None => JoinInput::of_environment().map_err(StartError::Usage)?,
    };
    if let Some(line) = line {
        return Ok(vec![Target::encrypted(&identity()?, named(line), remember)]);
    }
    let known = load_masters()?.masters().to_vec();
    if known.is_empty() {
        return Err(StartError::Usage(NO_MASTER.to_owned()));
    }
    let key = identity()?;
    Ok(known.into_iter().map(|master| Target::encrypted(&key, master, remember)).collect())
}

/// Gives a join line the name by which its master is remembered already, if it is.
fn named(line: JoinLine) -> RememberedMaster {
    let list = load_masters().ok();
    let known = list.as_ref().and_then(|list| list.masters().iter().find(|known| known.line.key == line.key));
    RememberedMaster::new(line, known.map(|known| known.name.as_str()))
}

/// Prints the remembered masters, one a line: name, address, first digits of the key. No token is printed.
pub(super) fn list_masters() -> Result<(), StartError> {
    let list = load_masters()?;
    if list.masters().is_empty() {
        tracing::info!("no master is remembered");
    }
    print_masters(list.masters())
}

/// Forgets the masters of a name, an address or a key's first digits; all where `text` is `None`.
pub(super) fn forget_masters(text: Option<&str>) -> Result<(), StartError> {
    let removed = load_masters()?.forget(text).map_err(|error| StartError::Failure(error.to_string()))?;
    if removed.is_empty()
        && let Some(text) = text
    {
        let text = rayfarm_text::printable(text);
        return Err(StartError::Failure(format!(
            "no remembered master has the name, the address or the key \"{text}\"; see rayfarm-worker masters"
        )));
    }
    print_masters(&removed)
}

fn print_masters(masters: &[RememberedMaster]) -> Result<(), StartError> {
    let mut output = std::io::stdout().lock();
    for RememberedMaster { line, name } in masters {
        let written = writeln!(output, "{name:<24} {:<32} {}", line.address, line.key.short());
        written.map_err(|error| StartError::Failure(format!("standard output: {error}")))?;
    }
    Ok(())
}

fn folder() -> Result<PathBuf, StartError> {
    state_folder().ok_or_else(|| StartError::Usage(NO_MASTER.to_owned()))
}

fn load_masters() -> Result<MasterList, StartError> {
    MasterList::load(&folder()?).map_err(|error| StartError::Failure(format!("remembered masters: {error}")))
}

fn identity() -> Result<Arc<PrivateKey>, StartError> {
    load_identity(state_folder().as_deref()).map_err(|error| StartError::Failure(error.to_string()))
}
