//! Access to the web display: its token and its encryption.

use std::net::SocketAddr;

use rayfarm_protocol::transport::{BrowserAcceptor, JoinToken};

use super::host_name::host_name;
use super::state::MasterState;
use crate::app::cli::FarmArgs;
use crate::display::web::WebSecurity;
use crate::error::CommandError;

/// Token and encryption of a web display at an address: TLS with the key of the master where other machines can connect, except
/// with `--insecure`. The token is in the state folder, so that an open page can connect to a restarted master.
///
/// # Errors
/// A state folder or a file in it that cannot be used, where other machines can connect.
pub(crate) fn web_security(args: &FarmArgs, address: SocketAddr) -> Result<WebSecurity, CommandError> {
    let is_local = address.ip().to_canonical().is_loopback();
    let names = host_name().into_iter().collect();
    let stored = MasterState::at(args.state.as_deref()).and_then(|state| Ok((state.web_token()?, state)));
    let (token, state) = match stored {
        Ok(stored) => stored,
        Err(problem) if is_local => {
            tracing::debug!("the token of the web display is for this run only: {problem}");
            let token = JoinToken::random().map_err(CommandError::failed)?;
            return Ok(WebSecurity { token, acceptor: None, names });
        }
        Err(problem) => return Err(problem),
    };
    let acceptor = match (is_local, args.insecure) {
        (true, _) => None,
        (false, true) => {
            tracing::warn!(
                "--insecure: everything between the web display and its pages can be read and altered, the token included"
            );
            None
        }
        (false, false) => {
            let trust = state.trust()?;
            tracing::info!(
                "browsers warn before they open the page, because no authority has signed its certificate; \
                 the SHA-256 fingerprint of its public key is {}",
                trust.key_hash()
            );
            Some(BrowserAcceptor::new(trust.key()).map_err(CommandError::failed)?)
        }
    };
    Ok(WebSecurity { token, acceptor, names })
}
