//! Encoding of values as bytes. No other file depends on bincode.
//!
//! bincode 2.0.1 is the last functional release and is unmaintained (RUSTSEC-2025-0141), so the crate uses two of its
//! functions only. The bytes are those of `config::legacy()`: little endian, fixed-width integers, `u64` lengths, `u32`
//! variant numbers. Golden-byte tests pin them, so that this file can change to another codec.

use bincode::config::{self, Config};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::limits::MAX_DECODE_BYTES;

/// Error of encoding or decoding a value.
#[derive(Debug, thiserror::Error)]
pub enum CodecError {
    /// The value has no encoding.
    #[error("cannot encode: {0}")]
    Encode(#[from] bincode::error::EncodeError),

    /// The bytes are no value of the expected type.
    #[error("not a valid value: {0}")]
    Decode(#[from] bincode::error::DecodeError),

    /// There are more bytes than allowed. Nothing was decoded.
    #[error("{len} bytes, at most {limit} are allowed")]
    TooLong {
        /// Number of bytes.
        len: usize,
        /// Largest number allowed.
        limit: usize,
    },

    /// Bytes are left after the value.
    #[error("{extra} bytes left over after the value")]
    Trailing {
        /// Number of bytes that were not consumed.
        extra: usize,
    },
}

/// Encodes a value.
///
/// # Errors
/// A value without an encoding: a sequence of unknown length.
pub fn encode<T: Serialize + ?Sized>(value: &T) -> Result<Vec<u8>, CodecError> {
    Ok(bincode::serde::encode_to_vec(value, config::legacy())?)
}

/// Decodes a value from all of `bytes`: at most `limit` bytes, and at most [`MAX_DECODE_BYTES`].
///
/// `T` must not hold sequences of zero-sized elements, because their length is unbounded.
///
/// # Errors
/// Too many bytes; bytes that are no `T`; bytes left after the value.
pub fn decode<T: DeserializeOwned>(bytes: &[u8], limit: usize) -> Result<T, CodecError> {
    let limit = limit.min(MAX_DECODE_BYTES);
    let len = bytes.len();
    if len > limit {
        return Err(CodecError::TooLong { len, limit });
    }
    // bincode trusts a string's length up to its configured limit and allocates before it checks for the bytes. The
    // limit is a constant of the configuration's type, so the smallest of four limits above `len` bounds that allocation.
    match len {
        0..=0xfff => decode_all(bytes, config::legacy().with_limit::<0xfff>()),
        0x1000..=0xffff => decode_all(bytes, config::legacy().with_limit::<0xffff>()),
        0x1_0000..=0xf_ffff => decode_all(bytes, config::legacy().with_limit::<0xf_ffff>()),
        _ => decode_all(bytes, config::legacy().with_limit::<MAX_DECODE_BYTES>()),
    }
}

fn decode_all<T: DeserializeOwned>(bytes: &[u8], config: impl Config) -> Result<T, CodecError> {
    let (value, consumed) = bincode::serde::decode_from_slice(bytes, config)?;
    match bytes.len() - consumed {
        0 => Ok(value),
        extra => Err(CodecError::Trailing { extra }),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde::Deserialize;

    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    enum Shape {
        Unit,
        Pair(u16, i32),
        Named { text: String, list: Vec<u8>, maybe: Option<f32>, flag: bool },
    }

    fn named() -> Shape {
        Shape::Named { text: "hé".into(), list: vec![1, 2], maybe: Some(1.0), flag: true }
    }

    #[test]
    fn golden_bytes() {
        assert_eq!(encode(&Shape::Unit).unwrap(), [0, 0, 0, 0]);
        assert_eq!(encode(&Shape::Pair(0x0102, -2)).unwrap(), [1, 0, 0, 0, 2, 1, 0xfe, 0xff, 0xff, 0xff]);
        let golden: &[u8] = &[
            2, 0, 0, 0, // variant
            3, 0, 0, 0, 0, 0, 0, 0, b'h', 0xc3, 0xa9, // text
            2, 0, 0, 0, 0, 0, 0, 0, 1, 2, // list
            1, 0, 0, 0x80, 0x3f, // Some(1.0)
            1,    // true
        ];
        assert_eq!(encode(&named()).unwrap(), golden);
        assert_eq!(decode::<Shape>(golden, 4096).unwrap(), named());
    }

    #[test]
    fn leftover_bytes_are_an_error() {
        let mut bytes = encode(&named()).unwrap();
        bytes.push(0);
        assert!(matches!(decode::<Shape>(&bytes, 4096), Err(CodecError::Trailing { extra: 1 })));
    }

    #[test]
    fn more_than_the_limit_is_an_error() {
        let bytes = encode(&named()).unwrap();
        assert!(matches!(
            decode::<Shape>(&bytes, 8),
            Err(CodecError::TooLong { len, limit: 8 }) if len == bytes.len()
        ));
    }

    #[test]
    fn a_hostile_length_is_refused_without_allocating() {
        for claimed in [0xfff, 1 << 20, u64::from(u32::MAX), u64::MAX, i64::MAX as u64] {
            let bytes = claimed.to_le_bytes();
            assert!(matches!(decode::<String>(&bytes, 4096), Err(CodecError::Decode(_))), "{claimed}");
            assert!(matches!(decode::<Vec<u64>>(&bytes, 4096), Err(CodecError::Decode(_))), "{claimed}");
        }
    }

    proptest! {
        #[test]
        fn encoding_round_trips(text in ".{0,60}", list in prop::collection::vec(any::<u8>(), 0..5000), flag: bool) {
            let value = Shape::Named { text, list, maybe: None, flag };
            prop_assert_eq!(decode::<Shape>(&encode(&value).unwrap(), 1 << 20).unwrap(), value);
        }

        #[test]
        fn arbitrary_bytes_do_not_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = decode::<Shape>(&bytes, 4096);
            let _ = decode::<Vec<String>>(&bytes, 4096);
        }
    }
}
