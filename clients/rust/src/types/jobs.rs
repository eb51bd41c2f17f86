//! Jobs.

use serde::{Deserialize, Serialize};

/// How far a job is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JobState {
    /// It waits for its turn.
    Queued,
    /// It is at work.
    Running,
    /// It did what it should.
    Done,
    /// It did not; `error` says why.
    Failed,
    /// Somebody ended it before it was done.
    Cancelled,
}

/// What a job does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JobKind {
    /// Makes a map of everything stored.
    Build,
}

/// A long piece of work.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Job {
    /// Its name in the site.
    pub id: String,
    /// What it does.
    pub kind: JobKind,
    /// How far it is.
    pub state: JobState,
    /// From 0 to 1.
    pub progress: f64,
    /// Seconds that it will still take, while that can be told.
    pub left_s: Option<f64>,
    /// What it is at, or what came of it.
    pub detail: String,
    /// Why it failed.
    pub error: Option<String>,
}
