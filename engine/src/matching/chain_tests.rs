//! Chains against the worked figures of the thesis and against the enumeration of every path.

#![cfg(test)]

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Chain, ChainFinder, MatchingConfig, Relation, find_chains, find_chains_in};
use crate::index::{Lattice, WordTolerance, num_nodes_covered};
use crate::text::{Direction, Word, WordId};

fn golden(name: &str) -> Option<serde_json::Value> {
    let folder = std::env::var("LOCUTION_GOLDEN")
        .map(PathBuf::from)
        .unwrap_or_else(|_| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/golden")));
    let Ok(text) = std::fs::read_to_string(folder.join(name)) else {
        println!("skipped: {name} is not there");
        return None;
    };
    Some(serde_json::from_str(&text).unwrap())
}

/// A text in which every word stands for a type: the class is the type, the other syllables are alike.
fn text_of_types(level0: &[u8], alternatives: &[(u8, u32, (u32, u32), u8)]) -> Vec<Word> {
    let word = |level, index, (first, last): (u32, u32), class| Word {
        id: WordId { level, index },
        class,
        size: 10,
        turn_rad: 0.0,
        observations: (first * 10, last * 10 + 9),
        predecessors: vec![],
    };
    let plain = level0.iter().enumerate().map(|(index, &class)| {
        let index = index as u32;
        word(0, index, (index, index), class)
    });
    let fused = alternatives.iter().map(|&(level, index, span, class)| word(level, index, span, class));
    plain.chain(fused).collect()
}

fn config(min_chain_words: &[u16], min_gap_observations: u32) -> MatchingConfig {
    MatchingConfig {
        min_chain_words: min_chain_words.to_vec(),
        min_gap_observations,
        ..MatchingConfig::default()
    }
}

#[test]
fn figure_4_9_has_exactly_its_n_gram_matches() {
    let Some(figure) = golden("figure_4_9.json") else { return };
    let names: Vec<&str> = figure["text"].as_array().unwrap().iter().map(|w| w.as_str().unwrap()).collect();
    let class_of = |name: &str| {
        let number: u8 = name[1..].parse().unwrap();
        if name.starts_with('U') { 100 + number } else { number }
    };
    let types: Vec<u8> = names.iter().map(|name| class_of(name)).collect();
    let text = Lattice::from_words(&text_of_types(&types, &[])).unwrap();
    for (n, expected) in figure["ngrams"].as_object().unwrap() {
        let n: usize = n.parse().unwrap();
        let chains = find_chains(&text, &text, Relation::SameRun, &config(&[n as u16], 0));
        let mut pairs = BTreeSet::new();
        let mut starts: BTreeMap<Vec<&str>, BTreeSet<u64>> = BTreeMap::new();
        for chain in chains.iter().filter(|chain| chain.direction == Direction::Same) {
            for gram in chain.pairs.windows(n) {
                let (earlier, later) = (gram[0].0.index as usize, gram[0].1.index as usize);
                pairs.insert((earlier, later));
                let places = starts.entry(names[later..later + n].to_vec()).or_default();
                places.extend([earlier as u64 + 1, later as u64 + 1]);
            }
        }
        assert_eq!(pairs.len() as u64, expected["pairs"], "{n}-grams");
        assert_eq!(starts.len() as u64, expected["types"], "types of {n}-grams");
        for one in expected["matches"].as_array().unwrap() {
            let gram: Vec<&str> =
                one["gram"].as_array().unwrap().iter().map(|w| w.as_str().unwrap()).collect();
            let places: Vec<u64> = starts[&gram].iter().copied().collect();
            assert_eq!(serde_json::json!(places), one["starts"], "{gram:?}");
        }
    }
}

#[test]
fn figure_5_3_has_its_match_through_an_alternative_word() {
    let Some(figure) = golden("figure_5_3.json") else { return };
    let type_of = |value: &serde_json::Value| value["type"].as_str().unwrap().as_bytes()[0];
    let level0: Vec<u8> = figure["level0"].as_array().unwrap().iter().map(type_of).collect();
    let number = |value: &serde_json::Value| value.as_u64().unwrap() as u32;
    let alternatives: Vec<_> = (figure["alternatives"].as_array().unwrap().iter())
        .map(|word| {
            let span = (number(&word["covers_level0"][0]), number(&word["covers_level0"][1]));
            (number(&word["name"][1]) as u8, number(&word["name"][0]), span, type_of(word))
        })
        .collect();
    let text = Lattice::from_words(&text_of_types(&level0, &alternatives)).unwrap();
    let id = |value: &serde_json::Value| WordId { index: number(&value[0]), level: number(&value[1]) as u8 };
    let query = id(&figure["query_word"]);
    let longest = |thresholds: &[u16]| {
        find_chains(&text, &text, Relation::SameRun, &config(thresholds, 0))
            .into_iter()
            .filter(|chain| chain.direction == Direction::Same && chain.pairs.last().unwrap().1 == query)
            .max_by_key(|chain| chain.pairs.len())
            .unwrap()
    };
    assert_eq!(longest(&[2]).pairs.len() as u64, figure["longest_match_without_alternatives"]);
    let expected: Vec<(WordId, WordId)> = (figure["longest_match"].as_array().unwrap().iter())
        .map(|pair| (id(&pair[1]), id(&pair[0])))
        .collect();
    assert_eq!(longest(&[2, 2, 2]).pairs, expected);
}

/// A random text with all the alternatives that Algorithm 5.2 builds, predecessors included.
pub(super) fn random_text(rng: &mut impl Rng, num_words: usize, num_classes: u8, max_level: u8) -> Vec<Word> {
    let mut level0: Vec<Word> = Vec::new();
    let mut alternatives: Vec<Word> = Vec::new();
    let mut first = 0;
    for index in 0..num_words as u32 {
        let previous = level0.last().map(|word| word.class);
        let class = std::iter::repeat_with(|| rng.random_range(0..num_classes))
            .find(|&class| Some(class) != previous)
            .unwrap();
        let size = [8, 9, 10, 10, 20][rng.random_range(0..5usize)];
        let turn_deg = [0.0, 0.0, 20.0, -20.0, 90.0f32][rng.random_range(0..5usize)];
        level0.push(Word {
            id: WordId { level: 0, index },
            class,
            size,
            turn_rad: turn_deg.to_radians(),
            observations: (first, first + size - 1),
            predecessors: vec![],
        });
        first += size;
    }
    let mut counts = vec![0u32; usize::from(max_level) + 1];
    for last in 0..num_words.saturating_sub(1) {
        for level in 1..=usize::from(max_level) {
            let Some(start) = (last + 1).checked_sub(num_nodes_covered(level)) else { continue };
            if level0[start].class != level0[last].class {
                continue;
            }
            let observations = (level0[start].observations.0, level0[last].observations.1);
            alternatives.push(Word {
                id: WordId { level: level as u8, index: counts[level] },
                class: level0[last].class,
                size: observations.1 - observations.0 + 1,
                turn_rad: level0[start..=last].iter().map(|word| word.turn_rad).sum::<f32>() % 3.0,
                observations,
                predecessors: vec![],
            });
            counts[level] += 1;
        }
    }
    let mut words = level0;
    words.extend(alternatives);
    let ends: Vec<(u32, WordId)> = words.iter().map(|word| (word.observations.1 + 1, word.id)).collect();
    for word in &mut words {
        let before = ends.iter().filter(|(end, _)| *end == word.observations.0);
        word.predecessors = before.map(|(_, id)| *id).collect();
    }
    words
}

/// Every chain of the reference: all paths of matching pairs, enumerated one by one as Algorithm 5.3 prints it, then
/// for each pair of ends that no pair continues the number of words of the longest.
struct Enumeration<'a> {
    earlier: Vec<&'a Word>,
    later: Vec<&'a Word>,
    direction: Direction,
    gap: Option<u32>,
    tolerance: WordTolerance,
}

impl Enumeration<'_> {
    fn is_match(&self, earlier: &Word, later: &Word) -> bool {
        let is_far = self.gap.is_none_or(|gap| earlier.observations.1 + gap < later.observations.0);
        let mut read = later.clone();
        if self.direction == Direction::Opposite {
            read.turn_rad = -read.turn_rad;
        }
        is_far && self.tolerance.matches(earlier, &read)
    }

    fn follows(&self, earlier: (&Word, &Word), later: (&Word, &Word)) -> bool {
        let is_next = |before: &Word, after: &Word| after.predecessors.contains(&before.id);
        is_next(later.0, later.1)
            && match self.direction {
                Direction::Same => is_next(earlier.0, earlier.1),
                Direction::Opposite => is_next(earlier.1, earlier.0),
            }
    }

    fn longest_path(&self, earlier: &Word, later: &Word) -> usize {
        let mut longest = 1;
        for before_earlier in &self.earlier {
            for before_later in &self.later {
                if self.follows((before_earlier, earlier), (before_later, later))
                    && self.is_match(before_earlier, before_later)
                {
                    longest = longest.max(1 + self.longest_path(before_earlier, before_later));
                }
            }
        }
        longest
    }

    fn maximal_lengths(&self) -> BTreeMap<(u32, u32), usize> {
        let mut ends: BTreeMap<(u32, u32), usize> = BTreeMap::new();
        for earlier in &self.earlier {
            for later in self.later.iter().filter(|later| self.is_match(earlier, later)) {
                let continues = self.earlier.iter().any(|after_earlier| {
                    self.later.iter().any(|after_later| {
                        self.follows((earlier, after_earlier), (later, after_later))
                            && self.is_match(after_earlier, after_later)
                    })
                });
                if !continues {
                    let key = (end_of(earlier, self.direction), later.observations.1);
                    let length = self.longest_path(earlier, later);
                    ends.entry(key).and_modify(|most| *most = length.max(*most)).or_insert(length);
                }
            }
        }
        ends
    }
}

fn end_of(earlier: &Word, direction: Direction) -> u32 {
    match direction {
        Direction::Same => earlier.observations.1,
        Direction::Opposite => earlier.observations.0,
    }
}

fn assert_is_chain(chain: &Chain, reference: &Enumeration) {
    let find = |words: &[&Word], id: WordId| words.iter().position(|word| word.id == id).unwrap();
    let words: Vec<(&Word, &Word)> = (chain.pairs.iter())
        .map(|pair| {
            (
                reference.earlier[find(&reference.earlier, pair.0)],
                reference.later[find(&reference.later, pair.1)],
            )
        })
        .collect();
    assert!(words.iter().all(|(earlier, later)| reference.is_match(earlier, later)));
    assert!(words.windows(2).all(|pair| reference.follows((pair[0].0, pair[1].0), (pair[0].1, pair[1].1))));
}

#[test]
fn the_dynamic_programme_finds_what_enumeration_finds() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut num_long = 0;
    for round in 0..60 {
        let later = random_text(&mut rng, 4 + round % 11, 2 + (round % 2) as u8, 2);
        let earlier = random_text(&mut rng, 4 + round % 13, 2 + (round % 2) as u8, 2);
        let is_same_run = round % 3 == 0;
        let earlier = if is_same_run { &later } else { &earlier };
        let (relation, gap) =
            if is_same_run { (Relation::SameRun, Some(7)) } else { (Relation::DifferentRuns, None) };
        let texts = (Lattice::from_words(earlier).unwrap(), Lattice::from_words(&later).unwrap());
        for (level, min_words) in (0..=2).flat_map(|level| (1..=4).map(move |min_words| (level, min_words))) {
            // Only one level finds anything here, so its words and its threshold alone decide.
            let mut thresholds = [1000; 3];
            thresholds[usize::from(level)] = min_words;
            let config = config(&thresholds, 7);
            let chains = find_chains(&texts.0, &texts.1, relation, &config);
            for direction in [Direction::Same, Direction::Opposite] {
                let reference = Enumeration {
                    earlier: earlier.iter().filter(|word| word.id.level <= level).collect(),
                    later: later.iter().filter(|word| word.id.level <= level).collect(),
                    direction,
                    gap,
                    tolerance: config.tolerance,
                };
                let mut expected = reference.maximal_lengths();
                expected.retain(|_, length| *length >= usize::from(min_words));
                let mut found = BTreeMap::new();
                for chain in chains.iter().filter(|chain| chain.direction == direction) {
                    assert_is_chain(chain, &reference);
                    let last = chain.pairs.last().unwrap();
                    let observations =
                        |words: &[Word], id| words.iter().find(|word| word.id == id).unwrap().clone();
                    let key = (
                        end_of(&observations(earlier, last.0), direction),
                        observations(&later, last.1).observations.1,
                    );
                    assert!(found.insert(key, chain.pairs.len()).is_none(), "two chains end at {key:?}");
                }
                num_long += found.values().filter(|&&length| length >= 3).count();
                assert_eq!(found, expected, "round {round}, {direction:?}, level {level}, {min_words} words");
            }
        }
    }
    assert!(num_long > 50, "the random texts have chains worth finding, not {num_long}");
}

#[test]
fn words_one_by_one_give_what_the_whole_text_gives() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let config = config(&[2, 3, 4], 5);
    for _ in 0..10 {
        let words = random_text(&mut rng, 40, 3, 2);
        let whole = Lattice::from_words(&words).unwrap();
        let mut text = Lattice::default();
        let mut finder = ChainFinder::new(Relation::SameRun, config.clone());
        for node in 0..whole.num_nodes() {
            let level0 = words.iter().filter(|word| word.id.level == 0).nth(node).unwrap();
            // As in Algorithm 5.2, alternatives that end at a word appear together with the word after it.
            let mut news = vec![level0.clone()];
            let is_new = |word: &&Word| word.id.level > 0 && word.observations.1 + 1 == level0.observations.0;
            news.extend(words.iter().filter(is_new).cloned());
            text.extend(&news).unwrap();
            finder.extend(&text, &text);
        }
        assert_eq!(finder.chains(&text, &text), find_chains(&whole, &whole, Relation::SameRun, &config));
    }
}

#[test]
fn texts_in_a_row_have_the_chains_of_each() {
    let mut rng = ChaCha8Rng::seed_from_u64(10);
    let config = config(&[2, 3, 4], 5);
    let mut num_found = 0;
    for _ in 0..10 {
        let mut text = |num_words, max_level| {
            Lattice::from_words(&random_text(&mut rng, num_words, 3, max_level)).unwrap()
        };
        let texts = [text(0, 0), text(20, 2), text(0, 0), text(5, 0), text(1, 0), text(30, 1), text(0, 0)];
        let later = text(25, 2);
        let mut expected = Vec::new();
        for (text_idx, earlier) in texts.iter().enumerate() {
            let chains = find_chains(earlier, &later, Relation::DifferentRuns, &config);
            expected.extend(chains.into_iter().map(|chain| (text_idx, chain)));
        }
        num_found += expected.len();
        assert_eq!(find_chains_in(&texts.each_ref(), &later, &config), expected);
    }
    assert!(num_found > 100, "{num_found} chains test little");
    assert!(find_chains_in(&[], &Lattice::default(), &config).is_empty());
}

#[test]
fn every_level_decides_by_its_own_threshold() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut num_found = 0;
    for round in 0..30 {
        let text = Lattice::from_words(&random_text(&mut rng, 30, 2 + (round % 2) as u8, 2)).unwrap();
        let pairs_of = |thresholds: &[u16]| -> BTreeSet<Vec<(WordId, WordId)>> {
            let chains = find_chains(&text, &text, Relation::SameRun, &config(thresholds, 7));
            chains.into_iter().map(|chain| chain.pairs).collect()
        };
        let together = pairs_of(&[2, 4, 5]);
        let apart = [pairs_of(&[2, 1000, 1000]), pairs_of(&[1000, 4, 1000]), pairs_of(&[1000, 1000, 5])];
        assert_eq!(together, apart.iter().flatten().cloned().collect(), "round {round}");
        num_found += together.len();
    }
    assert!(num_found > 100, "{num_found} chains test little");
}

#[test]
fn lower_levels_keep_their_matches() {
    // Plain words give a chain of 3; with alternatives the threshold is higher and would lose it.
    let types = [1, 2, 3, 9, 1, 2, 3];
    let text = Lattice::from_words(&text_of_types(&types, &[])).unwrap();
    let chains = find_chains(&text, &text, Relation::SameRun, &config(&[3, 10], 0));
    assert_eq!(chains.len(), 1);
    assert_eq!((chains[0].pairs.len(), chains[0].max_level), (3, 0));
}
