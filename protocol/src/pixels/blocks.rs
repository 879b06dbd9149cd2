//! [`Encoding::Lz4`](super::Encoding::Lz4): blocks of LZ4, one for each band of rows. Each render thread compresses the
//! band that it has traced while the pixels are in its cache, and no thread compresses a whole segment.
//!
//! ```text
//! 0          4           8
//! | raw size | wire size | LZ4 block, or the raw bytes where the sizes are equal | next block ...
//! ```
//!
//! Differences to the left neighbour in front of LZ4 were tried and rejected: they made five test scenes and three
//! reference pictures larger by 2 to 21 %. Differences to the row above made one of the three pictures smaller by 14 %
//! and the others larger by 9 and 29 %. Rendered pictures have flat backgrounds, repeated rows and facets, which LZ4
//! matches better without a filter. `benches/pixels.rs` measures both on any picture.

use bytes::{Buf, BufMut};
use lz4_flex::block::{CompressTable, compress_into_with_table, decompress_into, get_maximum_output_size};

const BLOCK_HEAD_BYTES: usize = 8;

/// A compressor of blocks. Keeps its tables and its buffer from block to block.
pub struct Packer {
    table: CompressTable,
    room: Vec<u8>,
}

/// Why bytes are not the blocks of the expected rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BlockError {
    /// The bytes end within a block.
    #[error("they end in the middle of a block")]
    Torn,
    /// A block announces no raw bytes, or more than are still expected.
    #[error("a block announces {announced} bytes of pixels, expected 1 to {room}")]
    Size {
        /// Raw bytes that the block announces.
        announced: usize,
        /// Raw bytes that are still expected.
        room: usize,
    },
    /// A block is not LZ4, or decompresses to another number of bytes than announced.
    #[error("a block does not decompress to the {announced} bytes of pixels that it announces")]
    Corrupt {
        /// Raw bytes that the block announces.
        announced: usize,
    },
    /// A block does not hold whole pixels, although its planes are made of such.
    #[error("a block of planes announces {announced} bytes, which are no whole pixels")]
    Pixels {
        /// Raw bytes that the block announces.
        announced: usize,
    },
    /// The blocks hold fewer bytes than the rows.
    #[error("{missing} bytes of pixels are missing after the last block")]
    Missing {
        /// Raw bytes that no block holds.
        missing: usize,
    },
}

impl Packer {
    /// A compressor with empty buffers.
    pub fn new() -> Self {
        Self { table: CompressTable::default(), room: Vec::new() }
    }

    /// Compresses raw bytes to one block, in an allocation of exactly its size. The block is at most eight bytes (its
    /// head) longer than `raw`. Returns `None` for an empty `raw`, or one longer than a block can hold (4 GiB - 1).
    pub fn block(&mut self, raw: &[u8]) -> Option<Vec<u8>> {
        let raw_size = u32::try_from(raw.len()).ok().filter(|size| *size > 0)?;
        self.room.resize(get_maximum_output_size(raw.len()), 0);
        let packed = compress_into_with_table(raw, &mut self.room, &mut self.table).ok();
        let packed = packed.and_then(|len| self.room.get(..len)).filter(|packed| packed.len() < raw.len());
        let body = packed.unwrap_or(raw);
        let mut block = Vec::with_capacity(BLOCK_HEAD_BYTES + body.len());
        block.put_u32_le(raw_size);
        block.put_u32_le(u32::try_from(body.len()).ok()?);
        block.put_slice(body);
        Some(block)
    }
}

impl Default for Packer {
    fn default() -> Self {
        Self::new()
    }
}

impl std::fmt::Debug for Packer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Packer").field("room_bytes", &self.room.len()).finish_non_exhaustive()
    }
}

/// Decompresses blocks into `raw`, which they must fill exactly. Allocates nothing.
///
/// # Errors
/// Bytes that are no blocks, or blocks of another total size. The content of `raw` is unspecified then.
pub fn unpack(packed: &[u8], raw: &mut [u8]) -> Result<(), BlockError> {
    each_block(packed, raw, |block, target| block.unpack(target))
}

/// The body of a block.
pub(super) struct BlockBody<'a>(&'a [u8]);

impl BlockBody<'_> {
    /// Decompresses the block to as many bytes as it announces.
    pub(super) fn unpack(&self, target: &mut [u8]) -> Result<(), BlockError> {
        let (Self(body), announced) = (self, target.len());
        if body.len() == announced {
            target.copy_from_slice(body);
        } else if decompress_into(body, target).ok() != Some(announced) {
            return Err(BlockError::Corrupt { announced });
        }
        Ok(())
    }
}

/// Calls `unpack_one` for each block with its part of `raw`. The blocks must fill `raw` exactly.
pub(super) fn each_block(
    mut packed: &[u8],
    mut raw: &mut [u8],
    mut unpack_one: impl FnMut(BlockBody<'_>, &mut [u8]) -> Result<(), BlockError>,
) -> Result<(), BlockError> {
    while !packed.is_empty() {
        let (announced, body) = split_block(&mut packed)?;
        let room = raw.len();
        let (target, rest) = std::mem::take(&mut raw)
            .split_at_mut_checked(announced)
            .filter(|_| announced > 0)
            .ok_or(BlockError::Size { announced, room })?;
        raw = rest;
        unpack_one(BlockBody(body), target)?;
    }
    match raw.len() {
        0 => Ok(()),
        missing => Err(BlockError::Missing { missing }),
    }
}

/// Splits the first block off and returns its raw size and its body.
fn split_block<'a>(packed: &mut &'a [u8]) -> Result<(usize, &'a [u8]), BlockError> {
    if packed.len() < BLOCK_HEAD_BYTES {
        return Err(BlockError::Torn);
    }
    let raw_size = packed.get_u32_le() as usize;
    let wire_size = packed.get_u32_le() as usize;
    let (body, rest) = packed.split_at_checked(wire_size).ok_or(BlockError::Torn)?;
    *packed = rest;
    Ok((raw_size, body))
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;
    use proptest::sample::Index;

    use super::*;

    /// Bytes with flat runs, noise and repeated pixels, as in pictures.
    fn pictures() -> impl Strategy<Value = Vec<u8>> {
        let run = prop_oneof![
            (any::<u8>(), 1..400usize).prop_map(|(value, len)| vec![value; len]),
            vec(any::<u8>(), 1..60),
            (vec(any::<u8>(), 3), 1..80usize).prop_map(|(pixel, count)| pixel.repeat(count)),
        ];
        vec(run, 1..12).prop_map(|runs| runs.concat())
    }

    fn packed(raw: &[u8], block_bytes: usize) -> Vec<u8> {
        let mut packer = Packer::new();
        raw.chunks(block_bytes).flat_map(|part| packer.block(part).unwrap()).collect()
    }

    #[test]
    fn golden_bytes() {
        // As LZ4: one literal, a match of 17 bytes at distance 1, six literals.
        let golden = [24, 0, 0, 0, 11, 0, 0, 0, 0x1d, 7, 1, 0, 0x60, 7, 7, 7, 7, 7, 7];
        let mut rows = [0; 24];
        assert_eq!(unpack(&golden, &mut rows), Ok(()));
        assert_eq!(rows, [7; 24]);
        // Another LZ4 encoder may choose other matches. The head is fixed.
        let block = packed(&rows, 24);
        assert_eq!(block[..8], [24, 0, 0, 0, block.len() as u8 - 8, 0, 0, 0]);
        // Bytes that LZ4 does not make fewer are stored.
        assert_eq!(packed(&[1, 2, 3], 3), [3, 0, 0, 0, 3, 0, 0, 0, 1, 2, 3]);
    }

    #[test]
    fn no_bytes_make_no_block() {
        assert_eq!(Packer::new().block(&[]), None);
        assert_eq!(unpack(&[], &mut []), Ok(()));
    }

    #[test]
    fn each_defect_has_its_error() {
        let whole = packed(&[5; 100], 50);
        let unpack = |bytes: &[u8], len: usize| unpack(bytes, &mut vec![0; len]);
        assert_eq!(unpack(&whole, 100), Ok(()));
        assert_eq!(unpack(&whole, 120), Err(BlockError::Missing { missing: 20 }));
        assert_eq!(unpack(&whole, 80), Err(BlockError::Size { announced: 50, room: 30 }));
        assert_eq!(unpack(&whole[..whole.len() - 1], 100), Err(BlockError::Torn));
        assert_eq!(unpack(&[0; 8], 100), Err(BlockError::Size { announced: 0, room: 100 }));
        assert_eq!(unpack(&[4, 0, 0, 0, 1, 0, 0, 0, 0], 4), Err(BlockError::Corrupt { announced: 4 }));
        // A huge size is compared with the expected bytes before anything is allocated or decompressed.
        let huge = [0xff, 0xff, 0xff, 0xff, 1, 0, 0, 0, 0];
        assert_eq!(unpack(&huge, 9), Err(BlockError::Size { announced: u32::MAX as usize, room: 9 }));
    }

    proptest! {
        #[test]
        fn packing_round_trips(raw in pictures(), block_bytes in 1..2000usize) {
            let packed = packed(&raw, block_bytes);
            let blocks = raw.len().div_ceil(block_bytes);
            prop_assert!(packed.len() <= raw.len() + BLOCK_HEAD_BYTES * blocks);
            let mut back = vec![0xee; raw.len()];
            prop_assert_eq!(unpack(&packed, &mut back), Ok(()));
            prop_assert_eq!(back, raw);
        }

        #[test]
        fn arbitrary_bytes_do_not_panic(bytes in vec(any::<u8>(), 0..300), len in 0..400usize) {
            let _ = unpack(&bytes, &mut vec![0; len]);
        }

        #[test]
        fn mutated_blocks_do_not_panic(
            raw in pictures(),
            block_bytes in 20..2000usize,
            hits in vec((any::<Index>(), any::<u8>()), 1..6),
            cut in any::<Option<Index>>(),
        ) {
            let mut packed = packed(&raw, block_bytes);
            for (at, value) in hits {
                let at = at.index(packed.len());
                packed[at] = value;
            }
            if let Some(cut) = cut {
                packed.truncate(cut.index(packed.len() + 1));
            }
            let _ = unpack(&packed, &mut vec![0; raw.len()]);
        }
    }
}
