//! What the server can be told: file < environment `LOCUTION_…` < flags, every value with a default that works.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use figment::Figment;
use figment::providers::{Env, Format, Serialized, Toml};
use serde::{Deserialize, Serialize};
use thiserror::Error;
use utoipa::ToSchema;

mod cluster;
mod storage;

pub use cluster::ClusterConfig;
pub use storage::{ObjectStoreConfig, StorageConfig};

/// Everything the server can be told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ServerConfig {
    /// Where to listen. Anything but a loopback address needs at least one key.
    pub address: SocketAddr,
    /// Directory of the embedded storage; made when missing. With an object store only keys made by the API are kept there.
    pub data_directory: PathBuf,
    /// Bounds on requests and queues.
    pub limits: LimitsConfig,
    /// Where everything is kept; `storage = "s3://BUCKET/PREFIX"` is short for `storage.address`.
    #[serde(deserialize_with = "storage::address_or_table")]
    pub storage: StorageConfig,
    /// The servers that share an object store.
    pub cluster: ClusterConfig,
    /// Background work.
    pub builds: BuildsConfig,
    /// What goes to the log.
    pub log: LogConfig,
    /// TLS; without it connections are plain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tls: Option<TlsConfig>,
    /// Browsers: other names of this server and pages from elsewhere.
    pub web: WebConfig,
    /// Who may do what. Without keys everything is allowed, but only from this machine.
    pub keys: Vec<ApiKeyConfig>,
}

impl Default for ServerConfig {
    fn default() -> Self {
        Self {
            address: SocketAddr::from(([127, 0, 0, 1], 7070)),
            data_directory: PathBuf::from("locution-data"),
            limits: LimitsConfig::default(),
            storage: StorageConfig::default(),
            cluster: ClusterConfig::default(),
            builds: BuildsConfig::default(),
            log: LogConfig::default(),
            tls: None,
            web: WebConfig::default(),
            keys: Vec::new(),
        }
    }
}

/// Bounds that keep memory and latency in hand; what exceeds them is refused with 413, 422, 429 or 503.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LimitsConfig {
    /// Largest request body with scans, after decompression, bytes.
    pub body_bytes_max: usize,
    /// Largest other request body, such as the configuration of a site, after decompression, bytes.
    pub small_body_bytes_max: usize,
    /// Memory for all bodies that are being received or waiting, bytes; more are refused with 503.
    pub received_bytes_max: usize,
    /// Memory for all bodies that are being read as JSON or CBOR, by their size at worst, bytes; more wait, then 503.
    pub parsed_bytes_max: usize,
    /// Share of places and memory that one key may hold; the rest is for the others. Without keys there are no shares.
    pub share_per_key_max: f64,
    /// Most connections; one more makes the one that gives least make way.
    pub num_connections_max: usize,
    /// Longest a connection may take to send the head of its next request, and so be idle, seconds.
    pub head_time_max_s: f64,
    /// Longest a body may come without a byte, or an answer not be taken, seconds.
    pub stall_max_s: f64,
    /// Longest a body may take to come, seconds.
    pub body_time_max_s: f64,
    /// How long requests under way may go on when the server stops, seconds.
    pub shutdown_s: f64,
    /// Most scans in one batch.
    pub num_scans_per_batch_max: usize,
    /// Most readings in one scan.
    pub num_ranges_per_scan_max: usize,
    /// Most runs in one site.
    pub num_runs_per_site_max: u32,
    /// Farthest the odometry may move from one scan to the next, metres, when there was no time for more; what goes beyond
    /// is a teleport and refused, but for odometry that begins at zero again.
    pub odometry_step_max_m: f64,
    /// Most requests being served at once; more are refused with 503.
    pub num_requests_max: usize,
    /// Most batches and examples waiting or being worked on at once; more are refused with 429. A place is taken when
    /// the body is there.
    pub num_batches_max: usize,
    /// Most batches of one run at once; more are refused with 429.
    pub num_batches_per_run_max: usize,
    /// Runs whose translator is kept in memory; the one longest idle makes way and is resumed from storage.
    pub num_open_runs_max: usize,
    /// Most localisations at once.
    #[serde(alias = "num_localisations_max")]
    pub num_localizations_max: usize,
    /// Memory for the indexes of the texts of all sites, bytes; those asked for least lately make way and are read again.
    pub text_index_bytes_max: usize,
    /// Most streams of events at once; more are refused with 429.
    pub num_event_streams_max: usize,
    /// Longest a request may take, seconds.
    pub request_timeout_s: u64,
}

impl Default for LimitsConfig {
    fn default() -> Self {
        Self {
            body_bytes_max: 16 << 20,
            small_body_bytes_max: 128 << 10,
            received_bytes_max: 128 << 20,
            parsed_bytes_max: 256 << 20,
            share_per_key_max: 0.5,
            num_connections_max: 512,
            head_time_max_s: 30.0,
            stall_max_s: 10.0,
            body_time_max_s: 120.0,
            shutdown_s: 5.0,
            num_scans_per_batch_max: 5_000,
            num_ranges_per_scan_max: 8_192,
            num_runs_per_site_max: 10_000,
            odometry_step_max_m: 5.0,
            num_requests_max: 512,
            num_batches_max: 32,
            num_batches_per_run_max: 4,
            num_open_runs_max: 256,
            num_localizations_max: 32,
            text_index_bytes_max: 256 << 20,
            num_event_streams_max: 64,
            request_timeout_s: 600,
        }
    }
}

/// Background work.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BuildsConfig {
    /// Build a site's map by itself when one of its runs finishes.
    pub is_automatic: bool,
    /// How long to wait for further runs to finish before an automatic build starts, seconds.
    pub settle_s: f64,
    /// Most builds at once, over all sites.
    pub num_builds_max: usize,
    /// How long a build may go on while builds of other sites wait, seconds; then it lets them pass and goes on when its
    /// turn comes again, for twice as long.
    pub turn_s: f64,
    /// Map versions kept per site, the serving one included.
    pub num_versions_kept: usize,
}

impl Default for BuildsConfig {
    fn default() -> Self {
        Self { is_automatic: true, settle_s: 2.0, num_builds_max: 2, turn_s: 5.0, num_versions_kept: 5 }
    }
}

/// What goes to the log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LogConfig {
    /// Directives such as `info` or `locution_server=debug`.
    pub filter: String,
    /// One JSON object a line instead of text.
    pub is_json: bool,
}

impl Default for LogConfig {
    fn default() -> Self {
        Self { filter: "info".into(), is_json: false }
    }
}

/// What a key may do; each scope includes those before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum Scope {
    /// Look, query, localise.
    #[default]
    Read,
    /// Also send runs, build maps and decide on matches.
    Write,
    /// Also make and delete sites.
    Admin,
}

impl Scope {
    /// As the configuration and the document spell it.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Read => "read",
            Self::Write => "write",
            Self::Admin => "admin",
        }
    }
}

/// An API key, known by its hash only.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ApiKeyConfig {
    /// For the log.
    pub name: String,
    /// SHA-256 of the key, 64 hexadecimal digits.
    pub sha256: String,
    /// What it may do.
    pub scope: Scope,
    /// Sites it may do it in; `*` means all.
    pub sites: Vec<String>,
    /// When it stops being valid, seconds since 1970; never unless said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expires_at_s: Option<u64>,
    /// Most requests in a second, on average; no limit of its own unless said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub requests_per_s_max: Option<f64>,
    /// Most localisations at once; no limit of its own unless said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub num_localizations_max: Option<usize>,
}

/// Where the certificate of TLS and its key are, as PEM; both are read again on SIGHUP.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TlsConfig {
    /// The certificate, and behind it those that vouch for it.
    pub certificate: PathBuf,
    /// The private key.
    pub key: PathBuf,
}

/// What browsers may do. A server without keys answers only requests that name this machine as `Host` and come from no
/// other `Origin`; both lists let in more.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WebConfig {
    /// Further names or addresses, without port, by which a server without keys may be called.
    pub hosts: Vec<String>,
    /// Origins such as `https://fleet.example` whose pages may use the API (CORS).
    pub origins: Vec<String>,
}

/// A configuration that the server cannot start with.
#[derive(Debug, Error)]
pub enum ServerConfigError {
    /// A file, variable or flag could not be read as configuration.
    #[error("{0}")]
    Unreadable(Box<figment::Error>),
    /// A value cannot work.
    #[error("{field}: {problem}")]
    Invalid {
        /// Path of the value.
        field: String,
        /// What is wrong with it.
        problem: String,
    },
}

impl ServerConfig {
    /// Lays the file (when given), the environment and the flags over the defaults.
    ///
    /// Variables are named after the fields, `__` between levels: `LOCUTION_LIMITS__NUM_BATCHES_MAX=8`.
    ///
    /// # Errors
    /// The first value that cannot be read, naming its source, or that cannot work.
    pub fn load(file: Option<&Path>, flags: &impl Serialize) -> Result<Self, ServerConfigError> {
        let mut figment = Figment::from(Serialized::defaults(ServerConfig::default()));
        if let Some(file) = file {
            figment = figment.merge(Toml::file_exact(file));
        }
        let config: ServerConfig = figment
            .merge(environment())
            .merge(Serialized::defaults(flags))
            .extract()
            .map_err(|error| ServerConfigError::Unreadable(Box::new(error)))?;
        config.validate()?;
        Ok(config)
    }

    /// Checks every value.
    ///
    /// # Errors
    /// The first value that cannot work, by its path.
    pub fn validate(&self) -> Result<(), ServerConfigError> {
        let invalid = |field: &str, problem: &str| {
            Err(ServerConfigError::Invalid { field: field.into(), problem: problem.into() })
        };
        let limits = &self.limits;
        let positive = [
            ("limits.body_bytes_max", limits.body_bytes_max),
            ("limits.small_body_bytes_max", limits.small_body_bytes_max),
            ("limits.received_bytes_max", limits.received_bytes_max),
            ("limits.parsed_bytes_max", limits.parsed_bytes_max),
            ("limits.num_connections_max", limits.num_connections_max),
            ("limits.num_scans_per_batch_max", limits.num_scans_per_batch_max),
            ("limits.num_ranges_per_scan_max", limits.num_ranges_per_scan_max),
            ("limits.num_requests_max", limits.num_requests_max),
            ("limits.num_batches_max", limits.num_batches_max),
            ("limits.num_batches_per_run_max", limits.num_batches_per_run_max),
            ("limits.num_open_runs_max", limits.num_open_runs_max),
            ("builds.num_builds_max", self.builds.num_builds_max),
            ("builds.num_versions_kept", self.builds.num_versions_kept),
        ];
        for (field, value) in positive {
            if value == 0 {
                return invalid(field, "must be at least 1");
            }
        }
        let durations = [
            ("limits.head_time_max_s", limits.head_time_max_s),
            ("limits.stall_max_s", limits.stall_max_s),
            ("limits.body_time_max_s", limits.body_time_max_s),
            ("limits.shutdown_s", limits.shutdown_s),
        ];
        for (field, value) in durations {
            if !(value > 0.0 && value <= 86_400.0) {
                return invalid(field, "must lie above 0 and at most at 86400 seconds");
            }
        }
        if !(limits.share_per_key_max > 0.0 && limits.share_per_key_max <= 1.0) {
            return invalid("limits.share_per_key_max", "must lie above 0 and at most at 1");
        }
        if limits.num_ranges_per_scan_max > 65_536 {
            return invalid("limits.num_ranges_per_scan_max", "must be at most 65536");
        }
        self.storage.validate()?;
        self.cluster.validate(self)?;
        if !(limits.odometry_step_max_m > 0.0 && limits.odometry_step_max_m.is_finite()) {
            return invalid("limits.odometry_step_max_m", "must be a positive number of metres");
        }
        if !(self.builds.settle_s >= 0.0 && self.builds.settle_s <= 86_400.0) {
            return invalid("builds.settle_s", "must lie between 0 and 86400 seconds");
        }
        if !(self.builds.turn_s > 0.0 && self.builds.turn_s <= 86_400.0) {
            return invalid("builds.turn_s", "must lie above 0 and at most at 86400 seconds");
        }
        for (idx, origin) in self.web.origins.iter().enumerate() {
            let is_origin = origin.split_once("://").is_some_and(|(scheme, host)| {
                ["http", "https"].contains(&scheme) && !host.is_empty() && !host.contains(['/', '*', ' '])
            });
            if !is_origin {
                return invalid(
                    &format!("web.origins[{idx}]"),
                    "must be like `https://host:port`, nothing behind",
                );
            }
        }
        for (idx, key) in self.keys.iter().enumerate() {
            if key.sha256.len() != 64 || !key.sha256.bytes().all(|byte| byte.is_ascii_hexdigit()) {
                return invalid(&format!("keys[{idx}].sha256"), "must be 64 hexadecimal digits");
            }
            if key.requests_per_s_max.is_some_and(|rate| !(rate > 0.0 && rate <= 1e6)) {
                return invalid(
                    &format!("keys[{idx}].requests_per_s_max"),
                    "must lie above 0 and at most at 1e6",
                );
            }
        }
        Ok(())
    }
}

/// Variables that begin with the name of a field. Others of the prefix belong to other tools, such as the tests.
fn environment() -> Env {
    const FIELDS: [&str; 10] =
        ["address", "data_directory", "limits", "storage", "cluster", "builds", "log", "tls", "web", "keys"];
    let is_ours = |key: &figment::value::UncasedStr| {
        let key = key.as_str().to_ascii_lowercase();
        FIELDS.iter().any(|field| key == *field || key.starts_with(&format!("{field}__")))
    };
    Env::prefixed("LOCUTION_").filter(is_ours).split("__")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_work_and_survive_printing() {
        let config = ServerConfig::default();
        config.validate().unwrap();
        let printed = toml::to_string(&config).unwrap();
        assert_eq!(toml::from_str::<ServerConfig>(&printed).unwrap(), config);
    }

    #[test]
    fn flags_win_over_the_file() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), "address = \"127.0.0.1:1\"\n[limits]\nnum_batches_max = 3\n").unwrap();
        let flags = serde_json::json!({"address": "127.0.0.1:2"});
        let config = ServerConfig::load(Some(file.path()), &flags).unwrap();
        assert_eq!(config.address.port(), 2);
        assert_eq!(config.limits.num_batches_max, 3);
    }

    #[test]
    fn unknown_fields_are_named() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), "[limits]\nnum_bathces_max = 3\n").unwrap();
        let error = ServerConfig::load(Some(file.path()), &serde_json::json!({})).unwrap_err();
        assert!(error.to_string().contains("num_bathces_max"), "{error}");
    }
}
