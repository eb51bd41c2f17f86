//! Documents that are nearly right: a seed, changed in a few places.
//!
//! ```text
//! cargo test --workspace --test formats --test bodies --test records     # a few seconds for every target, part of all tests
//! BOLERO_RANDOM_TEST_TIME_MS=600000 cargo test --workspace --test formats
//! cargo install cargo-bolero && cargo bolero test --package locution-fuzz --test formats carmen   # guided by coverage
//! ```
//!
//! Random bytes are refused by the first check of any reader; a document in which a few numbers, signs and lines are
//! others gets as far as its readers go.

mod backup;

pub use backup::{Pair, pairs_of, sealed, written};

use std::time::Duration;

use bolero::TypeGenerator;

/// How long each target is tried in an ordinary run of the tests.
pub const TEST_TIME: Duration = Duration::from_secs(3);

/// What readers stumble over.
const TOKENS: [&[u8]; 28] = [
    b"nan",
    b"-inf",
    b"1e309",
    b"-1e308",
    b"1e-320",
    b"-0",
    b"0",
    b"-1",
    b"1e7",
    b"4294967296",
    b"9223372036854775808",
    b"18446744073709551616",
    b"99999999999999999999999999999999999999999",
    b" ",
    b"\n",
    b"\r\n",
    b"\t",
    b"\0",
    b"\"",
    b"\\ud800",
    b"\xff\xfe",
    b"\xef\xbb\xbf",
    b"[",
    b"]",
    b"{",
    b"}",
    b"null",
    b"\xc3\xa9",
];

/// One change. Places are taken modulo the length.
#[derive(Clone, Debug, TypeGenerator)]
pub enum Edit {
    /// Another byte.
    Set {
        /// Where.
        at: u16,
        /// Which.
        byte: u8,
    },
    /// Something that readers stumble over.
    Insert {
        /// Where.
        at: u16,
        /// Which of them.
        token: u8,
    },
    /// The word at a place gives way to something that readers stumble over.
    Replace {
        /// Where.
        at: u16,
        /// Which of them.
        token: u8,
    },
    /// Bytes are missing.
    Remove {
        /// From where.
        at: u16,
        /// How many.
        len: u8,
    },
    /// The line at a place stands there many times.
    Repeat {
        /// Where.
        at: u16,
        /// How often.
        times: u8,
    },
    /// The end is missing.
    Cut {
        /// From where.
        at: u16,
    },
}

/// No document is longer, so that none is refused for its size alone.
const DOCUMENT_BYTES_MAX: usize = 64 << 10;

/// A document after some changes.
pub fn edited(seed: &[u8], edits: &[Edit]) -> Vec<u8> {
    let mut document = seed.to_vec();
    for edit in edits {
        edit.apply(&mut document);
        document.truncate(DOCUMENT_BYTES_MAX);
    }
    document
}

impl Edit {
    fn apply(&self, document: &mut Vec<u8>) {
        let place = |at: u16| usize::from(at) % document.len().max(1);
        let token = |token: u8| TOKENS[usize::from(token) % TOKENS.len()].iter().copied();
        match *self {
            Self::Insert { at, token: which } => {
                let at = place(at).min(document.len());
                document.splice(at..at, token(which));
            }
            _ if document.is_empty() => {}
            Self::Set { at, byte } => {
                let at = place(at);
                document[at] = byte;
            }
            Self::Replace { at, token: which } => {
                let word = around(document, place(at), |byte| {
                    byte.is_ascii_alphanumeric() || b".+-_".contains(&byte)
                });
                document.splice(word, token(which));
            }
            Self::Remove { at, len } => {
                let at = place(at);
                let end = (at + usize::from(len)).min(document.len());
                document.drain(at..end);
            }
            Self::Repeat { at, times } => {
                let line = around(document, place(at), |byte| byte != b'\n');
                let copy = document[line.start..(line.end + 1).min(document.len())].to_vec();
                document.splice(line.start..line.start, copy.repeat(usize::from(times % 16)));
            }
            Self::Cut { at } => document.truncate(place(at)),
        }
    }
}

/// The stretch around a place whose bytes belong together.
fn around(document: &[u8], at: usize, belongs: impl Fn(u8) -> bool) -> std::ops::Range<usize> {
    let start = document[..at].iter().rposition(|byte| !belongs(*byte)).map_or(0, |idx| idx + 1);
    let end = document[at..].iter().position(|byte| !belongs(*byte)).map_or(document.len(), |len| at + len);
    start..end.max(start)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edits_do_what_they_say() {
        let seed = b"one 12 x\ntwo\n";
        let after = |edit| String::from_utf8(edited(seed, &[edit])).unwrap_or_default();
        assert_eq!(after(Edit::Set { at: 0, byte: b'O' }), "One 12 x\ntwo\n");
        assert_eq!(after(Edit::Replace { at: 5, token: 0 }), "one nan x\ntwo\n");
        assert_eq!(after(Edit::Remove { at: 4, len: 3 }), "one x\ntwo\n");
        assert_eq!(after(Edit::Repeat { at: 10, times: 2 }), "one 12 x\ntwo\ntwo\ntwo\n");
        assert_eq!(after(Edit::Cut { at: 3 }), "one");
        assert_eq!(after(Edit::Insert { at: 13, token: 7 }), "-1one 12 x\ntwo\n");
        assert_eq!(edited(b"", &[Edit::Cut { at: 9 }, Edit::Set { at: 1, byte: 2 }]), b"");
    }
}
