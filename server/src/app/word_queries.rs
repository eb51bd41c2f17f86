//! Questions by word pattern: a few words with tolerances, looked for in the texts of all runs, driven either way.

use locution_engine::geometry::{Pose2, wrap_angle};
use locution_engine::mapping::Direction;
use locution_engine::text::Word;

use super::AppError;
use super::reading::{read_observations, read_words};
use super::regions::pose_at;
use super::runs::read_run;
use super::site::Site;

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
    fn fit(&self, word: &Word, direction: Direction) -> Option<f64> {
        if self.class.is_some_and(|class| class != word.class) {
            return None;
        }
        let mut fit = 1.0f64;
        if let Some(size) = self.size {
            let off = f64::from(size.abs_diff(word.size)) / f64::from(size.max(word.size).max(1));
            fit = fit.min(share_left(off, self.size_tolerance)?);
        }
        if let Some(turn_rad) = self.turn_rad {
            let driven = f64::from(word.turn_rad);
            let driven = if direction == Direction::Opposite { -driven } else { driven };
            fit = fit.min(share_left(wrap_angle(turn_rad - driven).abs(), self.turn_tolerance_rad)?);
        }
        Some(fit)
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

impl Site {
    /// Where a sequence of words is driven, the best fit first.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn find_words(
        &self,
        patterns: &[WordPattern],
        limit: usize,
    ) -> Result<Vec<WordAnswer>, AppError> {
        let (store, generation) = (&**self.store(), self.generation());
        let mut answers: Vec<(u32, WordAnswer)> = Vec::new();
        for run in 0..self.state().record.num_runs {
            let info = read_run(store, generation, run).await?;
            let words = read_words(store, generation, &info, 0, 0, usize::MAX).await?;
            for window in words.windows(patterns.len().max(1)) {
                for direction in [Direction::Same, Direction::Opposite] {
                    if let Some(fit) = fit_of(patterns, window, direction) {
                        answers.push((run, answer_at(&info.run.name, window, direction, fit)));
                    }
                }
            }
        }
        answers.sort_by(|a, b| b.1.fit.total_cmp(&a.1.fit));
        answers.truncate(limit);
        self.place(&mut answers).await?;
        Ok(answers.into_iter().map(|(_, answer)| answer).collect())
    }

    /// Adds where the answers are, when there is a map.
    async fn place(&self, answers: &mut [(u32, WordAnswer)]) -> Result<(), AppError> {
        let map = match self.map(None).await {
            Ok(map) => map,
            Err(AppError::NotReady { .. }) => return Ok(()),
            Err(error) => return Err(error),
        };
        for (run, answer) in answers {
            let Some(map_run) = map.runs.iter().find(|map_run| map_run.run == *run) else { continue };
            let info = read_run(&**self.store(), self.generation(), *run).await?;
            let middle =
                u64::from(answer.observations.0 + (answer.observations.1 - answer.observations.0) / 2);
            let observations =
                read_observations(&**self.store(), self.generation(), &info, middle, 1).await?;
            let poses = self.map_poses(&map, map_run).await?;
            let pose = observations.first().and_then(|observation| pose_at(&poses, observation.scan_seq));
            answer.in_map = pose.map(|pose| (map_run.component, pose));
        }
        Ok(())
    }
}

/// The mean fit of a window, when every word fits.
fn fit_of(patterns: &[WordPattern], window: &[Word], direction: Direction) -> Option<f64> {
    let mut sum = 0.0;
    for (idx, pattern) in patterns.iter().enumerate() {
        let word =
            if direction == Direction::Opposite { &window[window.len() - 1 - idx] } else { &window[idx] };
        sum += pattern.fit(word, direction)?;
    }
    Some(sum / patterns.len() as f64)
}

fn answer_at(run: &str, window: &[Word], direction: Direction, fit: f64) -> WordAnswer {
    let (first, last) = (&window[0], &window[window.len() - 1]);
    WordAnswer {
        run: run.to_owned(),
        direction,
        words: (first.id.index, last.id.index),
        observations: (first.observations.0, last.observations.1),
        fit,
        in_map: None,
    }
}

#[cfg(test)]
mod tests {
    use locution_engine::text::WordId;

    use super::*;

    fn word(index: u32, class: u8, size: u32, turn_rad: f32) -> Word {
        let id = WordId { level: 0, index };
        Word { id, class, size, turn_rad, observations: (index, index), predecessors: vec![] }
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

    #[test]
    fn a_pattern_fits_both_ways_round() {
        let text = [word(0, 3, 10, 0.0), word(1, 5, 20, 1.5)];
        let forwards = [pattern(3, 11, 0.1), pattern(5, 20, 1.5)];
        assert!(fit_of(&forwards, &text, Direction::Same).unwrap() > 0.5);
        assert_eq!(fit_of(&forwards, &text, Direction::Opposite), None);
        let backwards = [pattern(5, 20, -1.5), pattern(3, 10, 0.0)];
        assert_eq!(fit_of(&backwards, &text, Direction::Opposite), Some(1.0));
        let anything = [WordPattern::default(), WordPattern::default()];
        assert_eq!(fit_of(&anything, &text, Direction::Same), Some(1.0));
    }
}
