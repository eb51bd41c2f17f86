//! The pairwise engine: one lap against forty with three levels, and plain pairs of words, beside one pair at a time.
//!
//! `cargo bench -p locution-engine --bench matching`. The thesis took 38 s for the lap (Table 5.1) and 100 ms for
//! 60 million pairs (Table 4.2).

#![allow(clippy::unwrap_used, missing_docs)]

use std::hint::black_box;

use locution_engine::index::{Lattice, WordTolerance};
use locution_engine::matching::{MatchingConfig, Relation, find_chains, find_chains_in};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[allow(dead_code)] // Each bench uses its own part.
mod synthetic;
use synthetic::{SyntheticText, cpu_seconds, percentiles, synthetic_text};

/// Level-0 words of a lap of 120 m; real texts have three to eight on 10 m.
const WORDS_PER_LAP: usize = 80;
const NUM_LAPS: usize = 40;

fn main() {
    bench_laps();
    bench_pairs();
}

/// One lap against forty earlier ones of the same building, in which one word in eight came out different.
fn bench_laps() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let building = synthetic_text(5, WORDS_PER_LAP);
    let mut lap = || {
        let change = |node: &(u8, u32, i16)| {
            if rng.random_bool(0.125) { (rng.random_range(0..8), node.1, node.2) } else { *node }
        };
        let nodes: Vec<_> = building.nodes.iter().map(change).collect();
        Lattice::from_words(&SyntheticText::new(nodes).words(0..WORDS_PER_LAP, 2)).unwrap()
    };
    let earlier: Vec<Lattice> = (0..NUM_LAPS).map(|_| lap()).collect();
    let later = lap();
    let earlier: Vec<&Lattice> = earlier.iter().collect();
    let config = MatchingConfig::default();
    let mut millis = Vec::new();
    let mut num_chains = 0;
    for _ in 0..50 {
        let start = cpu_seconds();
        num_chains = black_box(find_chains_in(&earlier, &later, &config)).len();
        millis.push((cpu_seconds() - start) * 1e3);
    }
    let (median, p99) = percentiles(&mut millis);
    println!(
        "{NUM_LAPS} laps of {WORDS_PER_LAP} words against one, three levels, both directions: \
         median {median:.2} ms, p99 {p99:.2} ms, {num_chains} chains"
    );
}

/// Sixty million pairs of level-0 words, chains included, one direction's worth at a time.
fn bench_pairs() {
    let [earlier, later] = [30_000, 1_000].map(|num_nodes| {
        let words = synthetic_text(num_nodes as u64, num_nodes).words(0..num_nodes, 0);
        (Lattice::from_words(&words).unwrap(), words)
    });
    let num_pairs = 2 * earlier.1.len() * later.1.len();
    let config = MatchingConfig { min_chain_words: vec![20], ..MatchingConfig::default() };
    let mut millis = Vec::new();
    for _ in 0..20 {
        let start = cpu_seconds();
        black_box(find_chains(&earlier.0, &later.0, Relation::DifferentRuns, &config));
        millis.push((cpu_seconds() - start) * 1e3);
    }
    let (median, p99) = percentiles(&mut millis);
    println!("{num_pairs} pairs of words with their chains: median {median:.1} ms, p99 {p99:.1} ms");
    let tolerance = WordTolerance::default();
    let start = cpu_seconds();
    let mut num_matching = 0;
    for later in later.1.iter().take(100) {
        num_matching += earlier.1.iter().filter(|earlier| tolerance.matches(later, earlier)).count();
    }
    let pairs = 100.0 * earlier.1.len() as f64;
    let millis = (cpu_seconds() - start) * 1e3 * num_pairs as f64 / pairs;
    println!(
        "the same pairs one at a time, without chains: {millis:.0} ms ({num_matching} match in {pairs})"
    );
}
