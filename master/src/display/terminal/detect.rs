//! Abilities of the terminal, from its replies to one round of queries.
//!
//! The last query is one that every terminal answers (primary device attributes), so that its reply ends the wait.

use std::time::Duration;

use super::cells::CellKind;
use super::graphics::Protocol;

/// A picture of one pixel by kitty's protocol, to be checked and not shown; the name and version; the size in pixels of the text
/// area and of a cell; the primary device attributes.
const QUERIES: &[u8] = b"\x1b_Gi=31,s=1,v=1,a=q,t=d,f=24;AAAA\x1b\\\x1b[>0q\x1b[14t\x1b[16t\x1b[c";
/// Longest wait for the replies.
const WAIT: Duration = Duration::from_millis(200);
/// Most bytes of replies that are read.
const MAX_REPLY_BYTES: usize = 4096;
/// Largest side of a cell that is believed, in pixels.
const MAX_CELL_SIDE: u32 = 256;

/// Way to show a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    /// As characters.
    Cells(CellKind),
    /// As a picture.
    Graphics(Protocol),
}

/// What the terminal can do, as far as it has replied.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Abilities {
    /// Name and version.
    name: String,
    kitty: bool,
    sixel: bool,
    /// Size of a cell in pixels.
    pub(super) cell: Option<(u32, u32)>,
}

impl Abilities {
    /// Queries the terminal, which must be in raw mode. Without a reply in time nothing is assumed.
    pub(super) fn query() -> Self {
        Self::of_replies(&exchange())
    }

    /// The abilities that replies report. Unknown replies are skipped.
    fn of_replies(replies: &[u8]) -> Self {
        let mut abilities = Self::default();
        let text = String::from_utf8_lossy(replies);
        for reply in text.split('\x1b').filter(|reply| !reply.is_empty()) {
            if let Some(body) = reply.strip_prefix("_G") {
                abilities.kitty |= body.contains(";OK");
            } else if let Some(name) = reply.strip_prefix("P>|") {
                abilities.name = rayfarm_text::printable_within(name, 64).into_owned();
            } else if let Some(body) = reply.strip_prefix("[6;").and_then(|body| body.strip_suffix('t')) {
                let size = body.split_once(';').and_then(|(height, width)| {
                    let side =
                        |text: &str| text.parse().ok().filter(|side| (1..=MAX_CELL_SIDE).contains(side));
                    Some((side(width)?, side(height)?))
                });
                abilities.cell = size.or(abilities.cell);
            } else if let Some(body) = reply.strip_prefix("[?").and_then(|body| body.strip_suffix('c')) {
                abilities.sixel |= body.split(';').any(|attribute| attribute == "4");
            }
        }
        abilities
    }

    /// The best way to show pictures.
    pub(super) fn best(&self) -> Mode {
        let name = self.name.to_ascii_lowercase();
        let is = |names: &[&str]| names.iter().any(|known| name.starts_with(known));
        if self.kitty {
            Mode::Graphics(Protocol::Kitty)
        } else if is(&["iterm2", "wezterm"]) {
            Mode::Graphics(Protocol::Iterm)
        } else if self.sixel && self.cell.is_some() {
            Mode::Graphics(Protocol::Sixel)
        } else if is(&["ghostty", "foot", "kitty"]) {
            Mode::Cells(CellKind::Octant)
        } else if is(&["vte", "konsole", "contour"]) {
            Mode::Cells(CellKind::Sextant)
        } else {
            Mode::Cells(CellKind::Half)
        }
    }
}

/// Sends the queries and reads the replies until the last one or the end of the wait.
#[cfg(unix)]
fn exchange() -> Vec<u8> {
    use std::io::Write;
    use std::time::Instant;

    use rustix::event::{PollFd, PollFlags, Timespec, poll};

    let mut replies = Vec::new();
    let mut out = std::io::stdout().lock();
    if out.write_all(QUERIES).and_then(|()| out.flush()).is_err() {
        return replies;
    }
    let input = std::io::stdin();
    let end = Instant::now() + WAIT;
    while replies.len() < MAX_REPLY_BYTES && !is_complete(&replies) {
        let left = Timespec::try_from(end.saturating_duration_since(Instant::now())).unwrap_or_default();
        let mut ready = [PollFd::new(&input, PollFlags::IN)];
        // Read without the buffer of std's standard input: what follows the replies belongs to the reader of keys.
        let mut byte = [0];
        match poll(&mut ready, Some(&left)) {
            Ok(1..) => match rustix::io::read(&input, &mut byte) {
                Ok(1) => replies.push(byte[0]),
                _ => break,
            },
            _ => break,
        }
    }
    replies
}

#[cfg(not(unix))]
fn exchange() -> Vec<u8> {
    let _ = (QUERIES, WAIT, MAX_REPLY_BYTES);
    Vec::new()
}

/// Whether the reply to the last query is complete.
#[cfg_attr(not(unix), allow(dead_code, reason = "replies are read on Unix only"))]
fn is_complete(replies: &[u8]) -> bool {
    let text = String::from_utf8_lossy(replies);
    text.rsplit_once("\x1b[?").is_some_and(|(_, last)| last.ends_with('c'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replies_of_terminals_select_the_best_way() {
        let cases: [(&str, Mode); 6] = [
            (
                "\x1b_Gi=31;OK\x1b\\\x1bP>|kitty(0.42.1)\x1b\\\x1b[6;20;10t\x1b[?62;c",
                Mode::Graphics(Protocol::Kitty),
            ),
            ("\x1bP>|iTerm2 3.5.0\x1b\\\x1b[?62;4c", Mode::Graphics(Protocol::Iterm)),
            ("\x1bP>|XTerm(390)\x1b\\\x1b[6;18;9t\x1b[?64;1;4;22c", Mode::Graphics(Protocol::Sixel)),
            ("\x1bP>|foot(1.21.0)\x1b\\\x1b[?62;22c", Mode::Cells(CellKind::Octant)),
            ("\x1bP>|VTE(7600)\x1b\\\x1b[?65;1;9c", Mode::Cells(CellKind::Sextant)),
            ("\x1b[?1;2c", Mode::Cells(CellKind::Half)),
        ];
        for (replies, mode) in cases {
            assert_eq!(Abilities::of_replies(replies.as_bytes()).best(), mode, "{replies:?}");
        }
        assert_eq!(Abilities::of_replies(b"").best(), Mode::Cells(CellKind::Half));
        let cell = Abilities::of_replies(b"\x1b[6;18;9t").cell;
        assert_eq!(cell, Some((9, 18)));
        assert_eq!(Abilities::of_replies(b"\x1b[6;0;9t\x1b[6;99999;9t\x1b[6;x;9t").cell, None);
    }

    #[test]
    fn the_last_reply_ends_the_wait() {
        assert!(!is_complete(b"\x1bP>|XTerm(390)\x1b\\"));
        assert!(!is_complete(b"\x1b[?64;1"));
        assert!(is_complete(b"\x1b[6;18;9t\x1b[?64;1;4c"));
    }
}
