//! Posting the scans of a run in order, from wherever the server's copy ends.

use reqwest::Method;
use serde::{Deserialize, Serialize};

use crate::client::{Body, Client};
use crate::error::ClientError;
use crate::types::{BatchAnswer, NewRun, RunStatus, Scan};

/// How scans travel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Encoding {
    /// `application/json`, readable.
    #[default]
    Json,
    /// `application/cbor`, smaller and faster.
    Cbor,
}

#[derive(Serialize)]
struct Batch<'a> {
    first_sequence: u64,
    scans: &'a [Scan],
}

pub(crate) fn batch_body(
    first_sequence: u64,
    scans: &[Scan],
    encoding: Encoding,
) -> Result<Body, ClientError> {
    let batch = Batch { first_sequence, scans };
    match encoding {
        Encoding::Json => Body::json(&batch),
        Encoding::Cbor => Body::cbor(&batch),
    }
}

/// The upload of one run.
#[derive(Clone, Debug)]
pub struct RunUpload {
    client: Client,
    batches_path: String,
    encoding: Encoding,
    status: RunStatus,
}

impl Client {
    /// Makes the run, or finds it as it stands, and is ready to post what the server does not have yet.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn start_upload(
        &self,
        site: &str,
        run: &str,
        new_run: &NewRun,
        encoding: Encoding,
    ) -> Result<RunUpload, ClientError> {
        let status = self.put_run(site, run, new_run).await?;
        let batches_path = format!("/v1/sites/{site}/runs/{run}/batches");
        Ok(RunUpload { client: self.clone(), batches_path, encoding, status })
    }
}

impl RunUpload {
    /// Sequence number of the first scan that the server does not have.
    pub fn next_sequence(&self) -> u64 {
        self.status.next_sequence
    }

    /// Whether the server takes no more scans of this run.
    pub fn is_finished(&self) -> bool {
        self.status.state == "finished"
    }

    /// Posts the next scans. When this returns they are on the server's disk; a repetition after a lost answer
    /// changes nothing.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn post(&mut self, scans: &[Scan]) -> Result<BatchAnswer, ClientError> {
        let body = batch_body(self.status.next_sequence, scans, self.encoding)?;
        let answer: BatchAnswer = self.client.json(Method::POST, &self.batches_path, body).await?;
        self.status.next_sequence = answer.next_sequence;
        self.status.num_observations = answer.num_observations;
        self.status.num_words = answer.num_words;
        Ok(answer)
    }
}
