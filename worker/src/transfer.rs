//! An asset on its way in: one buffer of the announced size, filled from front to back, hashed as it fills.

use rayfarm_protocol::AssetId;

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

/// A buffer that fills.
pub(crate) struct Transfer {
    id: AssetId,
    size: usize,
    bytes: Vec<u8>,
    /// Boxed: it is two kilobytes.
    hasher: Box<blake3::Hasher>,
}

impl Transfer {
    /// Reserves the announced size, which the caller has found to be within the cache's bound.
    pub(crate) fn begin(id: AssetId, size: u64) -> Result<Self, TransferError> {
        let no_memory = TransferError::NoMemory(size);
        let Ok(size) = usize::try_from(size) else { return Err(no_memory) };
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(size).map_err(|_| no_memory)?;
        Ok(Self { id, size, bytes, hasher: Box::new(blake3::Hasher::new()) })
    }

    /// Takes the next part.
    pub(crate) fn chunk(&mut self, offset: u64, part: &[u8]) -> Result<(), TransferError> {
        let (id, expected) = (self.id, self.bytes.len() as u64);
        if offset != expected {
            return Err(TransferError::Order { id, offset, expected });
        }
        if part.len() > self.size - self.bytes.len() {
            return Err(TransferError::TooMany { id, size: self.size as u64 });
        }
        self.bytes.extend_from_slice(part);
        self.hasher.update(part);
        Ok(())
    }

    /// Whether all announced bytes are there.
    pub(crate) fn is_complete(&self) -> bool {
        self.bytes.len() == self.size
    }

    /// The bytes, if they are those that were asked for.
    pub(crate) fn finish(self) -> Result<Vec<u8>, TransferError> {
        let found = AssetId(self.hasher.finalize().into());
        if found == self.id { Ok(self.bytes) } else { Err(TransferError::Damaged { id: self.id, found }) }
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
        let bytes = transfer.finish().unwrap();
        assert_eq!((bytes.as_slice(), bytes.capacity()), (BYTES, BYTES.len()));
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
