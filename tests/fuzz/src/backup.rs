//! Backups taken apart and put together again with right checksums, so that what is wrong lies in the records.

/// A stored key and its value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pair {
    /// As stored.
    pub key: Vec<u8>,
    /// As stored: layout version, checksum, payload.
    pub value: Vec<u8>,
}

const MAGIC: &[u8] = b"LOCUTION BACKUP 1\n";
/// Layout version and checksum before the payload of a value.
const VALUE_HEADER_BYTES: usize = 5;

/// The pairs of a backup that a server wrote.
///
/// # Panics
/// When it is none: the caller has it from a server.
pub fn pairs_of(backup: &[u8]) -> Vec<Pair> {
    let mut rest = backup.strip_prefix(MAGIC).expect("a backup begins with its format");
    let mut pairs = Vec::new();
    while let Some((&kind, after)) = rest.split_first() {
        let (block, after) = sized(after);
        let mut block = block;
        while kind == b'D' && !block.is_empty() {
            let (lens, content) = block.split_at(8);
            let len =
                |at: usize| u32::from_le_bytes([lens[at], lens[at + 1], lens[at + 2], lens[at + 3]]) as usize;
            let (key, content) = content.split_at(len(0));
            let (value, content) = content.split_at(len(4));
            pairs.push(Pair { key: key.to_vec(), value: value.to_vec() });
            block = content;
        }
        rest = &after[4..];
    }
    pairs
}

/// The bytes behind their number, and what follows.
fn sized(bytes: &[u8]) -> (&[u8], &[u8]) {
    let (len, rest) = bytes.split_first_chunk::<4>().expect("a block says how long it is");
    rest.split_at(u32::from_le_bytes(*len) as usize)
}

/// A value whose checksum is right again.
pub fn sealed(mut value: Vec<u8>) -> Vec<u8> {
    if value.len() >= VALUE_HEADER_BYTES {
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(&value[..1]);
        hasher.update(&value[VALUE_HEADER_BYTES..]);
        value[1..VALUE_HEADER_BYTES].copy_from_slice(&hasher.finalize().to_le_bytes());
    }
    value
}

/// A backup of pairs, in the order of their keys.
pub fn written(mut pairs: Vec<Pair>) -> Vec<u8> {
    pairs.sort_by(|a, b| a.key.cmp(&b.key));
    pairs.dedup_by(|a, b| a.key == b.key);
    let mut bytes = MAGIC.to_vec();
    append_block(&mut bytes, b'H', br#"{"site":"site","version":"0"}"#);
    let mut sum = 0u64;
    for Pair { key, value } in &pairs {
        let lens = [(key.len() as u32).to_le_bytes(), (value.len() as u32).to_le_bytes()].concat();
        append_block(&mut bytes, b'D', &[&lens, &key[..], value].concat());
        sum = sum.wrapping_add(checksum(key, value));
    }
    append_block(&mut bytes, b'E', &[(pairs.len() as u64).to_le_bytes(), sum.to_le_bytes()].concat());
    bytes
}

/// As the storage sums them.
fn checksum(key: &[u8], value: &[u8]) -> u64 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&(key.len() as u64).to_le_bytes());
    hasher.update(key);
    hasher.update(value);
    let mut mixed = (u64::from(hasher.finalize()) << 32) | (value.len() as u64 & 0xffff_ffff);
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ (mixed >> 31)
}

fn append_block(bytes: &mut Vec<u8>, kind: u8, block: &[u8]) {
    let start = bytes.len();
    bytes.push(kind);
    bytes.extend((block.len() as u32).to_le_bytes());
    bytes.extend(block);
    let checksum = crc32fast::hash(&bytes[start..]);
    bytes.extend(checksum.to_le_bytes());
}
