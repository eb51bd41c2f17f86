//! Questions by word pattern: a few words with tolerances, looked for in the texts of all runs, driven either way.
//!
//! The index answers where the pattern may be; what it costs does not grow with the text but with how often the
//! rarest pair of its words occurs. Words of every level count, so a place is found although a door was open.

use std::f64::consts::PI;
use std::sync::Arc;

use locution_engine::geometry::{Pose2, wrap_angle};
use locution_engine::index::{Syllables, TextQuery, TextReading, WordConstraint};
use locution_engine::mapping::Direction;

use crate::app::maps::pose_at;
use crate::app::site::{Segment, Site};
use crate::app::{AppError, on_blocking_thread};
use crate::records::RunIdx;

/// Places looked at for one question, of each part of the index and direction.
const NUM_PLACES_MAX: usize = 100_000;
/// A turn in the index is rounded to 2⁻¹⁵ π; bounds are drawn wider by more than that.
const TURN_MARGIN_RAD: f64 = 2e-4;

/// One word of a question; what is `None` may be anything.
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
            let driven = f64::from(word.turn) / 32768.0 * PI;
            let driven = if direction == Direction::Opposite { -driven } else { driven };
            fit = fit.min(share_left(wrap_angle(turn_rad - driven).abs(), self.turn_tolerance_rad)?);
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
#[derive(Clone, Debug)]
pub struct WordAnswer {
    /// Name of the run.
    pub run: String,
    /// Whether the text was read forwards or backwards.
    pub direction: Direction,
    /// First and last word of level 0, by number.
    pub words: (u32, u32),
    /// First and last observation.
    pub observations: (u32, u32),
    /// Mean fit of the words, from 0 to 1.
    pub fit: f64,
    /// Component and pose of the middle, when the run is in the map.
    pub in_map: Option<(u32, Pose2)>,
}

/// Where a sequence of words is driven, the best fit first.
///
/// # Errors
/// Those of the storage.
pub async fn find_words(
    site: &Site,
    patterns: &[WordPattern],
    limit: usize,
) -> Result<Vec<WordAnswer>, AppError> {
    let query = TextQuery::from_pattern(&patterns.iter().map(WordPattern::bounds).collect::<Vec<_>>())?;
    let (segments, patterns) = (site.text_segments().await?, patterns.to_vec());
    let found = on_blocking_thread(move || best_fits(&segments, &query, &patterns, limit)).await?;
    let reader = site.reader();
    let mut answers = Vec::with_capacity(found.len());
    for (run, mut answer) in found {
        answer.run = reader.run(run).await?.record.name.clone();
        answers.push((run, answer));
    }
    place(site, &mut answers).await?;
    Ok(answers.into_iter().map(|(_, answer)| answer).collect())
}

/// Adds where the answers are, when there is a map.
async fn place(site: &Site, answers: &mut [(RunIdx, WordAnswer)]) -> Result<(), AppError> {
    let map = match site.map(None).await {
        Ok(map) => map,
        Err(AppError::NotReady { .. }) => return Ok(()),
        Err(error) => return Err(error),
    };
    for (run, answer) in answers {
        let Some(map_run) = map.record.run(*run) else { continue };
        let middle = u64::from(answer.observations.0 + (answer.observations.1 - answer.observations.0) / 2);
        let observations = map.reader().run(*run).await?.observations(middle, 1).await?;
        let poses = map.poses(map_run).await?;
        let pose = observations.first().and_then(|observation| pose_at(&poses, observation.scan_seq));
        answer.in_map = pose.map(|pose| (map_run.component, pose));
    }
    Ok(())
}

/// The places where a question fits best, best first, then by run and place; their runs still without names.
fn best_fits(
    segments: &[Arc<Segment>],
    query: &TextQuery,
    patterns: &[WordPattern],
    limit: usize,
) -> Vec<(u32, WordAnswer)> {
    let mut answers: Vec<(u32, WordAnswer)> = Vec::new();
    for segment in segments {
        for (direction, query) in [(Direction::Same, query.clone()), (Direction::Opposite, query.reversed())]
        {
            for found in segment.index.find_at_most(&query, 1, NUM_PLACES_MAX) {
                let Some(reading) = segment.index.read(&found.stretch) else { continue };
                let Some(fit) = fit_of(patterns, &reading, direction) else { continue };
                let last_node = reading.first_node + reading.num_nodes.saturating_sub(1) as u32;
                let answer = WordAnswer {
                    run: String::new(),
                    direction,
                    words: (reading.first_node, last_node),
                    observations: (found.stretch.first, found.stretch.last),
                    fit,
                    in_map: None,
                };
                answers.push((segment.runs[found.stretch.run_idx as usize], answer));
            }
        }
    }
    answers.sort_by(|(run_a, a), (run_b, b)| {
        let place = |run: u32, answer: &WordAnswer| (run, answer.observations, answer.direction);
        b.fit.total_cmp(&a.fit).then_with(|| place(*run_a, a).cmp(&place(*run_b, b)))
    });
    answers.truncate(limit);
    answers
}

/// The best mean fit among the ways to read a stretch as the pattern.
fn fit_of(patterns: &[WordPattern], reading: &TextReading, direction: Direction) -> Option<f64> {
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

#[cfg(test)]
mod tests {
    use locution_engine::index::Lattice;
    use locution_engine::index::{OccurrenceIndex, ReadWord, store_words};
    use locution_engine::text::{Word, WordId};

    use super::*;

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

    fn segment() -> Arc<Segment> {
        let words = [
            word(0, 0, 3, 0.0, (0, 9)),
            word(0, 1, 5, 1.5, (10, 29)),
            word(0, 2, 4, 0.0, (30, 33)),
            word(0, 3, 5, 0.0, (34, 37)),
            word(1, 0, 5, 1.5, (10, 37)),
        ];
        let stored = store_words(&Lattice::from_words(&words).unwrap());
        Arc::new(Segment { runs: vec![7], index: OccurrenceIndex::from_stored([stored.as_slice()]).unwrap() })
    }

    fn ask(patterns: &[WordPattern]) -> Vec<(u32, WordAnswer)> {
        let bounds: Vec<WordConstraint> = patterns.iter().map(WordPattern::bounds).collect();
        best_fits(&[segment()], &TextQuery::from_pattern(&bounds).unwrap(), patterns, 100)
    }

    #[test]
    fn a_pattern_fits_both_ways_round() {
        let forwards = ask(&[pattern(3, 11, 0.1), pattern(5, 20, 1.5)]);
        assert_eq!(forwards.len(), 1);
        let (run, answer) = &forwards[0];
        assert_eq!((*run, answer.words, answer.observations), (7, (0, 1), (0, 29)));
        assert!(answer.fit > 0.5 && answer.direction == Direction::Same);
        let backwards = ask(&[pattern(5, 20, -1.5), pattern(3, 10, 0.0)]);
        assert_eq!(backwards.len(), 1);
        assert_eq!(backwards[0].1.direction, Direction::Opposite);
        assert!(backwards[0].1.fit > 0.999, "a turn is rounded to 2⁻¹⁵ π");
    }

    #[test]
    fn alternative_words_answer_too() {
        let answers = ask(&[pattern(3, 10, 0.0), pattern(5, 28, 1.5)]);
        assert_eq!(answers[0].1.words, (0, 3), "read through the alternative");
        assert_eq!(answers[0].1.observations, (0, 37));
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
        let patterns = [pattern(5, 20, 0.0), pattern(5, 10, 0.0)];
        assert_eq!(fit_of(&patterns, &reading, Direction::Same), Some(1.0));
        assert_eq!(fit_of(&patterns, &reading, Direction::Opposite), None);
    }
}
