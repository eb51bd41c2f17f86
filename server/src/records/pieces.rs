//! Bytes that may be larger than one value: cut into pieces, each a value of its own with its checksum.

use bytes::Bytes;

use super::codec;
use crate::storage::StorageError;

/// A piece is at most this large, well under the storage's value limit.
const PIECE_BYTES: usize = 512 << 10;

/// The values to store, in order.
pub fn pieces(bytes: &[u8]) -> impl Iterator<Item = Bytes> {
    bytes.chunks(PIECE_BYTES).map(|piece| codec::encode(&piece.to_vec()))
}

/// The bytes behind stored pieces; `what` names them in errors.
///
/// # Errors
/// [`StorageError::Corrupt`] when a piece cannot be read.
pub fn join_pieces<'a>(
    stored: impl IntoIterator<Item = &'a Bytes>,
    what: &str,
) -> Result<Vec<u8>, StorageError> {
    let mut bytes = Vec::new();
    for piece in stored {
        bytes.extend(codec::decode::<Vec<u8>>(piece, what)?);
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storage::VALUE_BYTES_MAX;

    #[test]
    fn large_bytes_are_cut_into_values_that_may_be_stored() {
        for num_bytes in [0, 1, PIECE_BYTES, PIECE_BYTES + 1, 3 * PIECE_BYTES] {
            let bytes: Vec<u8> = (0..num_bytes).map(|idx| (idx % 251) as u8).collect();
            let stored: Vec<Bytes> = pieces(&bytes).collect();
            assert_eq!(stored.len(), num_bytes.div_ceil(PIECE_BYTES));
            assert!(stored.iter().all(|piece| piece.len() < VALUE_BYTES_MAX));
            assert_eq!(join_pieces(&stored, "bytes").unwrap(), bytes);
        }
    }
}
