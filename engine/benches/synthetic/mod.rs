//! Texts with the statistics of the published comparison: 500 types under Zipf's law, 30 % copied stretches.

use locution_engine::index::{STORED_WORD_BYTES, num_nodes_covered};
use locution_engine::text::{Word, WordId};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Number of different level-0 words.
const NUM_TYPES: usize = 500;
/// Share of words that are copied from before.
const COPIED_SHARE: f64 = 0.3;

/// ⟨class, size, turn in 2¹⁵ths of π⟩.
pub type Syllables = (u8, u32, i16);

/// A text: its level-0 words in order.
pub struct SyntheticText {
    pub nodes: Vec<Syllables>,
    starts: Vec<u32>,
}

/// A text of `num_nodes` level-0 words; the same seed gives the same text.
pub fn synthetic_text(seed: u64, num_nodes: usize) -> SyntheticText {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let types: Vec<Syllables> = (0..NUM_TYPES).map(|_| word_type(&mut rng)).collect();
    let mut cumulative = Vec::with_capacity(NUM_TYPES);
    let mut total = 0.0;
    for rank in 1..=NUM_TYPES {
        total += 1.0 / rank as f64;
        cumulative.push(total);
    }
    let mut nodes: Vec<Syllables> = Vec::with_capacity(num_nodes);
    let mut num_copied = 0;
    while nodes.len() < num_nodes {
        let length = rng.random_range(10..50).min(num_nodes - nodes.len());
        if nodes.len() > 100 && (num_copied as f64) < COPIED_SHARE * nodes.len() as f64 {
            let from = rng.random_range(0..nodes.len() - 50);
            nodes.extend_from_within(from..from + length);
            num_copied += length;
            continue;
        }
        for _ in 0..length {
            let drawn = rng.random_range(0.0..total);
            let mut word = types[cumulative.partition_point(|&sum| sum < drawn).min(NUM_TYPES - 1)];
            if nodes.last().is_some_and(|last| last.0 == word.0) {
                word.0 = (word.0 + 1) % 8;
            }
            nodes.push(word);
        }
    }
    SyntheticText::new(nodes)
}

fn word_type(rng: &mut impl Rng) -> Syllables {
    let size = (4.0 * 50.0f64.powf(rng.random_range(0.0..1.0))) as u32;
    let turn_deg = match rng.random_range(0..10) {
        0 => 90.0,
        1 => -90.0,
        _ => rng.random_range(-15.0..15.0),
    };
    (rng.random_range(0..8), size, (turn_deg / 180.0 * 32768.0) as i16)
}

impl SyntheticText {
    /// A text of these level-0 words.
    pub fn new(nodes: Vec<Syllables>) -> Self {
        let mut starts = vec![0];
        for node in &nodes {
            starts.push(starts[starts.len() - 1] + node.1);
        }
        Self { nodes, starts }
    }

    /// The word of a level that ends at a node, where Algorithm 5.2 makes one; counted from the node `first` on.
    pub fn word(&self, first: usize, end: usize, level: usize) -> Option<Word> {
        let start = (end + 1).checked_sub(num_nodes_covered(level)).filter(|&start| start >= first)?;
        if self.nodes[start].0 != self.nodes[end].0 {
            return None;
        }
        let turn: i32 = self.nodes[start..=end].iter().map(|node| i32::from(node.2)).sum();
        let offset = self.starts[first];
        Some(Word {
            id: WordId { level: level as u8, index: 0 },
            class: self.nodes[start].0,
            size: self.starts[end + 1] - self.starts[start],
            turn_rad: turn as f32 / 32768.0 * std::f32::consts::PI,
            observations: (self.starts[start] - offset, self.starts[end + 1] - 1 - offset),
            predecessors: vec![],
        })
    }

    /// The words of all levels of a stretch of nodes, as a text of its own.
    pub fn words(&self, nodes: std::ops::Range<usize>, max_level: usize) -> Vec<Word> {
        let mut words: Vec<Word> = Vec::new();
        for level in 0..=max_level {
            let of_level = nodes.clone().filter_map(|end| self.word(nodes.start, end, level));
            words.extend(of_level.enumerate().map(|(index, word)| {
                let id = WordId { level: level as u8, index: index as u32 };
                Word { id, ..word }
            }));
        }
        words
    }

    /// The whole text as stored words, without making each of them first; levels 0 to `max_level`.
    pub fn stored(&self, max_level: usize) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.nodes.len() * 2 * STORED_WORD_BYTES);
        for end in 0..self.nodes.len() {
            for level in 0..=max_level {
                let Some(start) = (end + 1).checked_sub(num_nodes_covered(level)) else { continue };
                if self.nodes[start].0 != self.nodes[end].0 {
                    continue;
                }
                let turn: i32 = self.nodes[start..=end].iter().map(|node| i32::from(node.2)).sum();
                let size = self.starts[end + 1] - self.starts[start];
                bytes.extend([self.nodes[start].0, level as u8]);
                bytes.extend((size as u16).to_le_bytes());
                bytes.extend((turn as i16).to_le_bytes());
                bytes.extend(self.starts[start].to_le_bytes());
            }
        }
        bytes
    }
}

/// Median and 99th percentile, after sorting.
pub fn percentiles(micros: &mut [f64]) -> (f64, f64) {
    micros.sort_by(f64::total_cmp);
    (micros[micros.len() / 2], micros[micros.len() * 99 / 100])
}

/// Seconds that this thread has computed, which other work on the machine does not lengthen.
pub fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}
