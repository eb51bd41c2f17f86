//! The text of a run, word by word: regions of one class (Algorithm 4.2), words (Algorithm 4.3) and levels
//! (Algorithm 5.2).
//!
//! A pure state machine: the same observations, partition and config always give the same words, so that a text can
//! be written again from stored observations. It remembers only the regions that a future word may still fuse.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::{Observation, Quantizer, TextConfig, Word, WordId};
use crate::geometry::{Point2, wrap_angle};

/// Two positions nearer than this have no direction, metres.
const SAME_PLACE_M: f64 = 1e-6;

/// Writes the text of one run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TextBuilder {
    config: TextConfig,
    quantizer: Quantizer,
    /// The region being observed.
    open: Option<Region>,
    /// The latest words of level 0, oldest first; as many as the highest level fuses.
    latest: VecDeque<Word>,
    /// Words written so far, by level.
    num_words: Vec<u32>,
    /// Positions of all observations since the oldest of `latest` began.
    positions: VecDeque<Point2>,
    /// Number of the observation whose position stands first.
    first_position: u32,
    num_observations: u32,
}

/// Consecutive observations of one class (R of Algorithm 4.2).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Region {
    class: u8,
    first: u32,
    num_observations: u32,
}

impl TextBuilder {
    /// An empty text. The config must have passed its check.
    pub fn new(quantizer: Quantizer, config: &TextConfig) -> Self {
        Self {
            config: config.clone(),
            quantizer,
            open: None,
            latest: VecDeque::new(),
            num_words: vec![0; usize::from(config.num_levels) + 1],
            positions: VecDeque::new(),
            first_position: 0,
            num_observations: 0,
        }
    }

    /// The partition that this text is written with.
    pub fn quantizer(&self) -> &Quantizer {
        &self.quantizer
    }

    /// Number of observations read.
    pub fn num_observations(&self) -> u32 {
        self.num_observations
    }

    /// Reads the next observation; returns the words it completes, predecessors before successors.
    pub fn push(&mut self, observation: &Observation) -> Vec<Word> {
        let density = observation.densities.first().copied().unwrap_or(0.0);
        let class = self.quantizer.class_of(density);
        let words = match &mut self.open {
            Some(region) if region.goes_on_with(class, &self.config) => {
                region.num_observations += 1;
                Vec::new()
            }
            open => {
                // The breaking observation is the first of the next region (SPEC 3.6).
                let next = Region { class, first: self.num_observations, num_observations: 1 };
                open.replace(next).map_or_else(Vec::new, |closed| self.write(closed))
            }
        };
        self.positions.push_back(observation.run_from_robot.position());
        self.num_observations += 1;
        words
    }

    /// Ends the run; returns the last words. A last region too short to be one is left out.
    pub fn finish(&mut self) -> Vec<Word> {
        let open =
            self.open.take().filter(|region| region.num_observations > self.config.min_region_observations);
        open.map_or_else(Vec::new, |closed| self.write(closed))
    }

    /// Ends the text as [`TextBuilder::finish`] does, and goes on with words that follow none of those before.
    pub fn cut(&mut self) -> Vec<Word> {
        let words = self.finish();
        self.latest.clear();
        self.positions.clear();
        self.first_position = self.num_observations;
        words
    }

    /// Algorithm 5.2: the alternative words that end at the last word, then the new word with its predecessors.
    fn write(&mut self, region: Region) -> Vec<Word> {
        let mut words = self.alternatives();
        let mut predecessors: Vec<WordId> = self.latest.back().map(|last| last.id).into_iter().collect();
        predecessors.extend(words.iter().map(|word| word.id));
        let last = region.first + region.num_observations - 1;
        let word = self.build_word(0, region.class, (region.first, last), predecessors);
        self.latest.push_back(word.clone());
        self.forget_old();
        words.push(word);
        words
    }

    fn alternatives(&mut self) -> Vec<Word> {
        let mut words = Vec::new();
        for level in 1..=self.config.num_levels {
            let Some(first_idx) = self.latest.len().checked_sub(usize::from(level) + 2) else { break };
            let (first, last) = (&self.latest[first_idx], &self.latest[self.latest.len() - 1]);
            if first.class == last.class {
                let observations = (first.observations.0, last.observations.1);
                let (class, predecessors) = (first.class, first.predecessors.clone());
                words.push(self.build_word(level, class, observations, predecessors));
            }
        }
        words
    }

    /// Algorithms 4.3 and 5.1.
    fn build_word(
        &mut self,
        level: u8,
        class: u8,
        observations: (u32, u32),
        predecessors: Vec<WordId>,
    ) -> Word {
        let count = &mut self.num_words[usize::from(level)];
        let id = WordId { level, index: *count };
        *count += 1;
        let (first, last) = observations;
        let turn_rad = self.turn(first, first + (last - first) / 2, last);
        Word { id, class, size: last - first + 1, turn_rad, observations, predecessors }
    }

    /// heading(median → last) − heading(first → median), in (−π, π].
    fn turn(&self, first: u32, median: u32, last: u32) -> f32 {
        let position = |index: u32| self.positions[(index - self.first_position) as usize];
        match (heading(position(first), position(median)), heading(position(median), position(last))) {
            (Some(before), Some(after)) => wrap_turn(wrap_angle(after - before) as f32),
            _ => 0.0,
        }
    }

    /// Drops words that no level reaches any more, and positions before them.
    fn forget_old(&mut self) {
        while self.latest.len() > usize::from(self.config.num_levels) + 2 {
            self.latest.pop_front();
        }
        let keep_from = self.latest.front().map_or(self.num_observations, |word| word.observations.0);
        self.positions.drain(..(keep_from - self.first_position) as usize);
        self.first_position = keep_from;
    }
}

impl Region {
    /// Algorithm 4.2, line 6: the class is unchanged, or the region is too short to end.
    fn goes_on_with(&self, class: u8, config: &TextConfig) -> bool {
        (class == self.class && self.num_observations < config.max_region_observations)
            || self.num_observations <= config.min_region_observations
    }
}

fn heading(from: Point2, to: Point2) -> Option<f64> {
    (from.distance(&to) > SAME_PLACE_M).then(|| (to.y - from.y).atan2(to.x - from.x))
}

/// Rounding to single precision may step over ±π by a hair.
fn wrap_turn(turn_rad: f32) -> f32 {
    const PI: f32 = std::f32::consts::PI;
    if turn_rad <= -PI { PI } else { turn_rad.min(PI) }
}

/// The text read backwards, as a robot that drives the opposite way would write it (SPEC section 4).
///
/// Words stand in reverse order with negated turns, and successors become predecessors. Ids and observations stay
/// those of the run, so that a match with the reversed text tells at once where it lies.
pub fn reversed_text(words: &[Word]) -> Vec<Word> {
    let mut reversed: Vec<Word> = words
        .iter()
        .rev()
        .map(|word| Word { turn_rad: wrap_turn(-word.turn_rad), predecessors: Vec::new(), ..word.clone() })
        .collect();
    let place_of: std::collections::HashMap<WordId, usize> =
        reversed.iter().enumerate().map(|(place, word)| (word.id, place)).collect();
    for word in words {
        for predecessor in &word.predecessors {
            if let Some(&place) = place_of.get(predecessor) {
                reversed[place].predecessors.push(word.id);
            }
        }
    }
    // Backwards a word follows what ends last, so later words stand first.
    reversed
        .sort_by_key(|word| (std::cmp::Reverse(word.observations.1), std::cmp::Reverse(word.observations.0)));
    reversed
}
