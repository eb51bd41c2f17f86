//! Runs and what was read from them.

use crate::client::{Body, Client};
use crate::error::ClientError;
use crate::routes::{self, Query};
use crate::types::{Frame, Job, NewRun, Observation, Run, RunPiece, StoredScan, Trajectory, Word};

impl Client {
    /// Makes a run, or finds it as it stands.
    ///
    /// # Errors
    /// See [`ClientError`]; 409 when it stands with another geometry.
    pub async fn put_run(&self, site: &str, run: &str, new_run: &NewRun) -> Result<Run, ClientError> {
        self.answer(&routes::MAKE_RUN, &[site, run], &Query::default(), Body::json(new_run)?).await
    }

    /// A run as it stands.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn run(&self, site: &str, run: &str) -> Result<Run, ClientError> {
        self.get(&routes::GET_RUN, &[site, run], &Query::default()).await
    }

    /// All runs of a site.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn runs(&self, site: &str) -> Result<Vec<Run>, ClientError> {
        self.all(&routes::LIST_RUNS, &[site], Query::default()).await
    }

    /// Forgets a run with all its traces; answers the job that makes the map without it, when there is a map.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn delete_run(&self, site: &str, run: &str) -> Result<Option<Job>, ClientError> {
        self.answer_if_any(&routes::DELETE_RUN, &[site, run]).await
    }

    /// Says that no more scans will come, so that delayed observations and pending words are written.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn finish_run(&self, site: &str, run: &str) -> Result<Run, ClientError> {
        self.answer(&routes::FINISH_RUN, &[site, run], &Query::default(), Body::Empty).await
    }

    /// The pieces that a run falls in where it could not be followed, with their places in the serving map.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn run_pieces(&self, site: &str, run: &str) -> Result<Vec<RunPiece>, ClientError> {
        self.all(&routes::LIST_PIECES, &[site, run], Query::default()).await
    }

    /// All stored scans of a run.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn scans(&self, site: &str, run: &str) -> Result<Vec<StoredScan>, ClientError> {
        self.all(&routes::LIST_SCANS, &[site, run], Query::default()).await
    }

    /// All observations of a run.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn observations(&self, site: &str, run: &str) -> Result<Vec<Observation>, ClientError> {
        self.all(&routes::LIST_OBSERVATIONS, &[site, run], Query::default()).await
    }

    /// All words of one level of a run; 0 holds them as observed.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn words(&self, site: &str, run: &str, level: u8) -> Result<Vec<Word>, ClientError> {
        self.all(&routes::LIST_WORDS, &[site, run], Query::default().and("level", Some(level))).await
    }

    /// A pose for every scan of a run; `version` counts in the map frame only, where `None` is the serving one.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn trajectory(
        &self,
        site: &str,
        run: &str,
        frame: Frame,
        version: Option<u64>,
    ) -> Result<Trajectory, ClientError> {
        let query = Query::default().and("frame", Some(frame.as_str())).and("version", version);
        self.get(&routes::GET_TRAJECTORY, &[site, run], &query).await
    }

    /// The same as text in the TUM format.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn trajectory_tum(&self, site: &str, run: &str, frame: Frame) -> Result<Vec<u8>, ClientError> {
        let query = Query::default().and("frame", Some(frame.as_str()));
        self.bytes(&routes::GET_TRAJECTORY_TUM, &[site, run], &query).await
    }
}
