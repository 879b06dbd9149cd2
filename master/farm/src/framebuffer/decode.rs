//! From the bytes of a lease, however they are written, to its rows: RGB8.

use rayfarm_protocol::pixels::{BlockError, narrow_bytes, unpack, widen};
use rayfarm_protocol::{Encoding, Lease};

/// Pixels that do not fit their lease.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Misfit {
    #[error("{lease} takes {expected} bytes of pixels, {got} arrived")]
    Bytes { lease: Lease, expected: usize, got: usize },
    #[error("{lease}: {source}")]
    Blocks { lease: Lease, source: BlockError },
    #[error("{lease} lies outside of the picture of {rows} rows")]
    Rows { lease: Lease, rows: usize },
}

/// Decodes; keeps its room from lease to lease.
#[derive(Debug, Default)]
pub(super) struct Decoder {
    /// Pixels that are unpacked and not widened yet.
    narrow: Vec<u8>,
}

impl Decoder {
    /// The pixels of a lease into `target`, its rows: all of them, or none that count. Needs no more room than they take.
    pub(super) fn decode(
        &mut self,
        lease: Lease,
        encoding: Encoding,
        bytes: &[u8],
        target: &mut [u8],
    ) -> Result<(), Misfit> {
        let misfit = |expected| Misfit::Bytes { lease, expected, got: bytes.len() };
        let torn = |source| Misfit::Blocks { lease, source };
        let narrow = narrow_bytes(target.len());
        match encoding {
            Encoding::Raw if target.len() == bytes.len() => target.copy_from_slice(bytes),
            Encoding::Raw => return Err(misfit(target.len())),
            Encoding::Lz4 => unpack(bytes, target).map_err(torn)?,
            Encoding::Narrow if widen(bytes, target) => {}
            Encoding::Narrow => return Err(misfit(narrow)),
            Encoding::NarrowLz4 => {
                self.narrow.resize(narrow, 0);
                unpack(bytes, &mut self.narrow).map_err(torn)?;
                if !widen(&self.narrow, target) {
                    return Err(misfit(narrow));
                }
            }
        }
        Ok(())
    }
}
