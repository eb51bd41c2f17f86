//! How well the words of a text fit a pattern: a few words with tolerances, driven either way.
//!
//! The index is asked with bounds that hold every word that fits; what it finds is read and fitted exactly. So the cost
//! does not grow with the text but with how often the rarest pair of the pattern's words occurs. Words of every level
//! count, so a place is found although a door was open.

use super::occurrence::OccurrenceIndex;
use super::pattern::{TextQuery, WordConstraint};
use super::reading::TextReading;
use super::tolerance::Syllables;
use crate::config_error::ConfigError;
use crate::geometry::wrap_angle;
use crate::text::{Direction, Interval};

/// Places looked at for one pattern in each direction.
const NUM_PLACES_MAX: usize = 100_000;
/// A turn in the index is rounded to 2⁻¹⁵ π; bounds are drawn wider by more than that.
const TURN_MARGIN_RAD: f64 = 2e-4;

/// One word of a pattern; what is `None` may be anything.
#[derive(Clone, Debug, Default)]
pub struct WordPattern {
    /// Density class.
    pub class: Option<u8>,
    /// Number of observations.
    pub size: Option<u32>,
    /// How far the size may be off, as a share of the larger (SPEC 3.9).
    pub size_tolerance: f64,
    /// Turn, radians.
    pub turn_rad: Option<f64>,
    /// How far the turn may be off, radians.
    pub turn_tolerance_rad: f64,
}

impl WordPattern {
    /// How well a word fits, from 0 (just) to 1 (exactly); `None` when it does not. A text read backwards turns the
    /// other way.
    fn fit(&self, word: &Syllables, direction: Direction) -> Option<f64> {
        if self.class.is_some_and(|class| u16::from(class) != word.class) {
            return None;
        }
        let mut fit = 1.0f64;
        if let Some(size) = self.size {
            let there = u32::from(word.size);
            let off = f64::from(size.abs_diff(there)) / f64::from(size.max(there).max(1));
            fit = fit.min(share_left(off, self.size_tolerance)?);
        }
        if let Some(turn_rad) = self.turn_rad {
            let driven_rad = match direction {
                Direction::Same => word.turn_rad(),
                Direction::Opposite => -word.turn_rad(),
            };
            fit = fit.min(share_left(wrap_angle(turn_rad - driven_rad).abs(), self.turn_tolerance_rad)?);
        }
        Some(fit)
    }

    /// Bounds that hold every word that fits.
    fn bounds(&self) -> WordConstraint {
        let size = self.size.map_or(WordConstraint::ANY.size, |size| {
            let (size, share) = (f64::from(size), 1.0 - self.size_tolerance);
            // Casts stop at the ends of the range.
            ((size * share) as u32, (size / share + 1.0) as u32)
        });
        let turn_rad = self.turn_rad.map_or(WordConstraint::ANY.turn_rad, |turn_rad| {
            let reach = self.turn_tolerance_rad + TURN_MARGIN_RAD;
            (turn_rad - reach, turn_rad + reach)
        });
        let class = self.class.map_or(WordConstraint::ANY.class, |class| (class, class));
        WordConstraint { class, size, turn_rad }
    }
}

fn share_left(off: f64, tolerance: f64) -> Option<f64> {
    (off <= tolerance).then(|| if tolerance > 0.0 { 1.0 - off / tolerance } else { 1.0 })
}

/// Where a pattern fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatternFit {
    /// The run, by its number in the index, with its first and last observation.
    pub stretch: Interval,
    /// Whether the text was read forwards or backwards.
    pub direction: Direction,
    /// First and last word of level 0, by number.
    pub words: (u32, u32),
    /// Mean fit of the words, from 0 to 1.
    pub fit: f64,
}

/// Words to be found one after the other.
#[derive(Clone, Debug)]
pub struct WordSequence {
    patterns: Vec<WordPattern>,
    query: TextQuery,
}

impl WordSequence {
    /// A sequence of 1 to 64 words.
    ///
    /// # Errors
    /// None or more words than 64, and turns that are not numbers.
    pub fn new(patterns: Vec<WordPattern>) -> Result<Self, ConfigError> {
        let query = TextQuery::from_pattern(&patterns.iter().map(WordPattern::bounds).collect::<Vec<_>>())?;
        Ok(Self { patterns, query })
    }

    /// The places where it fits best, best first, then by run, place and direction.
    pub fn best_fits(&self, index: &OccurrenceIndex, limit: usize) -> Vec<PatternFit> {
        let ways = [(Direction::Same, self.query.clone()), (Direction::Opposite, self.query.reversed())];
        let mut fits = Vec::new();
        for (direction, query) in ways {
            for found in index.find_at_most(&query, 1, NUM_PLACES_MAX) {
                let Some(reading) = index.read(&found.stretch) else { continue };
                let Some(fit) = self.fit_of(&reading, direction) else { continue };
                let last_node = reading.first_node + reading.num_nodes.saturating_sub(1) as u32;
                let words = (reading.first_node, last_node);
                fits.push(PatternFit { stretch: found.stretch, direction, words, fit });
            }
        }
        fits.sort_by(|a, b| {
            b.fit.total_cmp(&a.fit).then_with(|| (a.stretch, a.direction).cmp(&(b.stretch, b.direction)))
        });
        fits.truncate(limit);
        fits
    }

    /// The best mean fit among the ways to read a stretch as the pattern.
    fn fit_of(&self, reading: &TextReading, direction: Direction) -> Option<f64> {
        let patterns = &self.patterns;
        let mut sums: Vec<Option<f64>> = vec![None; reading.num_nodes + 1];
        sums[0] = Some(0.0);
        for idx in 0..patterns.len() {
            let pattern = match direction {
                Direction::Same => &patterns[idx],
                Direction::Opposite => &patterns[patterns.len() - 1 - idx],
            };
            let mut next: Vec<Option<f64>> = vec![None; sums.len()];
            for word in &reading.words {
                let sum =
                    sums[word.start].zip(pattern.fit(&word.syllables, direction)).map(|(sum, fit)| sum + fit);
                next[word.end] = next[word.end].into_iter().chain(sum).reduce(f64::max);
            }
            sums = next;
        }
        sums[reading.num_nodes].map(|sum| sum / patterns.len() as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::index::{Lattice, ReadWord, store_words};
    use crate::text::{Word, WordId};

    fn word(level: u8, index: u32, class: u8, turn_rad: f32, observations: (u32, u32)) -> Word {
        let size = observations.1 - observations.0 + 1;
        Word { id: WordId { level, index }, class, size, turn_rad, observations, predecessors: vec![] }
    }

    fn pattern(class: u8, size: u32, turn_rad: f64) -> WordPattern {
        WordPattern {
            class: Some(class),
            size: Some(size),
            size_tolerance: 0.25,
            turn_rad: Some(turn_rad),
            turn_tolerance_rad: 0.5,
        }
    }

    fn index() -> OccurrenceIndex {
        let words = [
            word(0, 0, 3, 0.0, (0, 9)),
            word(0, 1, 5, 1.5, (10, 29)),
            word(0, 2, 4, 0.0, (30, 33)),
            word(0, 3, 5, 0.0, (34, 37)),
            word(1, 0, 5, 1.5, (10, 37)),
        ];
        let stored = store_words(&Lattice::from_words(&words).unwrap());
        OccurrenceIndex::from_stored([stored.as_slice()]).unwrap()
    }

    fn ask(patterns: &[WordPattern]) -> Vec<PatternFit> {
        WordSequence::new(patterns.to_vec()).unwrap().best_fits(&index(), 100)
    }

    #[test]
    fn a_pattern_fits_both_ways_round() {
        let forwards = ask(&[pattern(3, 11, 0.1), pattern(5, 20, 1.5)]);
        assert_eq!(forwards.len(), 1);
        let found = &forwards[0];
        assert_eq!((found.words, found.stretch), ((0, 1), Interval { run_idx: 0, first: 0, last: 29 }));
        assert!(found.fit > 0.5 && found.direction == Direction::Same);
        let backwards = ask(&[pattern(5, 20, -1.5), pattern(3, 10, 0.0)]);
        assert_eq!(backwards.len(), 1);
        assert_eq!(backwards[0].direction, Direction::Opposite);
        assert!(backwards[0].fit > 0.999, "a turn is rounded to 2⁻¹⁵ π");
    }

    #[test]
    fn alternative_words_answer_too() {
        let found = ask(&[pattern(3, 10, 0.0), pattern(5, 28, 1.5)]);
        assert_eq!(found[0].words, (0, 3), "read through the alternative");
        assert_eq!((found[0].stretch.first, found[0].stretch.last), (0, 37));
        // Three pairs of neighbours, the pair through the alternative, each read both ways.
        assert_eq!(ask(&[WordPattern::default(), WordPattern::default()]).len(), 8);
        assert_eq!(ask(&[WordPattern::default()]).len(), 10);
    }

    #[test]
    fn the_best_of_several_readings_counts() {
        let read =
            |start, end, size| ReadWord { start, end, syllables: Syllables { class: 5, size, turn: 0 } };
        let words = vec![read(0, 1, 10), read(0, 2, 20), read(1, 2, 10), read(2, 3, 10)];
        let reading = TextReading { first_node: 0, num_nodes: 3, words };
        let sequence = WordSequence::new(vec![pattern(5, 20, 0.0), pattern(5, 10, 0.0)]).unwrap();
        assert_eq!(sequence.fit_of(&reading, Direction::Same), Some(1.0));
        assert_eq!(sequence.fit_of(&reading, Direction::Opposite), None);
    }
}
