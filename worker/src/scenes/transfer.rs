//! An incoming asset: a buffer of the announced size, filled from front to back and hashed as it fills.

use std::sync::Arc;

use bytes::Bytes;
use rayfarm_protocol::AssetId;

use crate::peer::PartialAsset;

/// Error of an incoming asset.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum TransferError {
    #[error("there is not enough memory for an asset of {0} bytes")]
    NoMemory(u64),
    #[error("asset {id}: a chunk at byte {offset} arrived, expected byte {expected}")]
    Order { id: AssetId, offset: u64, expected: u64 },
    #[error("asset {id} is announced with {size} bytes, and more arrived")]
    TooMany { id: AssetId, size: u64 },
    #[error("asset {id} arrived damaged: its bytes have the hash {found}")]
    Damaged { id: AssetId, found: AssetId },
}

/// A transfer in progress. A transfer that is dropped before its end abandons its bytes.
pub(super) struct Transfer {
    id: AssetId,
    asset: Arc<PartialAsset>,
    /// Boxed, because it has about two kilobytes.
    hasher: Box<blake3::Hasher>,
}

impl Transfer {
    /// Allocates the announced size, which the caller has checked against the cache's bound.
    pub(super) fn begin(id: AssetId, size: u64) -> Result<Self, TransferError> {
        let asset = usize::try_from(size).ok().and_then(PartialAsset::new);
        let asset = asset.ok_or(TransferError::NoMemory(size))?;
        Ok(Self { id, asset, hasher: Box::new(blake3::Hasher::new()) })
    }

    /// The bytes that have arrived, for other workers to read.
    pub(super) fn asset(&self) -> &Arc<PartialAsset> {
        &self.asset
    }

    /// Appends the next chunk.
    pub(super) fn append(&mut self, offset: u64, chunk: &[u8]) -> Result<(), TransferError> {
        let (id, size, len) = (self.id, self.asset.size(), self.asset.len());
        if offset != len as u64 {
            return Err(TransferError::Order { id, offset, expected: len as u64 });
        }
        if chunk.len() > size - len {
            return Err(TransferError::TooMany { id, size: size as u64 });
        }
        self.hasher.update(chunk);
        self.asset.append(chunk);
        Ok(())
    }

    /// Whether all announced bytes have arrived.
    pub(super) fn is_complete(&self) -> bool {
        self.asset.len() == self.asset.size()
    }

    /// Checks the hash and returns the bytes.
    pub(super) fn finish(self) -> Result<Bytes, TransferError> {
        let found = AssetId(self.hasher.finalize().into());
        let bytes = if found == self.id { self.asset.finish() } else { None };
        bytes.ok_or(TransferError::Damaged { id: self.id, found })
    }
}

impl Drop for Transfer {
    fn drop(&mut self) {
        self.asset.abandon();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BYTES: &[u8] = b"forty-two bytes that make a small asset...";

    #[test]
    fn chunks_in_order_become_the_asset() {
        let mut transfer = Transfer::begin(AssetId::of(BYTES), BYTES.len() as u64).unwrap();
        for (index, chunk) in BYTES.chunks(5).enumerate() {
            assert!(!transfer.is_complete());
            transfer.append(index as u64 * 5, chunk).unwrap();
        }
        assert!(transfer.is_complete());
        assert_eq!(transfer.finish().unwrap(), BYTES);
    }

    #[test]
    fn gaps_surplus_and_damage_are_errors() {
        let id = AssetId::of(BYTES);
        let mut transfer = Transfer::begin(id, 4).unwrap();
        assert_eq!(transfer.append(1, b"x"), Err(TransferError::Order { id, offset: 1, expected: 0 }));
        assert_eq!(transfer.append(0, b"12345"), Err(TransferError::TooMany { id, size: 4 }));
        transfer.append(0, b"1234").unwrap();
        let found = AssetId::of(b"1234");
        assert_eq!(transfer.finish().err(), Some(TransferError::Damaged { id, found }));
    }

    #[test]
    fn a_size_beyond_the_memory_is_an_error() {
        assert!(matches!(Transfer::begin(AssetId::of(b""), u64::MAX), Err(TransferError::NoMemory(_))));
    }
}
