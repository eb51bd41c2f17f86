//! "Where am I": scans go in like a run's, hypotheses come out.

use reqwest::Method;
use serde::{Deserialize, Serialize};

use crate::client::{Body, Client};
use crate::error::ClientError;
use crate::types::{Geometry, NewRun, Pose, Scan};
use crate::upload::{Encoding, batch_body};

/// How sure the answer is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LocalizationState {
    /// Nothing fits yet.
    #[default]
    Lost,
    /// Several places fit.
    Ambiguous,
    /// One place fits.
    Converged,
}

/// One place where the robot may be.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Hypothesis {
    /// Where in the map.
    #[serde(alias = "map_from_robot")]
    pub pose: Pose,
    /// Covariance of (x, y, θ), row by row.
    pub covariance: [[f64; 3]; 3],
    /// Probability of this place.
    pub probability: f64,
}

/// Where a short recording ends, in one site.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct ExampleAnswer {
    /// The site.
    pub site: String,
    /// `Lost` means "not here".
    pub state: LocalizationState,
    /// Metres that the recording drives.
    pub travel_m: f64,
    /// Places where it may end, likeliest first.
    pub places: Vec<Hypothesis>,
    /// Probability that it was not made in this site.
    pub probability_elsewhere: f64,
}

#[derive(Serialize)]
struct ExampleQuery<'a> {
    geometry: &'a Geometry,
    scans: &'a [Scan],
}

/// A localisation as it stands.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct Localization {
    /// Its name within the site.
    #[serde(alias = "localisation")]
    pub id: String,
    /// How sure it is.
    pub state: LocalizationState,
    /// Places where the robot may be, likeliest first.
    pub hypotheses: Vec<Hypothesis>,
    /// Probability that it is not in the map; with those of all places 1.
    pub probability_elsewhere: f64,
    /// What is missing to be found, by the names of the API; empty when it is.
    pub missing: Vec<String>,
    /// Sequence number that the next scan must have.
    pub next_sequence: u64,
}

impl Client {
    /// Opens a localisation on the map of a site; nothing of it is added to the map.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn open_localization(&self, site: &str, robot: &NewRun) -> Result<Localization, ClientError> {
        self.json(Method::POST, &format!("/v1/sites/{site}/localisations"), Body::json(robot)?).await
    }

    /// Adds scans and answers where the robot now may be.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn localize(
        &self,
        site: &str,
        localization: &str,
        first_sequence: u64,
        scans: &[Scan],
    ) -> Result<Localization, ClientError> {
        let path = format!("/v1/sites/{site}/localisations/{localization}/batches");
        self.json(Method::POST, &path, batch_body(first_sequence, scans, Encoding::Cbor)?).await
    }

    /// Asks where in a site a short recording was made; nothing of it is stored.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn query_example(
        &self,
        site: &str,
        geometry: &Geometry,
        scans: &[Scan],
    ) -> Result<ExampleAnswer, ClientError> {
        let body = Body::cbor(&ExampleQuery { geometry, scans })?;
        self.json(Method::POST, &format!("/v1/sites/{site}/queries/example"), body).await
    }

    /// Closes a localisation.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn close_localization(&self, site: &str, localization: &str) -> Result<(), ClientError> {
        let path = format!("/v1/sites/{site}/localisations/{localization}");
        self.send(Method::DELETE, &path, "application/json", Body::Empty).await.map(drop)
    }
}
