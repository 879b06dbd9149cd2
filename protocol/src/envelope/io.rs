//! Reading and writing of envelopes on an asynchronous byte stream, each with a deadline.

use bytes::{Buf, BufMut, Bytes, BytesMut};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::time::timeout;

use super::{Envelope, HEADER_BYTES, Header};
use crate::ProtocolError;
use crate::limits::envelope_deadline;

impl Envelope {
    /// Writes the whole envelope, in one system call where the transport takes several slices. Copies no body and does
    /// not flush.
    ///
    /// # Errors
    /// A failed transport; a peer that does not receive the envelope within [`envelope_deadline`].
    pub async fn write(&self, io: &mut (impl AsyncWrite + Unpin)) -> Result<(), ProtocolError> {
        let (lead, body) = self.parts();
        let mut all = Buf::chain(lead, body.clone());
        within_deadline("receiving a message", self.wire_bytes(), async {
            io.write_all_buf(&mut all).await.map_err(|source| ProtocolError::Io { doing: "sending", source })
        })
        .await
    }
}

/// Waits without a time limit for the next header and reads it. Returns `None` when the peer has closed the connection
/// between two envelopes.
///
/// # Errors
/// A failed transport; a header that is incomplete at the deadline; the errors of [`Header::parse`].
pub async fn read_header(io: &mut (impl AsyncRead + Unpin)) -> Result<Option<Header>, ProtocolError> {
    let mut bytes = [0; HEADER_BYTES];
    let begun = io.read(&mut bytes).await.map_err(receiving)?;
    if begun == 0 {
        return Ok(None);
    }
    let rest = bytes.get_mut(begun..).unwrap_or_default();
    within_deadline("sending a header", 0, async {
        io.read_exact(rest).await.map_err(receiving).map(|_| ())
    })
    .await?;
    Header::parse(bytes).map(Some)
}

/// Reads the body that a header announces, into one allocation of that size.
///
/// # Errors
/// A failed transport; a body that is incomplete at the deadline.
pub async fn read_body(io: &mut (impl AsyncRead + Unpin), header: Header) -> Result<Bytes, ProtocolError> {
    read_body_counted(io, header, |_| {}).await
}

/// As [`read_body`]. `count` receives the number of bytes of each part as it arrives.
pub(crate) async fn read_body_counted(
    io: &mut (impl AsyncRead + Unpin),
    header: Header,
    count: impl Fn(usize),
) -> Result<Bytes, ProtocolError> {
    let mut body = BytesMut::with_capacity(header.body_bytes);
    within_deadline("sending a message", header.body_bytes, async {
        while body.len() < header.body_bytes {
            let missing = header.body_bytes - body.len();
            match io.read_buf(&mut (&mut body).limit(missing)).await.map_err(receiving)? {
                0 => return Err(ProtocolError::Closed { at: "in the middle of a message" }),
                bytes => count(bytes),
            }
        }
        Ok(())
    })
    .await?;
    Ok(body.freeze())
}

async fn within_deadline(
    what: &'static str,
    bytes: usize,
    work: impl Future<Output = Result<(), ProtocolError>>,
) -> Result<(), ProtocolError> {
    let limit = envelope_deadline(bytes);
    timeout(limit, work).await.unwrap_or(Err(ProtocolError::Deadline { what, limit }))
}

fn receiving(source: std::io::Error) -> ProtocolError {
    match source.kind() {
        std::io::ErrorKind::UnexpectedEof => ProtocolError::Closed { at: "in the middle of a header" },
        _ => ProtocolError::Io { doing: "receiving", source },
    }
}
