//! Where everything is kept: in a directory of this machine, or in an object store that several servers share.

use std::fmt;

use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::ServerConfigError;

/// Where everything is kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StorageConfig {
    /// `s3://BUCKET/PREFIX` of a store that speaks S3; the embedded storage in `data_directory` unless said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub address: Option<String>,
    /// Bytes of pages that each open site of the embedded storage may keep in memory.
    pub cache_bytes_per_site: u64,
    /// A run's translator is stored with its state after this many scans, so that resuming translates fewer again.
    pub num_scans_per_checkpoint: u64,
    /// How an object store is used.
    pub object: ObjectStoreConfig,
}

/// How an object store is used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ObjectStoreConfig {
    /// Batches of a site wait up to this long for others to share their one write, seconds: longer is slower and cheaper.
    pub flush_interval_s: f64,
    /// Longest that anything waits for the store, seconds; then 503 is answered.
    pub patience_s: f64,
    /// Memory for blocks of all sites, bytes.
    pub cache_bytes: u64,
}

impl Default for ObjectStoreConfig {
    fn default() -> Self {
        Self { flush_interval_s: 0.5, patience_s: 20.0, cache_bytes: 256 << 20 }
    }
}

impl Default for StorageConfig {
    fn default() -> Self {
        Self {
            address: None,
            cache_bytes_per_site: 32 << 20,
            num_scans_per_checkpoint: 1_000,
            object: ObjectStoreConfig::default(),
        }
    }
}

/// Reads a table, or an address alone, which is short for a table with nothing else in it.
pub(super) fn address_or_table<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<StorageConfig, D::Error> {
    struct AddressOrTable;

    impl<'de> Visitor<'de> for AddressOrTable {
        type Value = StorageConfig;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("an address such as `s3://BUCKET/PREFIX`, or a table")
        }

        fn visit_str<E>(self, address: &str) -> Result<StorageConfig, E> {
            Ok(StorageConfig { address: Some(address.to_owned()), ..StorageConfig::default() })
        }

        fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<StorageConfig, A::Error> {
            StorageConfig::deserialize(MapAccessDeserializer::new(table))
        }
    }

    deserializer.deserialize_any(AddressOrTable)
}

impl StorageConfig {
    /// Bucket and prefix of an object store; nothing when the embedded storage is meant.
    pub fn bucket(&self) -> Option<(&str, &str)> {
        let (bucket, prefix) = self.address.as_deref()?.strip_prefix("s3://")?.split_once('/')?;
        let prefix = prefix.strip_suffix('/').unwrap_or(prefix);
        let is_segment = |segment: &str| {
            let is_allowed = |byte: u8| byte.is_ascii_alphanumeric() || b"._-".contains(&byte);
            !segment.is_empty() && !segment.starts_with('.') && segment.bytes().all(is_allowed)
        };
        (is_segment(bucket) && prefix.split('/').all(is_segment)).then_some((bucket, prefix))
    }

    pub(super) fn validate(&self) -> Result<(), ServerConfigError> {
        let invalid = |field: &str, problem: &str| {
            Err(ServerConfigError::Invalid { field: field.into(), problem: problem.into() })
        };
        if self.address.is_some() && self.bucket().is_none() {
            return invalid(
                "storage.address",
                "must be `s3://BUCKET/PREFIX`, of letters, digits and `. _ - /`; leave it out for the embedded storage",
            );
        }
        if self.address.is_some() && !cfg!(feature = "object-store") {
            return invalid("storage.address", "this program was built without the feature `object-store`");
        }
        if self.num_scans_per_checkpoint == 0 {
            return invalid("storage.num_scans_per_checkpoint", "must be at least 1");
        }
        if !(self.object.flush_interval_s >= 0.001 && self.object.flush_interval_s <= 10.0) {
            return invalid("storage.object.flush_interval_s", "must lie between 0.001 and 10 seconds");
        }
        if !(self.object.patience_s >= 1.0 && self.object.patience_s <= 300.0) {
            return invalid("storage.object.patience_s", "must lie between 1 and 300 seconds");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<StorageConfig, toml::de::Error> {
        toml::from_str::<super::super::ServerConfig>(text).map(|config| config.storage)
    }

    #[test]
    fn an_address_alone_is_short_for_a_table() {
        let short = read("storage = \"s3://maps/fleet/north/\"").unwrap();
        assert_eq!(short, read("[storage]\naddress = \"s3://maps/fleet/north/\"").unwrap());
        assert_eq!(short.bucket(), Some(("maps", "fleet/north")));
        assert_eq!(short.cache_bytes_per_site, StorageConfig::default().cache_bytes_per_site);
        let unknown = read("[storage]\naddres = \"s3://maps/fleet\"").unwrap_err();
        assert!(unknown.to_string().contains("addres"), "{unknown}");
    }

    #[test]
    fn what_names_no_bucket_and_prefix_is_refused() {
        let wrong = [
            "",
            "maps/fleet",
            "s3://",
            "s3://maps",
            "s3://maps/",
            "s3:///fleet",
            "file:///maps/fleet",
            "s3://maps/../fleet",
            "s3://maps/a//b",
            "s3://maps/a?b",
        ];
        for address in wrong {
            let config = StorageConfig { address: Some(address.into()), ..StorageConfig::default() };
            let error = config.validate().unwrap_err();
            assert!(error.to_string().contains("s3://BUCKET/PREFIX"), "{address}: {error}");
        }
    }
}
