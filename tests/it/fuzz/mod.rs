//! Text and bytes made to break what reads them: the entries of `tests/corpus`, changed at random, for every reader of what
//! comes from outside.
//!
//! ```text
//! LOCUTION_FUZZ_S=60 cargo test -p locution-tests --test it fuzz      so many seconds for each target, other changes every time
//! ```
//!
//! Without it each target gets a fixed number of inputs, the same ones every time. An input that breaks a target is kept in
//! a file whose name is printed; it belongs into the corpus together with the repair.

mod bodies;
mod formats;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rand::rngs::SysRng;
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng, TryRng};
use rand_chacha::ChaCha8Rng;

/// What readers of text and numbers trip over.
const TOKENS: [&[u8]; 24] = [
    b"-1",
    b"0",
    b"1e308",
    b"-1e-308",
    b"1e999",
    b"nan",
    b"inf",
    b"null",
    b"true",
    b"\"\"",
    b"[]",
    b"{}",
    b"[[[[[[[[",
    b"\n",
    b" ",
    b"\t",
    b"\0",
    b"\xff",
    b"\xef\xbb\xbf",
    b"18446744073709551616",
    b"9223372036854775807",
    b"4294967296",
    b"65536",
    b"-0.0",
];

/// The entries of a corpus and what comes of them.
struct Inputs {
    target: &'static str,
    corpus: Vec<Vec<u8>>,
    rng: ChaCha8Rng,
    num_given: usize,
    last: Vec<u8>,
    end: End,
}

enum End {
    Number(usize),
    Time(Instant),
}

impl Inputs {
    /// The corpus of a target: first its entries as they are, then so many changed ones.
    fn of(target: &'static str, num_changed: usize) -> Self {
        Self::with(target, entries(target), num_changed)
    }

    /// The same from entries at hand.
    fn with(target: &'static str, corpus: Vec<Vec<u8>>, num_changed: usize) -> Self {
        assert!(!corpus.is_empty(), "{target} has no corpus");
        let seconds = std::env::var("LOCUTION_FUZZ_S").ok().and_then(|text| text.parse().ok());
        let (seed, end) = match seconds {
            Some(seconds) => {
                (SysRng.try_next_u64().unwrap(), End::Time(Instant::now() + Duration::from_secs(seconds)))
            }
            None => (17, End::Number(corpus.len() + num_changed)),
        };
        let rng = ChaCha8Rng::seed_from_u64(seed);
        Self { target, corpus, rng, num_given: 0, last: Vec::new(), end }
    }

    /// An entry with up to four changes.
    fn changed(&mut self) -> Vec<u8> {
        let rng = &mut self.rng;
        let pick = |rng: &mut ChaCha8Rng| self.corpus.choose(rng).expect("a corpus has entries").clone();
        let mut input = pick(rng);
        for _ in 0..rng.random_range(1..=4) {
            let part = part_of(&input, rng);
            match rng.random_range(0..7) {
                0 if !input.is_empty() => {
                    let at = rng.random_range(0..input.len());
                    input[at] ^= 1 << rng.random_range(0..8);
                }
                1 => drop(input.drain(part)),
                2 => {
                    let doubled = input[part.clone()].to_vec();
                    input.splice(part.start..part.start, doubled);
                }
                3 => {
                    let other = pick(rng);
                    let foreign = part_of(&other, rng);
                    input.splice(part, other[foreign].to_vec());
                }
                4 => input.truncate(part.end),
                5 => {
                    drop(input.splice(
                        word_at(&input, part.start),
                        TOKENS[rng.random_range(0..TOKENS.len())].to_vec(),
                    ))
                }
                _ => drop(
                    input.splice(part.start..part.start, TOKENS[rng.random_range(0..TOKENS.len())].to_vec()),
                ),
            }
        }
        input
    }
}

impl Iterator for Inputs {
    type Item = Vec<u8>;

    fn next(&mut self) -> Option<Vec<u8>> {
        let is_over = match self.end {
            End::Number(num) => self.num_given >= num,
            End::Time(end) => self.num_given >= self.corpus.len() && Instant::now() >= end,
        };
        if is_over {
            return None;
        }
        self.last = match self.corpus.get(self.num_given) {
            Some(entry) => entry.clone(),
            None => self.changed(),
        };
        self.num_given += 1;
        Some(self.last.clone())
    }
}

impl Drop for Inputs {
    fn drop(&mut self) {
        println!("{}: {} inputs", self.target, self.num_given);
        if std::thread::panicking() {
            let path = std::env::temp_dir().join(format!("locution-{}-{}", self.target, std::process::id()));
            let kept = std::fs::write(&path, &self.last);
            println!("{}: the input is in {}: {kept:?}", self.target, path.display());
        }
    }
}

/// Files of the corpus, in the order of their names.
fn entries(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target);
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

/// A place and up to 40 bytes from it.
fn part_of(input: &[u8], rng: &mut ChaCha8Rng) -> std::ops::Range<usize> {
    let start = rng.random_range(0..=input.len());
    start..input.len().min(start + rng.random_range(0..=40))
}

/// The word or number around a place.
fn word_at(input: &[u8], at: usize) -> std::ops::Range<usize> {
    let is_part = |byte: &u8| byte.is_ascii_alphanumeric() || b"._-+".contains(byte);
    let before = input[..at].iter().rev().take_while(|byte| is_part(byte)).count();
    let behind = input[at..].iter().take_while(|byte| is_part(byte)).count();
    at - before..at + behind
}

#[test]
fn changes_are_many_and_the_same_every_time() {
    if std::env::var_os("LOCUTION_FUZZ_S").is_some() {
        return;
    }
    let corpus = || vec![b"VERTEX_SE2 1 2.5 -3 0.1\n".to_vec(), b"{\"a\": [1, 2]}".to_vec()];
    let first: Vec<_> = Inputs::with("itself", corpus(), 500).collect();
    assert!(first == Inputs::with("itself", corpus(), 500).collect::<Vec<_>>());
    assert_eq!(first[..2], corpus()[..]);
    let distinct: std::collections::HashSet<_> = first.iter().collect();
    assert!(distinct.len() > 400, "{}", distinct.len());
}
