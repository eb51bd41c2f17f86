//! What a database holds after which commit, so that nothing can go missing without a word.
//!
//! Every commit writes one record more, under a key that sorts before all others: how many commits there were, how
//! many pairs of key and value there are, and the sum of a checksum over each. The sum does not depend on the order
//! of the pairs, so a commit brings it up to date from the pairs that it changes. Reading everything and adding up
//! anew shows any pair that was lost, changed or brought back, wherever in the engine below it happened.

use std::ops::Range;

/// The key of the record; two zero bytes cannot begin a key of the application.
pub(super) const CONTENT_KEY: &[u8] = b"\0\0content";
/// By these bytes the record is found in a damaged file.
const MARK: [u8; 16] = *b"\xf1LocutionContent";
const RECORD_BYTES: usize = MARK.len() + 3 * 8 + 4;

/// What a database holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Content {
    /// Commits since the site was made.
    pub num_commits: u64,
    /// Pairs of key and value, this record left out.
    pub num_pairs: u64,
    /// Sum of the checksums of all pairs.
    pub sum: u64,
}

impl Content {
    /// Counts a pair in.
    pub fn add(&mut self, key: &[u8], value: &[u8]) {
        self.num_pairs = self.num_pairs.wrapping_add(1);
        self.sum = self.sum.wrapping_add(checksum(key, value));
    }

    /// Counts a pair out.
    pub fn remove(&mut self, key: &[u8], value: &[u8]) {
        self.num_pairs = self.num_pairs.wrapping_sub(1);
        self.sum = self.sum.wrapping_sub(checksum(key, value));
    }

    /// The stored form.
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = MARK.to_vec();
        for number in [self.num_commits, self.num_pairs, self.sum] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        bytes
    }

    /// The record behind its stored form.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let (body, crc) = bytes.split_last_chunk::<4>()?;
        let is_whole = bytes.len() == RECORD_BYTES
            && body.starts_with(&MARK)
            && crc32fast::hash(body) == u32::from_le_bytes(*crc);
        let number = |at: Range<usize>| body.get(at)?.first_chunk().map(|bytes| u64::from_le_bytes(*bytes));
        is_whole.then_some(Self {
            num_commits: number(16..24)?,
            num_pairs: number(24..32)?,
            sum: number(32..40)?,
        })
    }

    /// The records that stand anywhere in raw bytes.
    pub fn find_all(bytes: &[u8]) -> impl Iterator<Item = Self> + '_ {
        let mut at = 0;
        std::iter::from_fn(move || {
            loop {
                let found = bytes.get(at..)?.iter().position(|byte| *byte == MARK[0])?;
                at += found + 1;
                if let Some(record) = bytes.get(at - 1..at - 1 + RECORD_BYTES).and_then(Self::decode) {
                    return Some(record);
                }
            }
        })
    }
}

/// A pair's checksum, spread over 64 bits so that sums of many tell them apart.
fn checksum(key: &[u8], value: &[u8]) -> u64 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&(key.len() as u64).to_le_bytes());
    hasher.update(key);
    hasher.update(value);
    // The finalizer of SplitMix64.
    let mut mixed = (u64::from(hasher.finalize()) << 32) | (value.len() as u64 & 0xffff_ffff);
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ (mixed >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_knows_no_order_and_forgets_what_is_taken_out() {
        let pairs: [(&[u8], &[u8]); 3] = [(b"a", b"1"), (b"b", b""), (b"", b"b")];
        let mut forward = Content::default();
        let mut backward = Content::default();
        pairs.iter().for_each(|(key, value)| forward.add(key, value));
        pairs.iter().rev().for_each(|(key, value)| backward.add(key, value));
        assert_eq!(forward, backward);
        forward.remove(b"b", b"");
        forward.add(b"b", b"2");
        assert_ne!(forward, backward);
        forward.remove(b"b", b"2");
        forward.add(b"b", b"");
        assert_eq!(forward, backward);
    }

    #[test]
    fn a_record_is_found_among_other_bytes_and_only_whole() {
        let content = Content { num_commits: 7, num_pairs: 2, sum: 99 };
        let mut bytes = vec![MARK[0]; 20];
        bytes.extend(content.encode());
        bytes.extend(b"tail");
        assert_eq!(Content::find_all(&bytes).collect::<Vec<_>>(), [content]);
        for at in 20..20 + RECORD_BYTES {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1;
            assert_eq!(Content::find_all(&damaged).count(), 0, "byte {at}");
        }
    }
}
