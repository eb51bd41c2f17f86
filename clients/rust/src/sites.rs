//! Sites.

use serde::Serialize;

use crate::client::{Body, Client};
use crate::error::ClientError;
use crate::routes::{self, Query};
use crate::types::{ChangedSite, Site, SiteChange, SiteSummary};

#[derive(Serialize)]
struct NewSite<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    config: Option<&'a serde_json::Value>,
}

impl Client {
    /// Makes a site, or finds it as it stands. `config` is the engine's, whole or in part.
    ///
    /// # Errors
    /// See [`ClientError`]; 409 when it stands with another configuration.
    pub async fn put_site(
        &self,
        site: &str,
        config: Option<&serde_json::Value>,
    ) -> Result<SiteSummary, ClientError> {
        self.answer(&routes::MAKE_SITE, &[site], &Query::default(), Body::json(&NewSite { config })?).await
    }

    /// A site as it stands.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn site(&self, site: &str) -> Result<Site, ClientError> {
        self.get(&routes::GET_SITE, &[site], &Query::default()).await
    }

    /// All sites that the key may see.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn sites(&self) -> Result<Vec<SiteSummary>, ClientError> {
        self.all(&routes::LIST_SITES, &[], Query::default()).await
    }

    /// Changes a site's configuration or how much of it is kept.
    ///
    /// # Errors
    /// See [`ClientError`]; 422 for what cannot be changed.
    pub async fn change_site(&self, site: &str, change: &SiteChange) -> Result<ChangedSite, ClientError> {
        self.answer(&routes::CHANGE_SITE, &[site], &Query::default(), Body::json(change)?).await
    }

    /// Deletes a site with everything in it.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn delete_site(&self, site: &str) -> Result<(), ClientError> {
        self.done(&routes::DELETE_SITE, &[site], Body::Empty).await
    }

    /// A site as one stream of bytes, as it stands now.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn backup_site(&self, site: &str) -> Result<Vec<u8>, ClientError> {
        self.bytes(&routes::BACKUP_SITE, &[site], &Query::default()).await
    }

    /// Makes a site of a backup.
    ///
    /// # Errors
    /// See [`ClientError`]; 409 when a site of the name stands, 422 when the backup is damaged or cut off.
    pub async fn restore_site(&self, site: &str, backup: Vec<u8>) -> Result<SiteSummary, ClientError> {
        self.answer(&routes::RESTORE_SITE, &[site], &Query::default(), Body::Octets(backup)).await
    }
}
