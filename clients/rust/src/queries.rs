//! Questions by example, by words and by labels.

use serde::Serialize;

use crate::client::{Body, Client};
use crate::error::ClientError;
use crate::routes::{self, Query};
use crate::types::{ExampleAnswer, Geometry, LabelAnswer, LabelQuery, Scan, WordAnswer, WordQuery};

/// A short recording that is asked about and not stored.
#[derive(Serialize)]
struct ExampleQuery<'a> {
    geometry: &'a Geometry,
    scans: &'a [Scan],
}

impl Client {
    /// Asks where in a site a short recording was made; nothing of it is stored.
    ///
    /// # Errors
    /// See [`ClientError`]; 409 before the first build.
    pub async fn query_example(
        &self,
        site: &str,
        geometry: &Geometry,
        scans: &[Scan],
    ) -> Result<ExampleAnswer, ClientError> {
        let body = Body::cbor(&ExampleQuery { geometry, scans })?;
        self.answer(&routes::QUERY_EXAMPLE, &[site], &Query::default(), body).await
    }

    /// Asks in which of all sites a short recording was made, and where; the likeliest site comes first.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn query_example_everywhere(
        &self,
        geometry: &Geometry,
        scans: &[Scan],
    ) -> Result<Vec<ExampleAnswer>, ClientError> {
        let body = Body::cbor(&ExampleQuery { geometry, scans })?;
        self.answer(&routes::QUERY_EXAMPLE_EVERYWHERE, &[], &Query::default(), body).await
    }

    /// Asks where words are driven one after the other, either way round.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn query_words(&self, site: &str, query: &WordQuery) -> Result<Vec<WordAnswer>, ClientError> {
        self.answer(&routes::QUERY_WORDS, &[site], &Query::default(), Body::json(query)?).await
    }

    /// The same in all sites that the key may see.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn query_words_everywhere(&self, query: &WordQuery) -> Result<Vec<WordAnswer>, ClientError> {
        self.answer(&routes::QUERY_WORDS_EVERYWHERE, &[], &Query::default(), Body::json(query)?).await
    }

    /// Asks where labelled places are driven one after the other, either way round.
    ///
    /// # Errors
    /// See [`ClientError`]; 409 before the first build.
    pub async fn query_labels(
        &self,
        site: &str,
        query: &LabelQuery,
    ) -> Result<Vec<LabelAnswer>, ClientError> {
        self.answer(&routes::QUERY_LABELS, &[site], &Query::default(), Body::json(query)?).await
    }

    /// The same in all sites that the key may see, the surest first.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn query_labels_everywhere(&self, query: &LabelQuery) -> Result<Vec<LabelAnswer>, ClientError> {
        self.answer(&routes::QUERY_LABELS_EVERYWHERE, &[], &Query::default(), Body::json(query)?).await
    }
}
