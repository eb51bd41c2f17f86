//! Questions by word pattern: a few words with tolerances, looked for in the texts of all runs, driven either way.

use std::sync::Arc;

use locution_engine::geometry::Pose2;
use locution_engine::index::{PatternFit, WordPattern, WordSequence};
use locution_engine::mapping::Direction;

use crate::app::site::{Segment, Site};
use crate::app::{AppError, on_blocking_thread};
use crate::records::{Map, RunIdx};

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
pub async fn find_words(
    site: &Site,
    patterns: &[WordPattern],
    limit: usize,
) -> Result<Vec<WordAnswer>, AppError> {
    let sequence = WordSequence::new(patterns.to_vec())?;
    let segments = site.text_segments().await?;
    let found = on_blocking_thread(move || best_fits(&segments, &sequence, limit)).await?;
    let reader = site.reader();
    let map = match site.map(None).await {
        Ok(map) => Some(map),
        Err(AppError::NotReady { .. }) => None,
        Err(error) => return Err(error),
    };
    let mut answers = Vec::with_capacity(found.len());
    for (run, found) in found {
        let record = reader.run(run).await?.record;
        // Deleted since the question was put.
        if record.is_deleted() {
            continue;
        }
        let (first, last) = (found.stretch.first, found.stretch.last);
        let in_map = match &map {
            Some(map) => place(map, run, u64::from(first + (last - first) / 2)).await?,
            None => None,
        };
        answers.push(WordAnswer {
            run: record.name.clone(),
            direction: found.direction,
            words: found.words,
            observations: (first, last),
            fit: found.fit,
            in_map,
        });
    }
    Ok(answers)
}

/// Where an observation of a run was made in the map, as far as the map knows the run.
async fn place(map: &Map, run: RunIdx, observation: u64) -> Result<Option<(u32, Pose2)>, AppError> {
    let observations = map.reader().run(run).await?.observations(observation, 1).await?;
    let Some(observation) = observations.first() else { return Ok(None) };
    Ok(map.places_of(run).await?.at(observation.scan_seq, &observation.run_from_robot))
}

/// The best fits in all texts, with the numbers of their runs in the site, best first, then by run and place.
fn best_fits(segments: &[Arc<Segment>], sequence: &WordSequence, limit: usize) -> Vec<(RunIdx, PatternFit)> {
    let mut fits: Vec<(RunIdx, PatternFit)> = Vec::new();
    for segment in segments {
        let found = sequence.best_fits(&segment.index, limit);
        fits.extend(found.into_iter().map(|found| (segment.runs[found.stretch.run_idx as usize], found)));
    }
    let place = |(run, found): &(RunIdx, PatternFit)| (*run, found.stretch, found.direction);
    fits.sort_by(|a, b| b.1.fit.total_cmp(&a.1.fit).then_with(|| place(a).cmp(&place(b))));
    fits.truncate(limit);
    fits
}
