//! An asset on its way in: one buffer of the announced size, filled from front to back, hashed as it fills.

use std::sync::Arc;

use bytes::Bytes;
use rayfarm_protocol::AssetId;

use crate::growing::Growing;

/// What is wrong with an incoming asset.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum TransferError {
    #[error("this machine has no memory for an asset of {0} bytes")]
    NoMemory(u64),
    #[error("asset {id}: bytes at {offset} came where those at {expected} were due")]
    Order { id: AssetId, offset: u64, expected: u64 },
    #[error("asset {id} is announced with {size} bytes, and more came")]
    TooMany { id: AssetId, size: u64 },
    #[error("asset {id} arrived damaged: its bytes have the hash {found}")]
    Damaged { id: AssetId, found: AssetId },
}

/// A buffer that fills. Dropped before it is whole, it is abandoned: nobody reads of it any more.
pub(crate) struct Transfer {
    id: AssetId,
    bytes: Arc<Growing>,
    /// Boxed: it is two kilobytes.
    hasher: Box<blake3::Hasher>,
}

impl Transfer {
    /// Reserves the announced size, which the caller has found to be within the cache's bound.
    pub(crate) fn begin(id: AssetId, size: u64) -> Result<Self, TransferError> {
        let bytes = usize::try_from(size).ok().and_then(Growing::new);
        let bytes = bytes.ok_or(TransferError::NoMemory(size))?;
        Ok(Self { id, bytes, hasher: Box::new(blake3::Hasher::new()) })
    }

    /// What is there of it, for others to read.
    pub(crate) fn bytes(&self) -> &Arc<Growing> {
        &self.bytes
    }

    /// Takes the next part.
    pub(crate) fn chunk(&mut self, offset: u64, part: &[u8]) -> Result<(), TransferError> {
        let (id, size, len) = (self.id, self.bytes.size(), self.bytes.len());
        if offset != len as u64 {
            return Err(TransferError::Order { id, offset, expected: len as u64 });
        }
        if part.len() > size - len {
            return Err(TransferError::TooMany { id, size: size as u64 });
        }
        self.hasher.update(part);
        self.bytes.push(part);
        Ok(())
    }

    /// Whether all announced bytes are there.
    pub(crate) fn is_complete(&self) -> bool {
        self.bytes.len() == self.bytes.size()
    }

    /// The bytes, if they are those that were asked for.
    pub(crate) fn finish(self) -> Result<Bytes, TransferError> {
        let found = AssetId(self.hasher.finalize().into());
        let whole = if found == self.id { self.bytes.finish() } else { None };
        whole.ok_or(TransferError::Damaged { id: self.id, found })
    }
}

impl Drop for Transfer {
    fn drop(&mut self) {
        self.bytes.abandon();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BYTES: &[u8] = b"forty-two bytes that make a small asset...";

    #[test]
    fn parts_become_the_whole() {
        let mut transfer = Transfer::begin(AssetId::of(BYTES), BYTES.len() as u64).unwrap();
        for (index, part) in BYTES.chunks(5).enumerate() {
            assert!(!transfer.is_complete());
            transfer.chunk(index as u64 * 5, part).unwrap();
        }
        assert!(transfer.is_complete());
        assert_eq!(transfer.finish().unwrap(), BYTES);
    }

    #[test]
    fn gaps_surplus_and_damage_are_named() {
        let id = AssetId::of(BYTES);
        let mut transfer = Transfer::begin(id, 4).unwrap();
        assert_eq!(transfer.chunk(1, b"x"), Err(TransferError::Order { id, offset: 1, expected: 0 }));
        assert_eq!(transfer.chunk(0, b"12345"), Err(TransferError::TooMany { id, size: 4 }));
        transfer.chunk(0, b"1234").unwrap();
        let found = AssetId::of(b"1234");
        assert_eq!(transfer.finish().err(), Some(TransferError::Damaged { id, found }));
    }

    #[test]
    fn more_than_any_memory_is_an_error() {
        assert!(matches!(Transfer::begin(AssetId::of(b""), u64::MAX), Err(TransferError::NoMemory(_))));
    }
}
