//! Keys, for administrators: made, listed, given another secret, revoked.

use crate::client::{Body, Client};
use crate::error::ClientError;
use crate::routes::{self, Query};
use crate::types::{IssuedKey, Key, Keys, NewKey};

impl Client {
    /// Makes a key; its secret is in this answer only.
    ///
    /// # Errors
    /// See [`ClientError`]; 409 when a key of the name stands.
    pub async fn make_key(&self, key: &NewKey) -> Result<IssuedKey, ClientError> {
        self.answer(&routes::MAKE_KEY, &[], &Query::default(), Body::json(key)?).await
    }

    /// All keys that this one may manage, without their secrets.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn keys(&self) -> Result<Vec<Key>, ClientError> {
        let keys: Keys = self.get(&routes::LIST_KEYS, &[], &Query::default()).await?;
        Ok(keys.items)
    }

    /// Gives a key another secret; the old one stays valid for `grace_s` seconds, not at all when none are said.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn rotate_key(&self, key: &str, grace_s: Option<u64>) -> Result<IssuedKey, ClientError> {
        let query = Query::default().and("grace_s", grace_s);
        self.answer(&routes::ROTATE_KEY, &[key], &query, Body::Empty).await
    }

    /// Ends a key at once.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn revoke_key(&self, key: &str) -> Result<(), ClientError> {
        self.done(&routes::REVOKE_KEY, &[key], Body::Empty).await
    }
}
