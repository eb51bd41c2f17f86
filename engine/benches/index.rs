//! The occurrence index at scale: building, memory, exact and tolerant questions of six words (SPEC section 5), beside
//! a scan of the whole text that must find the same. Times are those of the processor.
//!
//! `cargo bench -p locution-engine --bench index [-- NUM_WORDS …]`; default 10⁶ and 10⁷ words of all levels.

#![allow(clippy::unwrap_used, missing_docs)]

use std::hint::black_box;

use locution_engine::index::{
    Lattice, OccurrenceIndex, STORED_WORD_BYTES, Syllables, TextQuery, WordTolerance, num_nodes_covered,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[allow(dead_code)] // Each bench uses its own part.
mod synthetic;
use synthetic::{SyntheticText, cpu_seconds, percentiles, synthetic_text};

const MAX_LEVEL: usize = 2;
const QUERY_WORDS: usize = 6;

fn main() {
    let sizes: Vec<usize> = std::env::args().skip(1).filter_map(|argument| argument.parse().ok()).collect();
    let sizes = if sizes.is_empty() { vec![1_000_000, 10_000_000] } else { sizes };
    for num_words in sizes {
        bench_plain(num_words);
        bench_lattice(num_words);
    }
}

/// Level-0 words only and exact questions, the task that text search engines are measured on.
fn bench_plain(num_words: usize) {
    let text = synthetic_text(7, num_words);
    let index = build("level 0 only", &text, 0);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut micros = Vec::new();
    for _ in 0..20_000 {
        let asked = exact_query(&text, rng.random_range(0..num_words - QUERY_WORDS));
        let start = cpu_seconds();
        black_box(index.find_exact(&asked));
        micros.push((cpu_seconds() - start) * 1e6);
    }
    let (median, p99) = percentiles(&mut micros);
    println!("  exact, {QUERY_WORDS} words: median {median:.1} µs, p99 {p99:.1} µs");
    let start = cpu_seconds();
    for _ in 0..5 {
        let node = rng.random_range(0..num_words - QUERY_WORDS);
        let asked = &text.nodes[node..node + QUERY_WORDS];
        let num_found = text.nodes.windows(QUERY_WORDS).filter(|words| *words == asked).count();
        assert_eq!(index.find_exact(&exact_query(&text, node)).len(), num_found);
    }
    println!("  scan: {:.0} µs", (cpu_seconds() - start) * 1e6 / 5.0);
}

/// Words of three levels and tolerant questions with all their alternatives.
fn bench_lattice(num_words: usize) {
    // About 1.3 words of all levels for each of level 0.
    let text = synthetic_text(8, num_words * 10 / 13);
    let index = build("levels 0 to 2", &text, MAX_LEVEL);
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut micros = Vec::new();
    let mut num_found = 0;
    for _ in 0..2_000 {
        let query = tolerant_query(&text, rng.random_range(0..text.nodes.len() - QUERY_WORDS));
        let start = cpu_seconds();
        num_found += black_box(index.find(&query, 3)).len();
        micros.push((cpu_seconds() - start) * 1e6);
    }
    let (median, p99) = percentiles(&mut micros);
    let mean_found = f64::from(num_found as u32) / 2_000.0;
    println!(
        "  tolerant, {QUERY_WORDS} words with levels: median {median:.1} µs, p99 {p99:.1} µs, {mean_found:.1} found"
    );
    let start = cpu_seconds();
    for _ in 0..3 {
        let node = rng.random_range(0..text.nodes.len() - QUERY_WORDS);
        assert_eq!(index.find(&tolerant_query(&text, node), 3).len(), scan(&text, node, 3));
    }
    println!("  scan: {:.0} µs", (cpu_seconds() - start) * 1e6 / 3.0);
}

fn build(name: &str, text: &SyntheticText, max_level: usize) -> OccurrenceIndex {
    let stored = text.stored(max_level);
    let num_words = stored.len() / STORED_WORD_BYTES;
    let mut seconds = Vec::new();
    let mut index = OccurrenceIndex::default();
    for _ in 0..3 {
        let start = cpu_seconds();
        index = OccurrenceIndex::from_stored([stored.as_slice()]).unwrap();
        seconds.push(cpu_seconds() - start);
    }
    let (median, _) = percentiles(&mut seconds);
    println!(
        "{name}: {num_words} words, built from bytes at {:.1} M words/s, {:.1} bytes per word",
        num_words as f64 / median / 1e6,
        index.num_bytes() as f64 / num_words as f64
    );
    index
}

fn exact_query(text: &SyntheticText, node: usize) -> Vec<Syllables> {
    let syllables =
        |&(class, size, turn): &(u8, u32, i16)| Syllables { class: class.into(), size: size as u16, turn };
    text.nodes[node..node + QUERY_WORDS].iter().map(syllables).collect()
}

fn tolerant_query(text: &SyntheticText, node: usize) -> TextQuery {
    let lattice = Lattice::from_words(&text.words(node..node + QUERY_WORDS, MAX_LEVEL)).unwrap();
    TextQuery::from_text(&lattice, 0..QUERY_WORDS, &WordTolerance::default())
}

/// Number of stretches that match the question at a node, read from every node of the text on.
fn scan(text: &SyntheticText, node: usize, min_words: usize) -> usize {
    let tolerance = WordTolerance::default();
    let question = text.words(node..node + QUERY_WORDS, MAX_LEVEL);
    let lattice = Lattice::from_words(&question).unwrap();
    let mut windows = vec![Vec::new(); QUERY_WORDS];
    for end in 0..QUERY_WORDS {
        for level in 0..=MAX_LEVEL {
            if let Some(word) = lattice.word_ending_at(end, level) {
                windows[end + 1 - num_nodes_covered(level)].push((end + 1, tolerance.window(&word)));
            }
        }
    }
    let mut num_found = 0;
    for first in 0..text.nodes.len() {
        let mut reached = vec![Vec::<(usize, usize)>::new(); QUERY_WORDS + 1];
        reached[0].push((first, 0));
        for at in 0..QUERY_WORDS {
            for (place, num_words) in std::mem::take(&mut reached[at]) {
                for level in 0..=MAX_LEVEL {
                    let end = place + num_nodes_covered(level);
                    if end > text.nodes.len() || text.nodes[place].0 != text.nodes[end - 1].0 {
                        continue;
                    }
                    let nodes = &text.nodes[place..end];
                    let word = Syllables {
                        class: nodes[0].0.into(),
                        size: nodes.iter().map(|node| node.1).sum::<u32>() as u16,
                        turn: nodes.iter().fold(0, |sum: i16, node| sum.wrapping_add(node.2)),
                    };
                    for (next, _) in windows[at].iter().filter(|(_, window)| window.contains(&word)) {
                        match reached[*next].iter_mut().find(|known| known.0 == end) {
                            Some(known) => known.1 = known.1.max(num_words + 1),
                            None => reached[*next].push((end, num_words + 1)),
                        }
                    }
                }
            }
        }
        num_found += reached[QUERY_WORDS].iter().filter(|reached| reached.1 >= min_words).count();
    }
    num_found
}
