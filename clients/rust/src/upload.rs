//! Posting the scans of a run in order, from wherever the server's copy ends.

use serde::{Deserialize, Serialize};

use crate::client::{Body, Client};
use crate::error::ClientError;
use crate::routes::{self, Query};
use crate::types::{NewRun, Receipt, Run, RunState, Scan};

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
    site: String,
    encoding: Encoding,
    run: Run,
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
        let run = self.put_run(site, run, new_run).await?;
        Ok(RunUpload { client: self.clone(), site: site.to_owned(), encoding, run })
    }
}

impl RunUpload {
    /// Sequence number of the first scan that the server does not have.
    pub fn next_sequence(&self) -> u64 {
        self.run.next_sequence
    }

    /// Whether the server takes no more scans of this run.
    pub fn is_finished(&self) -> bool {
        self.run.state == RunState::Finished
    }

    /// Posts the next scans. When this returns they are on the server's disk; a repetition after a lost answer
    /// changes nothing.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn post(&mut self, scans: &[Scan]) -> Result<Receipt, ClientError> {
        let body = batch_body(self.run.next_sequence, scans, self.encoding)?;
        let names = [self.site.as_str(), self.run.run.as_str()];
        let receipt: Receipt =
            self.client.answer(&routes::APPEND_BATCH, &names, &Query::default(), body).await?;
        self.run.next_sequence = receipt.next_sequence;
        self.run.num_scans = receipt.next_sequence;
        self.run.num_observations = receipt.num_observations;
        self.run.num_words = receipt.num_words;
        Ok(receipt)
    }
}
