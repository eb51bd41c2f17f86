//! Jobs on the wire.

use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use crate::app::site::JobInfo;
use crate::records::{JobKind, JobState};

/// How far a job is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobStateDto {
    /// It waits for its turn.
    Queued,
    /// It is at work.
    Running,
    /// It did what it should.
    Done,
    /// It did not; `error` says why.
    Failed,
}

/// A long piece of work.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct JobDto {
    /// Its name in the site.
    #[schema(example = "7")]
    pub id: String,
    /// `build` makes a map of everything stored.
    #[schema(example = "build")]
    pub kind: String,
    /// How far it is.
    pub state: JobStateDto,
    /// From 0 to 1.
    pub progress: f64,
    /// What it is at, or what came of it.
    pub detail: String,
    /// Why it failed.
    pub error: Option<String>,
}

impl From<JobInfo> for JobDto {
    fn from(info: JobInfo) -> Self {
        let kind = match info.record.kind {
            JobKind::Build => "build",
        };
        let state = match info.record.state {
            JobState::Queued => JobStateDto::Queued,
            JobState::Running => JobStateDto::Running,
            JobState::Done => JobStateDto::Done,
            JobState::Failed => JobStateDto::Failed,
        };
        Self {
            id: info.record.id.to_string(),
            kind: kind.into(),
            state,
            progress: info.progress,
            detail: info.record.detail,
            error: info.record.error,
        }
    }
}

/// How to answer a request for a build.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct BuildParams {
    /// Answer when it is done rather than when it is queued.
    #[serde(default)]
    pub wait: bool,
}
