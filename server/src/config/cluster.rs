//! The servers that share an object store.

use serde::{Deserialize, Serialize};

use super::{ServerConfig, ServerConfigError};

/// The servers that share an object store; without one this says nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ClusterConfig {
    /// Where the other servers reach this one, such as `http://10.0.0.7:7070`; where it listens unless said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub url: Option<String>,
    /// How long a server may fall silent before the others take its sites, seconds. Shorter is dearer: every server
    /// writes one object and lists those of all four times in it.
    pub lease_s: f64,
}

impl Default for ClusterConfig {
    fn default() -> Self {
        Self { url: None, lease_s: 12.0 }
    }
}

impl ClusterConfig {
    /// Checks every value, by itself and beside the others of `config`.
    pub(super) fn validate(&self, config: &ServerConfig) -> Result<(), ServerConfigError> {
        let invalid = |field: &str, problem: &str| {
            Err(ServerConfigError::Invalid { field: field.into(), problem: problem.into() })
        };
        let is_base = |url: &str| {
            url.split_once("://").is_some_and(|(scheme, host)| {
                ["http", "https"].contains(&scheme)
                    && !host.is_empty()
                    && !host.contains(['/', '?', '#', ' '])
            })
        };
        if self.url.as_deref().is_some_and(|url| !is_base(url)) {
            return invalid("cluster.url", "must be like `http://host:port`, nothing behind");
        }
        if self.url.is_none() && config.storage.address.is_some() && config.address.ip().is_unspecified() {
            return invalid(
                "cluster.url",
                "say where other servers reach this one, since `address` does not",
            );
        }
        if !(self.lease_s >= 1.0 && self.lease_s <= 300.0) {
            return invalid("cluster.lease_s", "must lie between 1 and 300 seconds");
        }
        Ok(())
    }
}
