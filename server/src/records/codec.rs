//! Stored values: one version byte, a checksum, then the value in postcard's wire format.
//!
//! ```text
//! [version u8][crc32 of version and payload, little endian u32][postcard payload]
//! ```
//!
//! The checksum is ours because no engine behind the trait is trusted to notice damage. A version that this code does
//! not know is told apart from damage in the message, but both are `Corrupt`: neither can be read.

use bytes::Bytes;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::storage::StorageError;

/// Version of every record layout of this room; raised when one changes incompatibly.
pub const VERSION: u8 = 1;
const HEADER_BYTES: usize = 5;

/// The stored form of a value.
pub fn encode<T: Serialize>(value: &T) -> Bytes {
    let header = vec![VERSION, 0, 0, 0, 0];
    let mut bytes =
        postcard::to_extend(value, header).expect("records are plain data that postcard can always write");
    let checksum = checksum(bytes[0], &bytes[HEADER_BYTES..]);
    bytes[1..HEADER_BYTES].copy_from_slice(&checksum.to_le_bytes());
    Bytes::from(bytes)
}

/// The value behind its stored form; `what` names it in errors.
///
/// # Errors
/// [`StorageError::Corrupt`] when the bytes are short, damaged, or of another version.
pub fn decode<T: DeserializeOwned>(bytes: &[u8], what: &str) -> Result<T, StorageError> {
    let corrupt = |problem: &str| StorageError::Corrupt { what: format!("{what}: {problem}") };
    let Some((header, payload)) = bytes.split_first_chunk::<HEADER_BYTES>() else {
        return Err(corrupt("too short"));
    };
    let stored = u32::from_le_bytes([header[1], header[2], header[3], header[4]]);
    if stored != checksum(header[0], payload) {
        return Err(corrupt("the checksum does not match"));
    }
    if header[0] != VERSION {
        return Err(corrupt(&format!("layout version {} is not known", header[0])));
    }
    postcard::from_bytes(payload).map_err(|error| corrupt(&error.to_string()))
}

fn checksum(version: u8, payload: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&[version]);
    hasher.update(payload);
    hasher.finalize()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn every_flipped_bit_is_noticed() {
        let bytes = encode(&(7u32, "text".to_owned(), vec![1.5f32, -2.0]));
        for bit in 0..bytes.len() * 8 {
            let mut damaged = bytes.to_vec();
            damaged[bit / 8] ^= 1 << (bit % 8);
            let outcome = decode::<(u32, String, Vec<f32>)>(&damaged, "value");
            assert!(matches!(outcome, Err(StorageError::Corrupt { .. })), "bit {bit}");
        }
    }

    proptest! {
        #[test]
        fn values_come_back(a in any::<u64>(), b in ".*", c in proptest::collection::vec(any::<i32>(), 0..50)) {
            let value = (a, b, c);
            prop_assert_eq!(decode::<(u64, String, Vec<i32>)>(&encode(&value), "value").unwrap(), value);
        }

        #[test]
        fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = decode::<(u64, String, Vec<i32>)>(&bytes, "value");
        }
    }
}
