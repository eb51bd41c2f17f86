//! Where each sequence of words occurs, over all runs of a site (thesis Algorithm 5.3, SPEC section 5).
//!
//! Two ordered lists of places answer all questions:
//!
//! - **plain**: every level-0 word, ordered by the codes of the words from there on, so that all places with the same
//!   beginning stand together (a suffix array cut off after a few words);
//! - **fused**: every boundary that is crossed by a pair of words of which at least one is an alternative, ordered by
//!   the codes of the pair.
//!
//! A word's code is coarse, so a tolerance is a few ranges of codes; whoever finds a place looks at the words there.
//! Most looks are saved by what stands beside a place in its list: the classes of the words around the pair. An
//! alternative word has the class of its first and of its last word (Algorithm 5.2), so they are the same whichever
//! way the text around is read. Costs twelve bytes a word, six a level-0 word and six a pair through alternatives.

use super::lattice::Lattice;
use super::packed::{PackedWord, load_words, store_words};
use super::radix::{Keyed, sort_by_key};
use super::tolerance::Syllables;
use crate::text::Interval;

/// All words of a site with the lists that find them. Immutable: building is fast enough to do it again.
#[derive(Clone, Debug, Default)]
pub struct OccurrenceIndex {
    pub(super) words: Vec<PackedWord>,
    /// Position of the first word of each run; runs without words have the position of the next run.
    run_starts: Vec<u32>,
    /// The codes that occur, ascending; a word's rank is its code's place here.
    codes: Vec<u16>,
    /// Positions of level-0 words.
    plain: PairList,
    /// Positions of the level-0 words that follow a boundary.
    fused: PairList,
    /// Words of a plain key.
    num_key_words: usize,
    /// The highest level that a word has.
    max_level: usize,
    /// Level-0 words before every [`BLOCK_WORDS`]th word, so that a word's number is counted within a block.
    nodes_before_block: Vec<u32>,
}

/// Words between two entries of the table of level-0 words.
const BLOCK_WORDS: usize = 256;

/// The class around a pair of words where the text begins or ends there; classes are kept modulo 64.
const NO_CLASS: u8 = 64;

/// Sets of classes around a pair of words, one bit per class.
pub(super) type ClassSet = u128;

/// Places that stand together in a list.
#[derive(Clone, Copy, Debug)]
pub(super) struct Places<'a> {
    places: &'a [u32],
    contexts: &'a [[u8; 2]],
}

impl<'a> Places<'a> {
    /// How many they are.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Those with one of the given classes before the pair and one of the given classes behind it.
    pub fn within(self, [before, behind]: [ClassSet; 2]) -> impl Iterator<Item = u32> + 'a {
        let is_within = move |context: &[u8; 2]| (before >> context[0]) & (behind >> context[1]) & 1 != 0;
        let pairs = self.places.iter().zip(self.contexts);
        pairs.filter(move |(_, context)| is_within(context)).map(|(place, _)| *place)
    }
}

/// Places ordered by the ranks of a pair of words.
#[derive(Clone, Debug, Default)]
struct PairList {
    places: Vec<u32>,
    /// For each place, the classes of the level-0 words before and behind the pair.
    contexts: Vec<[u8; 2]>,
    /// For each pair of ranks that occurs, the second rank and where its places begin; ordered.
    pairs: Vec<(u16, u32)>,
    /// For each first rank, where its pairs begin; one entry more at the end.
    first_ranks: Vec<u32>,
}

impl OccurrenceIndex {
    /// Indexes the texts of a site's runs, in their order.
    pub fn build(runs: &[Lattice]) -> Self {
        let stored: Vec<Vec<u8>> = runs.iter().map(store_words).collect();
        // Texts that are lattices are stored as words that load.
        Self::from_stored(stored.iter().map(Vec::as_slice)).unwrap_or_default()
    }

    /// Indexes runs from their stored words ([`store_words`]); `None` if some bytes are no words or there are more
    /// than 2³² of them. Linear in the number of words.
    pub fn from_stored<'a>(runs: impl IntoIterator<Item = &'a [u8]>) -> Option<Self> {
        let mut index = Self::default();
        for run in runs {
            index.run_starts.push(u32::try_from(index.words.len()).ok()?);
            load_words(run, &mut index.words)?;
        }
        u32::try_from(index.words.len()).ok()?;
        for block in index.words.chunks(BLOCK_WORDS) {
            let last = index.nodes_before_block.last().copied().unwrap_or(0);
            let num_nodes = block.iter().filter(|word| word.is_node()).count() as u32;
            if index.nodes_before_block.is_empty() {
                index.nodes_before_block.push(0);
            }
            index.nodes_before_block.push(last + num_nodes);
        }
        index.max_level = index.words.iter().map(PackedWord::level).max().unwrap_or(0);
        index.rank_codes();
        let num_bits = index.codes.len().max(1).ilog2() + 1;
        index.num_key_words = (64 / num_bits as usize).min(8);
        index.plain = index.plain_list(num_bits);
        index.fused = index.fused_list(num_bits);
        Some(index)
    }

    /// Number of words of all levels.
    pub fn num_words(&self) -> usize {
        self.words.len()
    }

    /// Bytes in memory.
    pub fn num_bytes(&self) -> usize {
        let lists = [&self.plain, &self.fused].map(|list| {
            6 * list.places.capacity() + 4 * list.first_ranks.capacity() + 8 * list.pairs.capacity()
        });
        size_of::<PackedWord>() * self.words.capacity()
            + lists.iter().sum::<usize>()
            + 4 * (self.run_starts.capacity() + self.nodes_before_block.capacity())
            + 2 * self.codes.capacity()
    }

    /// Where a sequence of level-0 words occurs word for word: same classes, sizes and turns. Ordered by place.
    ///
    /// Costs a binary search among the places of its first two words, then its occurrences.
    pub fn find_exact(&self, sequence: &[Syllables]) -> Vec<Interval> {
        let mut positions: Vec<u32> = self.candidates_of(sequence).to_vec();
        positions.retain(|&position| self.reads(position as usize, sequence));
        positions.sort_unstable();
        positions.into_iter().map(|position| self.interval_from(position as usize, sequence.len())).collect()
    }

    /// The places whose words have the same codes as the sequence, as far as places are ordered.
    fn candidates_of(&self, sequence: &[Syllables]) -> &[u32] {
        let ranks: Option<Vec<u16>> = (sequence.iter())
            .map(|word| self.codes.binary_search(&word.code()?).ok().map(|rank| rank as u16))
            .collect();
        let Some(ranks) = ranks else { return &[] };
        let Some(&first) = ranks.first() else { return &[] };
        let mut places = match ranks.get(1) {
            Some(&second) => self.plain.of_pairs(first, second..second + 1).places,
            None => self.plain.of_first(first).places,
        };
        for depth in 2..ranks.len().min(self.num_key_words) {
            let rank_there =
                |position: u32| self.nodes_from(position as usize).nth(depth).map(|word| word.rank);
            let start = places.partition_point(|&position| rank_there(position) < Some(ranks[depth]));
            let end = places.partition_point(|&position| rank_there(position) <= Some(ranks[depth]));
            places = &places[start..end];
        }
        places
    }

    fn reads(&self, position: usize, sequence: &[Syllables]) -> bool {
        let mut nodes = self.nodes_from(position);
        sequence.iter().all(|word| nodes.next().is_some_and(|there| there.syllables() == *word))
    }

    /// The level-0 words of a run from one of them on.
    fn nodes_from(&self, position: usize) -> impl Iterator<Item = &PackedWord> {
        self.words[position..]
            .iter()
            .enumerate()
            .take_while(|(offset, word)| *offset == 0 || !word.is_first_of_run())
            .map(|(_, word)| word)
            .filter(|word| word.is_node())
    }

    fn interval_from(&self, position: usize, num_nodes: usize) -> Interval {
        let last = self.nodes_from(position).take(num_nodes).last().unwrap_or(&self.words[position]);
        self.interval(position, last.last_observation())
    }

    /// The stretch from the word at a position to an observation.
    pub(super) fn interval(&self, position: usize, last: u32) -> Interval {
        let run = self.run_starts.partition_point(|&start| start as usize <= position) - 1;
        Interval { run_idx: run as u32, first: self.words[position].first_observation, last }
    }

    /// Positions of the words of a run.
    pub(super) fn run_range(&self, run_idx: usize) -> Option<std::ops::Range<usize>> {
        let start = *self.run_starts.get(run_idx)? as usize;
        Some(start..self.run_starts.get(run_idx + 1).map_or(self.words.len(), |&end| end as usize))
    }

    /// Level-0 words before a position, over all runs.
    pub(super) fn num_nodes_before(&self, position: usize) -> usize {
        let block = position / BLOCK_WORDS;
        let counted = self.nodes_before_block.get(block).map_or(0, |&count| count as usize);
        let rest = &self.words[block * BLOCK_WORDS..position];
        counted + rest.iter().filter(|word| word.is_node()).count()
    }

    /// The highest level that a word has.
    pub(super) fn max_level(&self) -> usize {
        self.max_level
    }

    /// Codes that occur, by rank.
    pub(super) fn codes(&self) -> &[u16] {
        &self.codes
    }

    /// Level-0 words, as positions, that are followed by another so that the pair has these ranks.
    pub(super) fn plain_pairs(&self, first: u16, second: std::ops::Range<u16>) -> Places<'_> {
        self.plain.of_pairs(first, second)
    }

    /// Boundaries, as the positions of the level-0 words behind them, that are crossed by a pair with these ranks.
    pub(super) fn fused_pairs(&self, first: u16, second: std::ops::Range<u16>) -> Places<'_> {
        self.fused.of_pairs(first, second)
    }

    fn rank_codes(&mut self) {
        let mut occurs = vec![false; 1 << 16];
        for word in &mut self.words {
            word.rank = word.code();
            occurs[usize::from(word.rank)] = true;
        }
        self.codes = (0..=u16::MAX).filter(|&code| occurs[usize::from(code)]).collect();
        let mut ranks = vec![0u16; 1 << 16];
        for (rank, &code) in self.codes.iter().enumerate() {
            ranks[usize::from(code)] = rank as u16;
        }
        self.words.iter_mut().for_each(|word| word.rank = ranks[usize::from(word.rank)]);
    }

    /// Every level-0 word by its key: the ranks, plus one, of the words from there on; 0 behind the end of a run.
    fn plain_list(&self, num_bits: u32) -> PairList {
        let num_nodes = self.words.iter().filter(|word| word.is_node()).count();
        let mut keyed: Vec<Keyed> = Vec::with_capacity(num_nodes);
        let top = num_bits * (self.num_key_words as u32 - 1);
        let mut key = 0u64;
        // Classes of the two level-0 words behind the one that is visited.
        let mut behind = [NO_CLASS; 2];
        for (position, word) in self.words.iter().enumerate().rev().filter(|(_, word)| word.is_node()) {
            let class = word.class & 63;
            if behind[0] != NO_CLASS
                && let Some(next) = keyed.last_mut()
            {
                next.context[0] = class;
            }
            key = (u64::from(word.rank) + 1) << top | key >> num_bits;
            keyed.push(Keyed { key, place: position as u32, context: [NO_CLASS, behind[1]] });
            behind = [class, behind[0]];
            if word.is_first_of_run() {
                (key, behind) = (0, [NO_CLASS; 2]);
            }
        }
        sort_by_key(&mut keyed, num_bits * self.num_key_words as u32);
        let shift = top - num_bits.min(top);
        PairList::from_sorted(
            &keyed,
            self.codes.len(),
            |key| (key >> shift >> num_bits, key >> shift),
            num_bits,
        )
    }

    /// Every boundary by the pairs of words across it of which not both are level-0 words.
    fn fused_list(&self, num_bits: u32) -> PairList {
        let mut keyed = Vec::new();
        for (position, word) in self.words.iter().enumerate() {
            let boundary = if word.is_node() { Some(position) } else { self.start_of(position) };
            let Some(boundary) = boundary else { continue };
            let Some(group) = self.group_before(boundary) else { continue };
            let class_behind =
                || self.next_node(position).map_or(NO_CLASS, |next| self.words[next].class & 63);
            for before in group {
                if self.words[before].is_node() && word.is_node() {
                    continue;
                }
                let class_before = (self.start_of(before).and_then(|start| self.group_before(start)))
                    .map_or(NO_CLASS, |group| self.words[group.start].class & 63);
                let key = (u64::from(self.words[before].rank) + 1) << num_bits | (u64::from(word.rank) + 1);
                keyed.push(Keyed { key, place: boundary as u32, context: [class_before, class_behind()] });
            }
        }
        sort_by_key(&mut keyed, 2 * num_bits);
        PairList::from_sorted(&keyed, self.codes.len(), |key| (key >> num_bits, key), num_bits)
    }

    /// Position of the level-0 word with which the word at a position begins.
    pub(super) fn start_of(&self, position: usize) -> Option<usize> {
        let mut remaining = super::num_nodes_covered(self.words[position].level());
        for (before, word) in self.words[..=position].iter().enumerate().rev() {
            if word.is_node() {
                remaining -= 1;
                if remaining == 0 {
                    return Some(before);
                }
            }
            if word.is_first_of_run() {
                return None;
            }
        }
        None
    }

    /// The words that end directly before the level-0 word at a position, as positions.
    pub(super) fn group_before(&self, position: usize) -> Option<std::ops::Range<usize>> {
        if self.words.get(position)?.is_first_of_run() {
            return None;
        }
        let start = self.words[..position].iter().rposition(PackedWord::is_node)?;
        Some(start..position)
    }

    /// Position of the level-0 word after the one at a position, within the run.
    pub(super) fn next_node(&self, position: usize) -> Option<usize> {
        let offset = self.words[position + 1..].iter().position(PackedWord::is_node)?;
        let next = position + 1 + offset;
        (!self.words[next].is_first_of_run()).then_some(next)
    }
}

impl PairList {
    /// Groups places that are sorted by key; `ranks_plus_one` gives a key's pair in its lowest `num_bits` bits.
    fn from_sorted(
        sorted: &[Keyed],
        num_codes: usize,
        ranks_plus_one: impl Fn(u64) -> (u64, u64),
        num_bits: u32,
    ) -> Self {
        let mask = (1u64 << num_bits) - 1;
        let mut list = Self {
            places: sorted.iter().map(|keyed| keyed.place).collect(),
            contexts: sorted.iter().map(|keyed| keyed.context).collect(),
            ..Self::default()
        };
        list.first_ranks.push(0);
        let mut last = None;
        for (place, &Keyed { key, .. }) in sorted.iter().enumerate() {
            let (first, second) = ranks_plus_one(key);
            let pair = ((first & mask) as usize, (second & mask) as u16);
            if last == Some(pair) {
                continue;
            }
            last = Some(pair);
            // A first rank r has key r + 1; all ranks up to it begin here at the latest.
            while list.first_ranks.len() < pair.0 {
                list.first_ranks.push(list.pairs.len() as u32);
            }
            list.pairs.push((pair.1, place as u32));
        }
        list.first_ranks.resize(num_codes + 1, list.pairs.len() as u32);
        list
    }

    fn pairs_of(&self, first: u16) -> std::ops::Range<usize> {
        let first = usize::from(first);
        match self.first_ranks.get(first..first + 2) {
            Some(&[start, end]) => start as usize..end as usize,
            _ => 0..0,
        }
    }

    fn places_of(&self, pairs: std::ops::Range<usize>) -> Places<'_> {
        let place_of = |pair: usize| self.pairs.get(pair).map_or(self.places.len(), |pair| pair.1 as usize);
        let range = place_of(pairs.start)..place_of(pairs.end);
        Places { places: &self.places[range.clone()], contexts: &self.contexts[range] }
    }

    /// Places by first rank alone.
    fn of_first(&self, first: u16) -> Places<'_> {
        self.places_of(self.pairs_of(first))
    }

    /// Places by first rank and a range of second ranks.
    fn of_pairs(&self, first: u16, second: std::ops::Range<u16>) -> Places<'_> {
        let range = self.pairs_of(first);
        let pairs = &self.pairs[range.clone()];
        // Second ranks are kept plus one.
        let start = range.start + pairs.partition_point(|pair| pair.0 < second.start + 1);
        let end = range.start + pairs.partition_point(|pair| pair.0 < second.end + 1);
        self.places_of(start..end.max(start))
    }
}
