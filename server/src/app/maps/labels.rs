//! Labelled stretches of driving in a map, and questions in their words: "a corridor over ten metres, then a left
//! corner".

use locution_engine::semantics::{LabelPattern, LabeledStretch, PlaceLabel, find_pattern, labeled_stretches};

use crate::app::AppError;
use crate::records::{Map, MapRun, StoredLabel};
use crate::storage::StorageError;

/// A stretch of driving through places of one label, with the run that drove it.
#[derive(Clone, Debug)]
pub struct DrivenStretch {
    /// Name of the run.
    pub run: String,
    /// Component of the map.
    pub component: u32,
    pub stretch: LabeledStretch,
}

/// Where a question fits.
#[derive(Clone, Debug)]
pub struct LabelAnswer {
    /// The stretches, in the order of the question.
    pub stretches: Vec<DrivenStretch>,
    /// Whether the run drove them the other way round.
    pub is_reversed: bool,
    /// The least sure of its labels.
    pub confidence: f64,
}

/// All labelled stretches of a version, in the order of runs and travel.
pub async fn labels(map: &Map) -> Result<Vec<DrivenStretch>, AppError> {
    let mut labels = Vec::new();
    for run in labeled_runs(map) {
        labels.extend(driven_by(run, stretches_of(map, run).await?));
    }
    Ok(labels)
}

/// Where a sequence of labels was driven, in either direction, the surest first.
pub async fn find_labels(
    map: &Map,
    patterns: &[LabelPattern],
    limit: usize,
) -> Result<Vec<LabelAnswer>, AppError> {
    let mut answers = Vec::new();
    for run in labeled_runs(map) {
        for found in find_pattern(&stretches_of(map, run).await?, patterns) {
            let (is_reversed, confidence) = (found.is_reversed, found.confidence);
            let stretches = driven_by(run, found.stretches).collect();
            answers.push(LabelAnswer { stretches, is_reversed, confidence });
        }
    }
    answers.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    answers.truncate(limit);
    Ok(answers)
}

fn labeled_runs(map: &Map) -> impl Iterator<Item = &MapRun> {
    map.record.runs.iter().filter(|run| run.num_labels > 0)
}

fn driven_by(run: &MapRun, stretches: Vec<LabeledStretch>) -> impl Iterator<Item = DrivenStretch> {
    let stretches = stretches.into_iter();
    stretches.map(|stretch| DrivenStretch { run: run.name.clone(), component: run.component, stretch })
}

async fn stretches_of(map: &Map, map_run: &MapRun) -> Result<Vec<LabeledStretch>, AppError> {
    let label = |stored: &StoredLabel| {
        let label = PlaceLabel::ALL.get(usize::from(stored.label_idx)).copied();
        let unknown = || StorageError::Corrupt { what: format!("label {} is not known", stored.label_idx) };
        Ok((label.ok_or_else(unknown)?, stored.confidence))
    };
    let labels = map.labels(map_run).await?.iter().map(label).collect::<Result<Vec<_>, StorageError>>()?;
    let run = map.reader().run(map_run.run).await?;
    let observations = run.observations(map_run.first_observation, labels.len()).await?;
    Ok(labeled_stretches(&labels, &observations, &map.trajectory(map_run).await?))
}
