//! Keys.

use serde::{Deserialize, Serialize};

/// What a key may do; each includes those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scope {
    /// Look, query, localize.
    Read,
    /// Also send runs, build maps and decide on matches.
    Write,
    /// Also make and delete sites.
    Admin,
}

/// A key to be made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NewKey {
    /// 1 to 64 of `A–Z a–z 0–9 . _ -`; stands in the server's log.
    pub name: String,
    /// What it may do.
    pub scope: Scope,
    /// Sites it may do it in; `*` means all.
    pub sites: Vec<String>,
    /// How long it is valid, seconds; for good when none are said.
    pub expires_in_s: Option<u64>,
    /// Most requests in a second, on average.
    pub requests_per_s_max: Option<f64>,
    /// Most localizations at once.
    #[serde(rename = "num_localisations_max")]
    pub num_localizations_max: Option<usize>,
}

/// A key, without its secret.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Key {
    /// Its name.
    pub name: String,
    /// What it may do.
    pub scope: Scope,
    /// Where.
    pub sites: Vec<String>,
    /// Whether it stands in the server's configuration, where the API cannot change it.
    pub is_configured: bool,
    /// When it was made, seconds since 1970; none for keys of the configuration.
    pub created_at_s: Option<u64>,
    /// When it stops being valid, seconds since 1970.
    pub expires_at_s: Option<u64>,
    /// Until when the secret before the last rotation is valid, seconds since 1970.
    pub previous_valid_until_s: Option<u64>,
    /// Most requests in a second, on average.
    pub requests_per_s_max: Option<f64>,
    /// Most localizations at once.
    #[serde(rename = "num_localisations_max")]
    pub num_localizations_max: Option<usize>,
}

/// A key with its secret, which the server shows this once.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IssuedKey {
    /// The secret.
    pub secret: String,
    /// The key.
    pub key: Key,
}

/// A list of keys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Keys {
    /// In the order of making, those of the configuration first.
    pub items: Vec<Key>,
}
