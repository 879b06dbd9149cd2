//! Search for masters on the local network, and the choice of one of them.
//!
//! An answer is not authenticated: it proposes an address and a key. The worker proves the token to the holder of that key
//! only, and by a proof that does not reveal it, so a false answer gains nothing.

mod found;
#[cfg(feature = "discovery")]
mod mdns;

use rayfarm_protocol::transport::{JoinLine, JoinToken};

use self::found::FoundMaster;
use super::terminal::ask_secret;
use super::trust::RememberedMaster;

/// Searches for masters, and returns the one to join: the first that is remembered, else the only one, whose token is
/// requested on the terminal.
///
/// # Errors
/// No master, several unknown masters, no token, and errors of the network. The message says what to do.
pub(super) fn choose(known: &[RememberedMaster]) -> Result<RememberedMaster, String> {
    let found = search()?;
    for master in &found {
        eprintln!("{master}");
    }
    match select(&found, known) {
        Selection::Known(master) => Ok(master),
        Selection::None => {
            Err("no master answers on this network; paste the join line that the master prints: \
                                rayfarm-worker --join rf1:..."
                .to_owned())
        }
        Selection::Several(count) => Err(format!(
            "{count} masters answer and none of them is remembered; paste the join line of one of them: \
             rayfarm-worker --join rf1:..."
        )),
        Selection::Unknown(master) => join_unknown(&master),
    }
}

#[cfg(feature = "discovery")]
fn search() -> Result<Vec<FoundMaster>, String> {
    mdns::search()
}

#[cfg(not(feature = "discovery"))]
fn search() -> Result<Vec<FoundMaster>, String> {
    Err("this program was built without the feature \"discovery\"; use --join".to_owned())
}

/// Result of comparing the masters that answered with those that are remembered.
#[derive(Debug, PartialEq, Eq)]
enum Selection {
    None,
    Several(usize),
    Unknown(FoundMaster),
    Known(RememberedMaster),
}

/// Compares found masters with remembered ones, by their keys. A remembered master is joined at the found address.
fn select(found: &[FoundMaster], known: &[RememberedMaster]) -> Selection {
    for RememberedMaster { line, .. } in known {
        if let Some(master) = found.iter().find(|master| master.key == line.key) {
            let line = JoinLine { address: master.address.clone(), ..line.clone() };
            return Selection::Known(RememberedMaster::new(line, Some(&master.name)));
        }
    }
    match found {
        [] => Selection::None,
        [master] => Selection::Unknown(master.clone()),
        several => Selection::Several(several.len()),
    }
}

/// Requests the token of an unknown master on the terminal. A whole join line is accepted as well.
fn join_unknown(master: &FoundMaster) -> Result<RememberedMaster, String> {
    let question = format!("token of the farm, from the join line of {}: ", master.name);
    let answer = ask_secret(&question).map_err(|error| format!("standard input: {error}"))?;
    let answer = answer.ok_or(
        "standard input is no terminal, so the token cannot be requested; \
         pass the join line on standard input: rayfarm-worker --join -",
    )?;
    let line = match answer.trim().parse::<JoinToken>() {
        Ok(token) => JoinLine { address: master.address.clone(), key: master.key, token },
        Err(token_error) => answer.parse().map_err(|_| token_error.to_string())?,
    };
    Ok(RememberedMaster::new(line, Some(&master.name)))
}

#[cfg(test)]
mod tests {
    use rayfarm_protocol::transport::KeyHash;

    use super::*;

    fn found(number: u8) -> FoundMaster {
        FoundMaster {
            name: format!("farm {number}"),
            address: format!("10.0.0.{number}:7117"),
            key: KeyHash([number; 32]),
        }
    }

    fn known(number: u8) -> RememberedMaster {
        let line = JoinLine {
            address: "old:1".to_owned(),
            key: KeyHash([number; 32]),
            token: JoinToken([number; 16]),
        };
        RememberedMaster::new(line, None)
    }

    #[test]
    fn a_remembered_master_is_joined_at_the_address_that_was_found() {
        let Selection::Known(master) = select(&[found(1), found(2)], &[known(3), known(2)]) else {
            panic!("no selection");
        };
        assert_eq!((master.line.address.as_str(), master.name.as_str()), ("10.0.0.2:7117", "farm 2"));
        assert_eq!((master.line.key, master.line.token), (KeyHash([2; 32]), JoinToken([2; 16])));
    }

    #[test]
    fn unknown_masters_are_joined_only_where_one_answers() {
        assert_eq!(select(&[], &[known(1)]), Selection::None);
        assert_eq!(select(&[found(1)], &[known(2)]), Selection::Unknown(found(1)));
        assert_eq!(select(&[found(1), found(2)], &[]), Selection::Several(2));
    }
}
