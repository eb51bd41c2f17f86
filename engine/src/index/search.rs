//! Tolerant questions answered from the index.
//!
//! Every way of reading a question crosses each boundary between its nodes, either between two words or inside an
//! alternative one, which is then crossed at one of its ends. So one boundary, the one with the fewest places in the
//! index, yields all places worth a look; there the question is read to both sides.

use std::collections::BTreeMap;

use super::lattice::num_nodes_covered;
use super::occurrence::{ClassSet, OccurrenceIndex, Places};
use super::packed::PackedWord;
use super::pattern::{QueryWord, TextQuery, WordBox};
use crate::text::Interval;

/// A stretch of text that matches a whole question.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TextMatch {
    /// The run and its observations, from the first matching word to the last.
    pub stretch: Interval,
    /// Most pairs of matching words among the ways to read question and stretch alike.
    pub num_words: u16,
}

/// Two words of a question, by their places in it, that cross a boundary together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Crossing {
    boundary: usize,
    before: usize,
    after: usize,
}

impl Crossing {
    /// Whether words of the question stand on both sides of the pair.
    fn is_inside(&self, query: &TextQuery) -> bool {
        query.words()[self.before].start > 0 && query.words()[self.after].end < query.num_nodes()
    }

    /// The classes that the words before and behind the pair may have.
    fn classes_around(&self, query: &TextQuery) -> [ClassSet; 2] {
        let (start, end) = (query.words()[self.before].start, query.words()[self.after].end);
        let classes = |is_there: &dyn Fn(&QueryWord) -> bool| {
            query
                .words()
                .iter()
                .filter(|word| is_there(word))
                .fold(0, |set, word| set | word.accepts.classes())
        };
        let before = if start == 0 { ClassSet::MAX } else { classes(&|word| word.end == start) };
        let behind =
            if end == query.num_nodes() { ClassSet::MAX } else { classes(&|word| word.start == end) };
        [before, behind]
    }
}

/// How much dearer a look at the words of a place is than one at the classes in the list.
const COST_OF_LOOK: usize = 8;

/// Ranks of codes as ascending ranges.
type RankRanges = Vec<std::ops::Range<u16>>;

/// Positions of the first and the last level-0 word of a stretch, with the most pairs of words.
type Stretches = BTreeMap<(u32, u32), u16>;

impl OccurrenceIndex {
    /// All stretches of text that match a question from its first node to its last with at least `min_words` pairs of
    /// words, ordered by place.
    ///
    /// Costs a look at each place of the rarest boundary; asking for single words (`min_words` below 2) scans the text
    /// where one word can answer the whole question.
    pub fn find(&self, query: &TextQuery, min_words: u16) -> Vec<TextMatch> {
        self.find_at_most(query, min_words, usize::MAX)
    }

    /// The same, but looks no further once it has found `num_max` stretches or a few more: a question that fits
    /// nearly everywhere costs no more memory than that.
    pub fn find_at_most(&self, query: &TextQuery, min_words: u16, num_max: usize) -> Vec<TextMatch> {
        let mut found = Stretches::new();
        let mut reader = Reader::new(self, query);
        for (boundary, mut places) in self.places_to_read(query) {
            places.sort_unstable();
            places.dedup();
            for &place in places.iter() {
                if found.len() >= num_max {
                    break;
                }
                reader.read_around(boundary, place as usize, &mut found);
            }
        }
        if min_words < 2 {
            self.find_single_words(query, num_max, &mut found);
        }
        found.retain(|_, num_words| *num_words >= min_words);
        (found.into_iter())
            .map(|((first, last), num_words)| {
                let last_observation = self.words[last as usize].last_observation();
                TextMatch { stretch: self.interval(first as usize, last_observation), num_words }
            })
            .collect()
    }

    /// Boundaries of the question, each with the places in the text that may match there.
    fn places_to_read(&self, query: &TextQuery) -> BTreeMap<usize, Vec<u32>> {
        let ranks: Vec<RankRanges> = query.words().iter().map(|word| self.ranks_of(&word.accepts)).collect();
        let mut counts: BTreeMap<Crossing, usize> = BTreeMap::new();
        let mut num_places = |crossing: Crossing| {
            let slices = || self.pair_slices(&ranks[crossing.before], &ranks[crossing.after]);
            *counts.entry(crossing).or_insert_with(|| slices().map(|(_, slice)| slice.len()).sum())
        };
        // A place costs a glance at the classes around it; where they cannot be told apart, it costs far more.
        let mut cost = |crossing: Crossing| {
            num_places(crossing) * if crossing.is_inside(query) { 1 } else { COST_OF_LOOK }
        };
        let rarest = (1..query.num_nodes())
            .min_by_key(|&boundary| crossings(query, boundary).into_iter().map(&mut cost).sum::<usize>());
        let mut places: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        for crossing in rarest.map(|boundary| crossings(query, boundary)).into_iter().flatten() {
            let there = places.entry(crossing.boundary).or_default();
            let accepts = [crossing.before, crossing.after].map(|word| &query.words()[word].accepts);
            let classes = crossing.classes_around(query);
            for (is_plain, slice) in self.pair_slices(&ranks[crossing.before], &ranks[crossing.after]) {
                for place in slice.within(classes) {
                    // A plain place is that of the word before the boundary.
                    let behind = if is_plain { self.next_node(place as usize) } else { Some(place as usize) };
                    let behind = behind.filter(|&behind| self.is_crossed(behind, accepts));
                    there.extend(behind.map(|behind| behind as u32));
                }
            }
        }
        places
    }

    /// Whether matching words meet at a place; codes only said that they may.
    fn is_crossed(&self, place: usize, [before, after]: [&WordBox; 2]) -> bool {
        let Some(group) = self.group_before(place) else { return false };
        if !self.words[group].iter().any(|word| before.contains(word)) {
            return false;
        }
        let mut is_match = false;
        self.for_words_from(place, |position, _| is_match |= after.contains(&self.words[position]));
        is_match
    }

    fn pair_slices<'a>(
        &'a self,
        before: &'a RankRanges,
        after: &'a RankRanges,
    ) -> impl Iterator<Item = (bool, Places<'a>)> + 'a {
        before.iter().cloned().flatten().flat_map(move |first| {
            after.iter().flat_map(move |second| {
                let plain = self.plain_pairs(first, second.clone());
                let fused = self.fused_pairs(first, second.clone());
                [(true, plain), (false, fused)]
            })
        })
    }

    /// The ranks of all codes that words of a box may have.
    fn ranks_of(&self, accepts: &WordBox) -> RankRanges {
        let mut ranges: RankRanges = Vec::new();
        for (rank, &code) in self.codes().iter().enumerate() {
            let rank = rank as u16;
            if !accepts.may_contain_code(code) {
                continue;
            }
            match ranges.last_mut() {
                Some(range) if range.end == rank => range.end += 1,
                _ => ranges.push(rank..rank + 1),
            }
        }
        ranges
    }

    /// Visits the words that begin with the level-0 word at a place: the position of each, and that of the last
    /// level-0 word it covers.
    fn for_words_from(&self, place: usize, mut visit: impl FnMut(usize, usize)) {
        visit(place, place);
        let mut node = place;
        for num_covered in 2..=num_nodes_covered(self.max_level()) {
            let Some(next) = self.next_node(node) else { return };
            node = next;
            let group = self.words[node + 1..].iter().take_while(|word| !word.is_node());
            for (offset, word) in group.enumerate() {
                if num_nodes_covered(word.level()) == num_covered {
                    visit(node + 1 + offset, node);
                }
            }
        }
    }

    /// Matches by a single word that covers the whole question.
    fn find_single_words(&self, query: &TextQuery, num_max: usize, found: &mut Stretches) {
        let is_whole = |start: usize, end: usize| start == 0 && end == query.num_nodes();
        let boxes: Vec<&WordBox> = (query.words().iter())
            .filter(|word| is_whole(word.start, word.end))
            .map(|word| &word.accepts)
            .collect();
        if boxes.is_empty() {
            return;
        }
        let mut node = 0;
        for (position, word) in self.words.iter().enumerate() {
            if found.len() >= num_max {
                break;
            }
            if word.is_node() {
                node = position;
            }
            if boxes.iter().any(|accepts| accepts.contains(word)) {
                let start = self.start_of(position).unwrap_or(position);
                found.entry((start as u32, node as u32)).or_insert(1);
            }
        }
    }
}

/// All pairs of words of which every reading with at least two words has one, chosen at a boundary.
fn crossings(query: &TextQuery, boundary: usize) -> Vec<Crossing> {
    let words = || query.words().iter().enumerate();
    let mut found = Vec::new();
    for (before, _) in words().filter(|(_, word)| word.end == boundary) {
        for (after, _) in words().filter(|(_, word)| word.start == boundary) {
            found.push(Crossing { boundary, before, after });
        }
    }
    for (spanning, word) in words().filter(|(_, word)| word.start < boundary && boundary < word.end) {
        if word.start > 0 {
            let boundary = word.start;
            let befores = words().filter(|(_, word)| word.end == boundary);
            found.extend(befores.map(|(before, _)| Crossing { boundary, before, after: spanning }));
        } else {
            let boundary = word.end;
            let afters = words().filter(|(_, word)| word.start == boundary);
            found.extend(afters.map(|(after, _)| Crossing { boundary, before: spanning, after }));
        }
    }
    found
}

/// Reads a question at places of a text, to both sides of a boundary.
struct Reader<'a> {
    index: &'a OccurrenceIndex,
    /// Words of the question by the node after their last one, with their first node.
    ending: Vec<Vec<(usize, &'a WordBox)>>,
    /// Words of the question by their first node, with the node after their last one.
    starting: Vec<Vec<(usize, &'a WordBox)>>,
    /// For each boundary of the question, the places reached there and the most words on the way.
    reached: Vec<Vec<(u32, u16)>>,
    ends: Vec<(u32, u16)>,
}

impl<'a> Reader<'a> {
    fn new(index: &'a OccurrenceIndex, query: &'a TextQuery) -> Self {
        let blank = vec![Vec::new(); query.num_nodes() + 1];
        let (mut ending, mut starting) = (blank.clone(), blank);
        for word in query.words() {
            ending[word.end].push((word.start, &word.accepts));
            starting[word.start].push((word.end, &word.accepts));
        }
        let reached = vec![Vec::new(); query.num_nodes() + 1];
        Self { index, ending, starting, reached, ends: Vec::new() }
    }

    /// Adds all stretches that match with the question's boundary at the boundary before the level-0 word at a place.
    fn read_around(&mut self, boundary: usize, place: usize, found: &mut Stretches) {
        self.read_forwards(boundary, place);
        if self.ends.is_empty() {
            return;
        }
        self.read_backwards(boundary, place);
        for &(start, words_before) in &self.reached[0] {
            for &(end, words_after) in &self.ends {
                let num_words = words_before + words_after;
                found
                    .entry((start, end))
                    .and_modify(|most| *most = num_words.max(*most))
                    .or_insert(num_words);
            }
        }
    }

    fn read_forwards(&mut self, boundary: usize, place: usize) {
        let num_nodes = self.reached.len() - 1;
        let Self { index, starting, reached, ends, .. } = self;
        let words: &[PackedWord] = &index.words;
        ends.clear();
        reached[boundary..].iter_mut().for_each(Vec::clear);
        reached[boundary].push((place as u32, 0));
        for at in boundary..num_nodes {
            let places = std::mem::take(&mut reached[at]);
            for &(place, num_words) in &places {
                index.for_words_from(place as usize, |position, last_node| {
                    for &(end, accepts) in &starting[at] {
                        if !accepts.contains(&words[position]) {
                            continue;
                        }
                        if end == num_nodes {
                            keep_most(ends, last_node, num_words + 1);
                        } else if let Some(next) = index.next_node(last_node) {
                            keep_most(&mut reached[end], next, num_words + 1);
                        }
                    }
                });
            }
            reached[at] = places;
        }
    }

    fn read_backwards(&mut self, boundary: usize, place: usize) {
        let Self { index, ending, reached, .. } = self;
        reached[..=boundary].iter_mut().for_each(Vec::clear);
        reached[boundary].push((place as u32, 0));
        for at in (1..=boundary).rev() {
            let places = std::mem::take(&mut reached[at]);
            for &(place, num_words) in &places {
                for position in index.group_before(place as usize).into_iter().flatten() {
                    let Some(start) = index.start_of(position) else { continue };
                    for &(before, accepts) in &ending[at] {
                        if accepts.contains(&index.words[position]) {
                            keep_most(&mut reached[before], start, num_words + 1);
                        }
                    }
                }
            }
            reached[at] = places;
        }
    }
}

fn keep_most(places: &mut Vec<(u32, u16)>, place: usize, num_words: u16) {
    let place = place as u32;
    match places.iter_mut().find(|known| known.0 == place) {
        Some(known) => known.1 = known.1.max(num_words),
        None => places.push((place, num_words)),
    }
}
