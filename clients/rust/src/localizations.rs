//! "Where am I": scans go in like a run's, hypotheses come out.

use crate::client::{Body, Client};
use crate::error::ClientError;
use crate::routes::{self, Query};
use crate::types::{Localization, NewLocalization, Scan};
use crate::upload::{Encoding, batch_body};

impl Client {
    /// Opens a localisation on the map of a site; nothing of it is added to the map.
    ///
    /// # Errors
    /// See [`ClientError`]; 409 before the first build.
    pub async fn open_localization(
        &self,
        site: &str,
        new: &NewLocalization,
    ) -> Result<Localization, ClientError> {
        self.answer(&routes::OPEN_LOCALIZATION, &[site], &Query::default(), Body::json(new)?).await
    }

    /// A localisation as it stands.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn localization(&self, site: &str, id: &str) -> Result<Localization, ClientError> {
        self.get(&routes::GET_LOCALIZATION, &[site, id], &Query::default()).await
    }

    /// All localisations that are open in a site, the oldest first.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn localizations(&self, site: &str) -> Result<Vec<Localization>, ClientError> {
        self.all(&routes::LIST_LOCALIZATIONS, &[site], Query::default()).await
    }

    /// Adds scans and answers where the robot now may be.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn localize(
        &self,
        site: &str,
        id: &str,
        first_sequence: u64,
        scans: &[Scan],
    ) -> Result<Localization, ClientError> {
        let body = batch_body(first_sequence, scans, Encoding::Cbor)?;
        self.answer(&routes::APPEND_LOCALIZATION_BATCH, &[site, id], &Query::default(), body).await
    }

    /// Closes a localisation.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn close_localization(&self, site: &str, id: &str) -> Result<(), ClientError> {
        self.done(&routes::CLOSE_LOCALIZATION, &[site, id], Body::Empty).await
    }
}
