//! What people draw into a map.

use crate::client::{Body, Client};
use crate::error::ClientError;
use crate::maps::MapAt;
use crate::routes::{self, Query};
use crate::types::{Annotation, NewAnnotation};

impl Client {
    /// Annotations where they lie in a map.
    ///
    /// # Errors
    /// See [`ClientError`]; 409 before the first build.
    pub async fn annotations(&self, site: &str, at: MapAt) -> Result<Vec<Annotation>, ClientError> {
        self.all(&routes::LIST_ANNOTATIONS, &[site], at.query()).await
    }

    /// One annotation where it lies in the serving map.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn annotation(&self, site: &str, id: &str) -> Result<Annotation, ClientError> {
        self.get(&routes::GET_ANNOTATION, &[site, id], &Query::default()).await
    }

    /// Draws something into the serving map; it moves with the places around it.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn annotate(&self, site: &str, new: &NewAnnotation) -> Result<Annotation, ClientError> {
        self.answer(&routes::MAKE_ANNOTATION, &[site], &Query::default(), Body::json(new)?).await
    }

    /// Draws something else in the place of an annotation.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn change_annotation(
        &self,
        site: &str,
        id: &str,
        new: &NewAnnotation,
    ) -> Result<Annotation, ClientError> {
        self.answer(&routes::CHANGE_ANNOTATION, &[site, id], &Query::default(), Body::json(new)?).await
    }

    /// Forgets an annotation.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn delete_annotation(&self, site: &str, id: &str) -> Result<(), ClientError> {
        self.done(&routes::DELETE_ANNOTATION, &[site, id], Body::Empty).await
    }
}
