//! Rules for requests: which are refused, and the access level of the others.
//!
//! Programs of other machines, and web pages that a user of this machine has open, can send requests. A request must name this
//! server and not a foreign name that resolves to it (DNS rebinding), and must not come from a page of another server. The token
//! makes its sender an owner. Without it a request is answered on loopback only, as one of a guest, because all users of a
//! machine can reach its ports.

use std::net::{IpAddr, SocketAddr};
use std::str::FromStr;

use axum::http::header::{AUTHORIZATION, COOKIE, HOST, ORIGIN};
use axum::http::{HeaderMap, StatusCode, Uri};
use rayfarm_protocol::transport::JoinToken;

/// Commands of guests. They change at most the view.
const GUEST_COMMANDS: [&str; 4] = ["help", "set", "status", "workers"];

/// Header with which browsers report the origin of a request.
const FETCH_SITE: &str = "sec-fetch-site";

/// Rules of one server.
#[derive(Debug)]
pub(super) struct Access {
    token: JoinToken,
    /// Whether only this machine can connect.
    is_local: bool,
    /// `http` or `https`.
    scheme: &'static str,
    /// Names of this machine, in lower case.
    names: Vec<String>,
    /// Name of the cookie with the token. Cookies do not depend on ports, so it has the port.
    cookie: String,
}

/// What a request may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Level {
    /// See and move the picture.
    Guest,
    /// See the log and the join line, and command workers as well.
    Owner,
}

/// Reason for which a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    /// The request names another server.
    Host,
    /// The request comes from a page of another server.
    Origin,
    /// The request has no token, or a wrong one.
    Token,
}

impl Level {
    /// Whether a sender of this level may send a control command.
    pub(super) fn allows(self, command: &str) -> bool {
        let word = command.split_whitespace().next().unwrap_or_default();
        self == Self::Owner || GUEST_COMMANDS.contains(&word)
    }
}

impl Refusal {
    /// Status of the response, and the text for its reader.
    pub(super) fn response(self) -> (StatusCode, &'static str) {
        match self {
            Self::Host => (
                StatusCode::MISDIRECTED_REQUEST,
                "The Host header names another server: use the address that the master's log names.\n",
            ),
            Self::Origin => (
                StatusCode::FORBIDDEN,
                "The request comes from a page of another server: open the address that the master's log names.\n",
            ),
            Self::Token => (
                StatusCode::UNAUTHORIZED,
                "The token is missing or wrong: open the address that the master's log names, or send the header \
                 Authorization: Bearer TOKEN.\n",
            ),
        }
    }
}

impl Access {
    /// Rules of a server that listens at `address`; `names`: names of this machine.
    pub(super) fn new(token: JoinToken, address: SocketAddr, encrypted: bool, names: &[String]) -> Self {
        let name = |name: &String| name.to_ascii_lowercase();
        Self {
            token,
            is_local: address.ip().to_canonical().is_loopback(),
            scheme: if encrypted { "https" } else { "http" },
            names: names.iter().flat_map(|it| [name(it), format!("{}.local", name(it))]).collect(),
            cookie: format!("rayfarm_{}", address.port()),
        }
    }

    /// Path and query with the token, relative to the server.
    pub(super) fn entrance(&self) -> String {
        format!("/?token={}", self.token)
    }

    /// `http` or `https`.
    pub(super) fn scheme(&self) -> &'static str {
        self.scheme
    }

    /// The level of a request.
    ///
    /// # Errors
    /// A request that is not answered.
    pub(super) fn level(&self, headers: &HeaderMap, uri: &Uri) -> Result<Level, Refusal> {
        let text = |name| headers.get(name).map(|value| value.to_str().unwrap_or_default());
        let host = text(HOST.as_str()).filter(|_| headers.get_all(HOST).iter().count() == 1);
        let host = host.filter(|host| self.is_own(host)).ok_or(Refusal::Host)?;
        let own_origin = format!("{}://{host}", self.scheme);
        if text(ORIGIN.as_str()).is_some_and(|origin| !origin.eq_ignore_ascii_case(&own_origin)) {
            return Err(Refusal::Origin);
        }
        // A link on another page may open the first page, which shows nothing without the token.
        let from = text(FETCH_SITE);
        if uri.path() != "/" && from.is_some_and(|site| !matches!(site, "same-origin" | "none")) {
            return Err(Refusal::Origin);
        }
        match (self.has_token(headers), self.is_local) {
            (true, _) => Ok(Level::Owner),
            (false, true) => Ok(Level::Guest),
            (false, false) => Err(Refusal::Token),
        }
    }

    /// Value of `Set-Cookie`, if the query of a request has the right token.
    pub(super) fn cookie_for(&self, uri: &Uri) -> Option<String> {
        let pairs = uri.query()?.split('&').filter_map(|pair| pair.split_once('='));
        let mut given = pairs.filter(|(name, _)| *name == "token").map(|(_, value)| value);
        given.find(|value| self.is_token(value))?;
        let secure = if self.scheme == "https" { "; Secure" } else { "" };
        Some(format!(
            "{}={}; Path=/; HttpOnly; SameSite=Strict; Max-Age=31536000{secure}",
            self.cookie, self.token
        ))
    }

    /// Whether the headers have the token, as a cookie or as a bearer token.
    fn has_token(&self, headers: &HeaderMap) -> bool {
        let texts = |name| headers.get_all(name).iter().filter_map(|value| value.to_str().ok());
        let cookies = texts(COOKIE).flat_map(|cookies| cookies.split(';'));
        let mut own = cookies
            .filter_map(|cookie| cookie.trim().split_once('='))
            .filter(|(name, _)| *name == self.cookie);
        own.any(|(_, value)| self.is_token(value))
            || texts(AUTHORIZATION)
                .filter_map(|value| value.strip_prefix("Bearer "))
                .any(|value| self.is_token(value.trim()))
    }

    /// Whether a text is the token. Compares in constant time.
    fn is_token(&self, text: &str) -> bool {
        JoinToken::from_str(text).is_ok_and(|token| token == self.token)
    }

    /// Whether a host with its port names this server. The port is not compared: a forwarded connection has another one.
    /// Names that an attacker can register are refused, and addresses in digits cannot be registered.
    fn is_own(&self, host: &str) -> bool {
        let name = match host.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
            Some((name, port)) if port.is_empty() || is_port(port) => name,
            Some(_) => return false,
            None => match host.split_once(':') {
                Some((name, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) => name,
                Some(_) => return false,
                None => host,
            },
        };
        match name.parse::<IpAddr>() {
            Ok(ip) => !self.is_local || ip.to_canonical().is_loopback(),
            Err(_) => {
                let name = name.to_ascii_lowercase();
                name == "localhost" || !self.is_local && self.names.contains(&name)
            }
        }
    }
}

fn is_port(text: &str) -> bool {
    text.strip_prefix(':').is_some_and(|port| port.bytes().all(|byte| byte.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOKEN: JoinToken = JoinToken([0xab; 16]);
    const TEXT: &str = "abababababababababababababababab";

    fn access(address: &str) -> Access {
        Access::new(TOKEN, address.parse().unwrap(), false, &["Mill".to_owned()])
    }

    fn level(access: &Access, path: &str, headers: &[(&'static str, &str)]) -> Result<Level, Refusal> {
        let headers = headers.iter().map(|(name, value)| {
            (axum::http::HeaderName::from_static(name), axum::http::HeaderValue::from_str(value).unwrap())
        });
        access.level(&headers.collect(), &path.parse().unwrap())
    }

    #[test]
    fn foreign_names_are_refused() {
        let local = access("127.0.0.1:8080");
        for host in ["127.0.0.1:8080", "localhost:8080", "LOCALHOST", "[::1]:9000", "localhost:9"] {
            assert_eq!(level(&local, "/", &[("host", host)]), Ok(Level::Guest), "{host}");
        }
        for host in [
            "evil.example:8080",
            "127.0.0.1.evil.example",
            "192.168.1.2:8080",
            "mill:8080",
            "",
            "[::1]x",
            "localhost:80:80",
        ] {
            assert_eq!(level(&local, "/", &[("host", host)]), Err(Refusal::Host), "{host}");
        }
        assert_eq!(level(&local, "/", &[]), Err(Refusal::Host));
        let open = access("0.0.0.0:8080");
        let bearer = format!("Bearer {TEXT}");
        for host in ["192.168.1.2:8080", "mill:8080", "MILL.local", "localhost", "[fd00::2]:8080"] {
            let headers = [("host", host), ("authorization", &bearer)];
            assert_eq!(level(&open, "/", &headers), Ok(Level::Owner), "{host}");
        }
        let foreign = [("host", "evil.example:8080"), ("authorization", bearer.as_str())];
        assert_eq!(level(&open, "/", &foreign), Err(Refusal::Host));
    }

    #[test]
    fn requests_of_other_pages_are_refused() {
        let local = access("127.0.0.1:8080");
        let host = ("host", "localhost:8080");
        for origin in ["http://evil.example", "null", "https://localhost:8080", "http://localhost:81", ""] {
            assert_eq!(level(&local, "/ws", &[host, ("origin", origin)]), Err(Refusal::Origin), "{origin}");
        }
        assert_eq!(level(&local, "/ws", &[host, ("origin", "http://localhost:8080")]), Ok(Level::Guest));
        for site in ["cross-site", "same-site"] {
            assert_eq!(level(&local, "/api/status", &[host, (FETCH_SITE, site)]), Err(Refusal::Origin));
            assert_eq!(level(&local, "/", &[host, (FETCH_SITE, site)]), Ok(Level::Guest), "a link");
        }
        assert_eq!(level(&local, "/api/status", &[host, (FETCH_SITE, "same-origin")]), Ok(Level::Guest));
    }

    #[test]
    fn the_token_makes_an_owner_and_is_needed_beyond_loopback() {
        let host = ("host", "192.168.1.2:8080");
        let open = access("0.0.0.0:8080");
        assert_eq!(level(&open, "/", &[host]), Err(Refusal::Token));
        let cookie = |name: &str, value: &str| format!("a=b; {name}={value}");
        let right = cookie("rayfarm_8080", TEXT);
        assert_eq!(level(&open, "/", &[host, ("cookie", &right)]), Ok(Level::Owner));
        let wrong = ["", "00", &TEXT[1..], "abababababababababababababababac"];
        for value in wrong {
            let headers = [host, ("cookie", &cookie("rayfarm_8080", value))];
            assert_eq!(level(&open, "/", &headers), Err(Refusal::Token), "{value}");
        }
        let other_port = cookie("rayfarm_8081", TEXT);
        assert_eq!(level(&open, "/", &[host, ("cookie", &other_port)]), Err(Refusal::Token));
        let local = access("[::1]:8080");
        assert_eq!(level(&local, "/", &[("host", "[::1]:8080"), ("cookie", &right)]), Ok(Level::Owner));
    }

    #[test]
    fn a_token_in_the_address_becomes_a_cookie() {
        let open = access("0.0.0.0:8080");
        let cookie = open.cookie_for(&open.entrance().parse().unwrap()).unwrap();
        for part in [TEXT, "HttpOnly", "SameSite=Strict"] {
            assert!(cookie.contains(part), "{cookie}");
        }
        assert!(!cookie.contains("Secure"));
        for path in ["/", "/?token=", "/?token=00", "/?other=abababababababababababababababab"] {
            assert_eq!(open.cookie_for(&path.parse().unwrap()), None, "{path}");
        }
        let encrypted = Access::new(TOKEN, "0.0.0.0:8080".parse().unwrap(), true, &[]);
        assert!(encrypted.cookie_for(&encrypted.entrance().parse().unwrap()).unwrap().contains("Secure"));
    }

    #[test]
    fn guests_change_at_most_the_view() {
        for command in ["workers", "status", "set samples 4", " help "] {
            assert!(Level::Guest.allows(command), "{command}");
        }
        for command in ["quit", "kick 1", "drain 1", "pause", "resume", "allow 1", ""] {
            assert!(!Level::Guest.allows(command) && Level::Owner.allows(command), "{command}");
        }
    }
}
