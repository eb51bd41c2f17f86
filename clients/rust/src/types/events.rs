//! Events.

use serde::{Deserialize, Serialize};

use super::jobs::Job;
use super::localizations::LocalizationState;

/// What became of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunChange {
    /// It was made.
    Made,
    /// It takes no more scans.
    Finished,
    /// It was forgotten.
    Deleted,
}

/// Something that happened in a site.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// A run was made, finished or deleted.
    Run {
        /// Its name.
        run: String,
        /// What became of it.
        change: RunChange,
    },
    /// Scans were stored and became text.
    Words {
        /// The run.
        run: String,
        /// The sequence number that it expects next.
        next_sequence: u64,
        /// Observations of the run.
        num_observations: u64,
        /// Words of all levels of the run.
        num_words: u64,
    },
    /// A job was queued, begun or ended.
    Job {
        /// As it stood.
        job: Job,
    },
    /// Another version of the map serves.
    Version {
        /// Its number.
        version: u64,
        /// Parts that nothing connects.
        num_components: u32,
    },
    /// What matches the version has that serves now.
    Matches {
        /// Its number.
        version: u64,
        /// Matches, whatever became of them.
        num_matches: u64,
        /// Matches that hold the map together.
        num_verified: u64,
    },
    /// A robot that localises was found or lost.
    Localization {
        /// Name of the localisation.
        id: String,
        /// How sure it is now.
        state: LocalizationState,
    },
    /// Events have gone that were not read; look at the lists.
    Missed {},
}
