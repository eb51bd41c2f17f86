//! The occurrence index against an exhaustive scan of the same texts.

#![cfg(test)]

use std::collections::BTreeMap;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::text::{Interval, Word, WordId};

/// A random text with all alternatives of Algorithm 5.2 up to a level; words are few enough to occur often.
fn random_text(rng: &mut ChaCha8Rng, num_words: usize, max_level: usize) -> Vec<Word> {
    let mut words: Vec<Word> = Vec::new();
    let mut first = 0;
    for index in 0..num_words as u32 {
        let previous = words.last().map(|word: &Word| word.class);
        let mut class = rng.random_range(0..3);
        if Some(class) == previous {
            class = (class + 1) % 3;
        }
        let size = [4, 5, 9, 12][rng.random_range(0..4usize)];
        let turn_deg = [0.0, 0.0, 20.0, -25.0, 90.0, 175.0, -175.0f32][rng.random_range(0..7usize)];
        let observations = (first, first + size - 1);
        let id = WordId { level: 0, index };
        words.push(Word {
            id,
            class,
            size,
            turn_rad: turn_deg.to_radians(),
            observations,
            predecessors: vec![],
        });
        first += size;
    }
    for level in 1..=max_level {
        let mut index = 0;
        for start in 0..(num_words + 1).saturating_sub(num_nodes_covered(level)) {
            let last = start + num_nodes_covered(level) - 1;
            if words[start].class != words[last].class || rng.random_bool(0.2) {
                continue;
            }
            let observations = (words[start].observations.0, words[last].observations.1);
            let word = Word {
                id: WordId { level: level as u8, index },
                class: words[start].class,
                size: observations.1 - observations.0 + 1,
                turn_rad: words[start].turn_rad,
                observations,
                predecessors: vec![],
            };
            words.push(word);
            index += 1;
        }
    }
    words
}

/// A question as its words: first node, node after the last, and a predicate.
type Question<'a> = Vec<(usize, usize, Box<dyn Fn(&Word) -> bool + 'a>)>;

/// Every stretch that matches a question, by reading it from every word of the text on.
fn scan(texts: &[Vec<Word>], question: &Question, num_nodes: usize, min_words: u16) -> Vec<TextMatch> {
    let mut found: BTreeMap<Interval, u16> = BTreeMap::new();
    for (run_idx, words) in texts.iter().enumerate() {
        for first in words.iter().filter(|word| word.id.level == 0).map(|word| word.observations.0) {
            // (node of the question, observation at which the text goes on) -> most words so far
            let mut states: BTreeMap<(usize, u32), u16> = BTreeMap::from([((0, first), 0)]);
            while let Some(((node, at), num_words)) = states.pop_first() {
                if node == num_nodes {
                    let interval = Interval { run_idx: run_idx as u32, first, last: at - 1 };
                    found
                        .entry(interval)
                        .and_modify(|most| *most = num_words.max(*most))
                        .or_insert(num_words);
                    continue;
                }
                for (_, end, accepts) in question.iter().filter(|word| word.0 == node) {
                    for word in words.iter().filter(|word| word.observations.0 == at && accepts(word)) {
                        let state = states.entry((*end, word.observations.1 + 1)).or_insert(0);
                        *state = (num_words + 1).max(*state);
                    }
                }
            }
        }
    }
    found.retain(|_, num_words| *num_words >= min_words);
    found.into_iter().map(|(stretch, num_words)| TextMatch { stretch, num_words }).collect()
}

fn question_of<'a>(words: &'a [Word], nodes: std::ops::Range<usize>, is_reversed: bool) -> Question<'a> {
    let level0: Vec<&Word> = words.iter().filter(|word| word.id.level == 0).collect();
    let (first, last) = (level0[nodes.start].observations.0, level0[nodes.end - 1].observations.1);
    let node_of = |observation: u32| level0.iter().position(|word| word.observations.0 == observation);
    let inside = words.iter().filter(move |word| word.observations.0 >= first && word.observations.1 <= last);
    inside
        .map(|word| {
            let start = node_of(word.observations.0).unwrap() - nodes.start;
            let end = start + num_nodes_covered(usize::from(word.id.level));
            let mut read = word.clone();
            if is_reversed {
                read.turn_rad = -read.turn_rad;
            }
            let accepts: Box<dyn Fn(&Word) -> bool> =
                Box::new(move |other| WordTolerance::default().matches(&read, other));
            if is_reversed {
                (nodes.len() - end, nodes.len() - start, accepts)
            } else {
                (start, end, accepts)
            }
        })
        .collect()
}

fn site(rng: &mut ChaCha8Rng, max_level: usize) -> (Vec<Vec<Word>>, OccurrenceIndex) {
    let texts: Vec<Vec<Word>> = [60, 0, 1, 45, 30].map(|length| random_text(rng, length, max_level)).to_vec();
    let lattices: Vec<Lattice> = texts.iter().map(|text| Lattice::from_words(text).unwrap()).collect();
    (texts, OccurrenceIndex::build(&lattices))
}

#[test]
fn tolerant_questions_find_what_a_scan_finds() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut num_found = 0;
    for max_level in [0, 1, 2, 3] {
        for _ in 0..16 {
            let (texts, index) = site(&mut rng, max_level);
            for length in 1..=6 {
                let start = rng.random_range(0..40usize);
                let asked = start..start + length;
                let lattice = Lattice::from_words(&texts[0]).unwrap();
                let query = TextQuery::from_text(&lattice, asked.clone(), &WordTolerance::default());
                for (query, is_reversed) in [(query.reversed(), true), (query, false)] {
                    let question = question_of(&texts[0], asked.clone(), is_reversed);
                    for min_words in [1, 2, 3] {
                        let expected = scan(&texts, &question, length, min_words);
                        let found = index.find(&query, min_words);
                        num_found += found.len();
                        assert_eq!(
                            found, expected,
                            "{length} words, level {max_level}, reversed {is_reversed}"
                        );
                    }
                }
            }
        }
    }
    assert!(num_found > 2000, "{num_found} matches test little");
}

#[test]
fn exact_questions_find_what_a_scan_finds() {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    for max_level in [0, 2] {
        let (texts, index) = site(&mut rng, max_level);
        for (run_idx, length) in [(0, 1), (0, 2), (0, 3), (3, 4), (4, 12)] {
            let level0 = |run: usize| texts[run].iter().filter(|word| word.id.level == 0).collect::<Vec<_>>();
            let asked: Vec<Syllables> =
                level0(run_idx)[7..7 + length].iter().map(|word| Syllables::of(word)).collect();
            let mut expected = Vec::new();
            for run in 0..texts.len() {
                for words in level0(run).windows(length) {
                    if words.iter().map(|word| Syllables::of(word)).eq(asked.iter().copied()) {
                        let (first, last) = (words[0].observations.0, words[length - 1].observations.1);
                        expected.push(Interval { run_idx: run as u32, first, last });
                    }
                }
            }
            assert!(!expected.is_empty());
            assert_eq!(index.find_exact(&asked), expected);
        }
        let unknown = Syllables { class: 9, size: 4, turn: 0 };
        assert!(index.find_exact(&[unknown]).is_empty() && index.find_exact(&[]).is_empty());
    }
}

#[test]
fn patterns_find_what_a_scan_finds() {
    let mut rng = ChaCha8Rng::seed_from_u64(13);
    let mut num_found = 0;
    for _ in 0..40 {
        let (texts, index) = site(&mut rng, 2);
        let turns_deg = [(-180.0, 180.0), (-20.0, 20.0), (60.0, 120.0), (170.0, 190.0)];
        let pattern: Vec<WordConstraint> = (0..rng.random_range(1..5))
            .map(|_| {
                let (from, to) = turns_deg[rng.random_range(0..4usize)];
                let class = [(0, 255), (1, 1), (0, 1), (2, 70)][rng.random_range(0..4usize)];
                let size = [(0, u32::MAX), (5, 9), (10, 100)][rng.random_range(0..3usize)];
                WordConstraint { class, size, turn_rad: (f64::to_radians(from), f64::to_radians(to)) }
            })
            .collect();
        let accepts = |constraint: WordConstraint| -> Box<dyn Fn(&Word) -> bool> {
            Box::new(move |word: &Word| {
                let from = constraint.turn_rad.0;
                let along = (f64::from(word.turn_rad) - from).rem_euclid(std::f64::consts::TAU);
                (constraint.class.0..=constraint.class.1).contains(&word.class)
                    && (constraint.size.0..=constraint.size.1).contains(&word.size)
                    && along <= constraint.turn_rad.1 - from
            })
        };
        let question: Question = (pattern.iter().enumerate())
            .map(|(node, constraint)| (node, node + 1, accepts(*constraint)))
            .collect();
        let query = TextQuery::from_pattern(&pattern).unwrap();
        let found = index.find(&query, 1);
        num_found += found.len();
        assert_eq!(found, scan(&texts, &question, pattern.len(), 1), "{pattern:?}");
    }
    assert!(num_found > 100, "{num_found} matches test little");
}

#[test]
fn what_was_found_is_read_word_by_word() {
    let mut rng = ChaCha8Rng::seed_from_u64(14);
    // More words than a block of the table of level-0 words.
    let texts = [random_text(&mut rng, 700, 2), random_text(&mut rng, 300, 2)];
    let lattices = texts.clone().map(|text| Lattice::from_words(&text).unwrap());
    let index = OccurrenceIndex::build(&lattices);
    for (run_idx, (text, lattice)) in texts.iter().zip(&lattices).enumerate() {
        assert_eq!(index.stored_run(run_idx), store_words(lattice));
        let level0: Vec<&Word> = text.iter().filter(|word| word.id.level == 0).collect();
        for first_node in [0, 1, 17, 250] {
            let nodes = &level0[first_node..first_node + 9];
            let (first, last) = (nodes[0].observations.0, nodes[8].observations.1);
            let reading = index.read(&Interval { run_idx: run_idx as u32, first, last }).unwrap();
            assert_eq!((reading.first_node as usize, reading.num_nodes), (first_node, 9));
            let inside: Vec<&Word> = text
                .iter()
                .filter(|word| word.observations.0 >= first && word.observations.1 <= last)
                .collect();
            assert_eq!(reading.words.len(), inside.len());
            for word in &reading.words {
                let observations = (nodes[word.start].observations.0, nodes[word.end - 1].observations.1);
                let same = inside.iter().find(|other| other.observations == observations).unwrap();
                assert_eq!(word.syllables, Syllables::of(same));
            }
        }
    }
    assert!(index.read(&Interval { run_idx: 2, first: 0, last: 1 }).is_none());
    assert!(index.stored_run(2).is_empty());
}

#[test]
fn a_question_that_fits_everywhere_stops_early() {
    let mut rng = ChaCha8Rng::seed_from_u64(15);
    let (_, index) = site(&mut rng, 2);
    for length in [1, 2] {
        let query = TextQuery::from_pattern(&vec![WordConstraint::ANY; length]).unwrap();
        let all = index.find(&query, 1);
        let some = index.find_at_most(&query, 1, 10);
        assert!((10..25).contains(&some.len()) && all.len() > 100);
        assert!(some.iter().all(|found| all.contains(found)));
    }
}

#[test]
fn patterns_that_say_nothing_are_refused() {
    assert_eq!(TextQuery::from_pattern(&[]).unwrap_err().field, "pattern");
    let empty = WordConstraint { size: (5, 4), ..WordConstraint::ANY };
    assert_eq!(TextQuery::from_pattern(&[WordConstraint::ANY, empty]).unwrap_err().field, "pattern[1].size");
}

#[test]
fn an_index_of_nothing_answers_nothing() {
    let index = OccurrenceIndex::build(&[]);
    let query = TextQuery::from_pattern(&[WordConstraint::ANY; 2]).unwrap();
    assert!(index.find(&query, 1).is_empty());
    assert_eq!(index.num_words(), 0);
    assert!(OccurrenceIndex::from_stored([&[1u8, 2, 3][..]]).is_none());
}
