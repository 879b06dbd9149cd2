//! The first twelve bytes from either end: magic, version (little endian), role, transport (0 plain, 1 TLS). Their layout never changes, so that any
//! two releases can report their mismatch.
//!
//! ```text
//! 0           8         10     11
//! | RAYFARM\n | version | role | transport |
//! ```

use rayfarm_text::printable;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::time::timeout;

use crate::limits::FIRST_BYTE_DEADLINE;
use crate::{PROTOCOL_VERSION, ProtocolError, Role};

pub(crate) const PREAMBLE_BYTES: usize = 12;
const MAGIC: [u8; 8] = *b"RAYFARM\n";

/// Version and role of one end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Preamble {
    pub(crate) version: u16,
    pub(crate) role: Role,
    /// 0 for a plain connection, 1 for TLS. Other versions may have more.
    pub(crate) transport: u8,
}

impl Preamble {
    pub(crate) fn ours(role: Role, encrypted: bool) -> Self {
        Self { version: PROTOCOL_VERSION, role, transport: encrypted.into() }
    }

    pub(crate) fn to_bytes(self) -> [u8; PREAMBLE_BYTES] {
        let [m0, m1, m2, m3, m4, m5, m6, m7] = MAGIC;
        let [v0, v1] = self.version.to_le_bytes();
        [m0, m1, m2, m3, m4, m5, m6, m7, v0, v1, role_byte(self.role), self.transport]
    }
}

fn role_byte(role: Role) -> u8 {
    match role {
        Role::Master => 1,
        Role::Worker => 2,
    }
}

/// Sends this end's preamble and reads the peer's concurrently: a pipe may hold less than one preamble.
pub(crate) async fn exchange<S>(io: &mut S, ours: Preamble) -> Result<Preamble, ProtocolError>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    let (mut reader, mut writer) = tokio::io::split(io);
    let sending = async {
        writer.write_all(&ours.to_bytes()).await?;
        writer.flush().await
    };
    // The peer's bytes explain more than a failed write does, so the read is finished first.
    let (sent, theirs) = tokio::try_join!(async { Ok(sending.await) }, read(&mut reader, ours.role.peer()))?;
    sent.map_err(|source| ProtocolError::Io { doing: "sending the preamble", source })?;
    Ok(theirs)
}

/// Reads the peer's preamble, and fails at the first byte that differs from the magic: another program may never send
/// twelve bytes.
async fn read(io: &mut (impl AsyncRead + Unpin), expected: Role) -> Result<Preamble, ProtocolError> {
    let mut bytes = [0; PREAMBLE_BYTES];
    let mut filled = 0;
    while filled < PREAMBLE_BYTES {
        let room = bytes.get_mut(filled..).unwrap_or_default();
        let read = io.read(room);
        let read = if filled == 0 && expected == Role::Worker {
            let late = ProtocolError::Deadline { what: "sending its first byte", limit: FIRST_BYTE_DEADLINE };
            timeout(FIRST_BYTE_DEADLINE, read).await.map_err(|_| late)?
        } else {
            read.await
        };
        match read.map_err(|source| ProtocolError::Io { doing: "waiting for the preamble", source })? {
            0 if filled == 0 => return Err(ProtocolError::Closed { at: "before it sent anything" }),
            0 => return Err(ProtocolError::Closed { at: "in the middle of the preamble" }),
            more => filled += more,
        }
        let so_far = bytes.get(..filled).unwrap_or_default();
        if !so_far.iter().zip(MAGIC).all(|(byte, magic)| *byte == magic) {
            return Err(ProtocolError::NotRayfarm { expected, what: describe(so_far) });
        }
    }
    let [_, _, _, _, _, _, _, _, v0, v1, role, transport] = bytes;
    let role = match role {
        1 => Role::Master,
        2 => Role::Worker,
        other => {
            let what = format!("its preamble names the unknown role {other}");
            return Err(ProtocolError::NotRayfarm { expected, what });
        }
    };
    Ok(Preamble { version: u16::from_le_bytes([v0, v1]), role, transport })
}

/// Describes the first bytes of another program, and names its protocol where it is a common one.
fn describe(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    let text = printable(&text);
    let starts = |words: &[&str]| words.iter().any(|word| bytes.starts_with(word.as_bytes()));
    let looks = if starts(&["HTTP/", "GET ", "POST ", "HEAD ", "PUT ", "OPTIONS ", "CONNECT ", "PRI * "]) {
        ", which is HTTP"
    } else if starts(&["SSH-"]) {
        ", which is SSH"
    } else if matches!(bytes, [0x16, 0x03, ..]) {
        ", which is TLS"
    } else {
        ""
    };
    format!("it began with \"{text}\"{looks}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_bytes() {
        let master = Preamble { version: 0x0102, role: Role::Master, transport: 0 };
        assert_eq!(master.to_bytes(), *b"RAYFARM\n\x02\x01\x01\0");
        let worker = Preamble { version: 1, role: Role::Worker, transport: 1 };
        assert_eq!(worker.to_bytes(), *b"RAYFARM\n\x01\0\x02\x01");
    }

    #[tokio::test]
    async fn other_protocols_are_named() {
        for (bytes, name) in [
            (b"HTTP/1.1 400 Bad".as_slice(), "HTTP"),
            (b"GET / HTTP/1.1\r\n", "HTTP"),
            (b"SSH-2.0-OpenSSH_9", "SSH"),
            (b"\x16\x03\x01\x02\0\x01\0", "TLS"),
            (b"\0\x01\x02", "began with"),
            (b"RAYFARM", "closed"),
            (b"", "before it sent anything"),
            (b"RAYFARM\n\x01\0\x07\0", "unknown role 7"),
        ] {
            let message = read(&mut &*bytes, Role::Master).await.unwrap_err().to_string();
            assert!(message.contains(name), "{message}");
        }
    }
}
