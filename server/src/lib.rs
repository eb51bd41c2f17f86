//! The Locution server: HTTP in front of the engine, with storage underneath.
//!
//! ```text
//! http (routes, checks) ─► app (use cases) ─► engine (pure) and storage (ordered bytes)
//! ```
//!
//! [`start_server`] puts the parts together; the command line and every test call it.
#![cfg_attr(test, allow(clippy::unwrap_used))]

use std::net::SocketAddr;
use std::sync::Arc;

use thiserror::Error;
use tokio::net::TcpListener;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

mod app;
mod auth;
#[cfg(feature = "object-store")]
mod cluster;
pub mod config;
mod elsewhere;
mod error;
mod extract;
mod http;
mod intake;
mod listener;
mod observe;
mod picture;
mod records;
mod router;
mod state;
mod storage;
mod telemetry;
pub mod upkeep;

pub use http::openapi::document_json;
pub use telemetry::names as metric_names;

use app::App;
use auth::Gate;
use config::{ServerConfig, ServerConfigError};
use elsewhere::Elsewhere;
use intake::Places;
use listener::Certificate;
use state::AppState;
use storage::{SledConfig, SledStorage, Storage, StorageError};

/// Why a server did not start.
#[derive(Debug, Error)]
pub enum StartError {
    /// The configuration cannot work.
    #[error(transparent)]
    Config(#[from] ServerConfigError),
    /// The data directory or the object store cannot be used.
    #[error("the storage cannot be used")]
    Storage(#[from] StorageError),
    /// The address cannot be listened on.
    #[error("cannot listen on {address}")]
    Listen {
        /// The address of the configuration.
        address: SocketAddr,
        /// What the system said.
        source: std::io::Error,
    },
    /// The certificate or its key cannot be used.
    #[error("tls: {0}")]
    Tls(String),
    /// The use cases could not take up their work.
    #[error(transparent)]
    App(#[from] app::AppError),
}

/// A server that listens.
pub struct RunningServer {
    address: SocketAddr,
    app: Arc<App>,
    gate: Arc<Gate>,
    certificate: Option<Arc<Certificate>>,
    #[cfg(feature = "object-store")]
    cluster: Option<Arc<cluster::Cluster>>,
    stop: CancellationToken,
    serving: JoinHandle<()>,
}

impl RunningServer {
    /// Where it listens, with the port that the system chose.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The base of its URLs.
    pub fn url(&self) -> String {
        let scheme = if self.certificate.is_some() { "https" } else { "http" };
        format!("{scheme}://{}", self.address)
    }

    /// Takes the keys of another configuration, and reads certificates again. The rest of a configuration needs a restart.
    ///
    /// # Errors
    /// [`StartError::Tls`]; then the certificate before stays, and the keys are those of the new configuration.
    pub fn reload(&self, config: &ServerConfig) -> Result<(), StartError> {
        self.gate.keys.configure(&config.keys);
        tracing::info!(target: "locution::audit", event = "keys read again", num_keys = config.keys.len());
        match (&self.certificate, &config.tls) {
            (Some(certificate), Some(tls)) => certificate.reload(tls).map_err(StartError::Tls),
            _ => Ok(()),
        }
    }

    /// Takes no more requests, finishes those under way and closes the storage.
    ///
    /// # Errors
    /// [`StartError::App`] when the storage could not be closed; everything acknowledged is durable anyway.
    pub async fn shutdown(self) -> Result<(), StartError> {
        self.app.stop_jobs();
        self.stop.cancel();
        if let Err(error) = self.serving.await {
            tracing::error!(%error, "the listener ended badly");
        }
        let closed = self.app.close().await;
        #[cfg(feature = "object-store")]
        if let Some(cluster) = self.cluster {
            cluster.leave().await;
        }
        Ok(closed?)
    }
}

#[cfg(all(test, feature = "object-store"))]
impl RunningServer {
    /// Answers nobody any more and says no goodbye, as one that was killed or cut off.
    fn kill(self) {
        self.stop.cancel();
        self.serving.abort();
        if let Some(cluster) = &self.cluster {
            cluster.fall_silent();
        }
    }
}

/// Starts a server; it serves in background tasks of the current runtime until shut down.
///
/// # Errors
/// See [`StartError`].
pub async fn start_server(config: ServerConfig) -> Result<RunningServer, StartError> {
    config.validate()?;
    let opened = Opened::of(&config).await?;
    start_on(config, opened).await
}

/// Starts a server on a storage that is open.
async fn start_on(config: ServerConfig, opened: Opened) -> Result<RunningServer, StartError> {
    let keys = auth::Keys::open(&config.keys, &config.data_directory)?;
    if !config.address.ip().is_loopback() && keys.is_empty() {
        let problem =
            "listening beyond this machine needs a key: an entry in `keys`, or one made by the API".into();
        return Err(ServerConfigError::Invalid { field: "address".into(), problem }.into());
    }
    let listen = |source| StartError::Listen { address: config.address, source };
    let listener = TcpListener::bind(config.address).await.map_err(listen)?;
    let address = listener.local_addr().map_err(listen)?;
    let app = Arc::new(App::new(config.clone(), opened.storage));
    let certificate = config.tls.as_ref().map(Certificate::read).transpose().map_err(StartError::Tls)?;
    let certificate = certificate.map(Arc::new);
    let elsewhere: Option<Arc<dyn Elsewhere>> = None;
    #[cfg(feature = "object-store")]
    let (cluster, elsewhere) = match opened.shared {
        Some((store, prefix)) => {
            let scheme = if certificate.is_some() { "https" } else { "http" };
            let url = config.cluster.url.clone().unwrap_or_else(|| format!("{scheme}://{address}"));
            let cluster = cluster::Cluster::new(store, &prefix, url, &config)?;
            (Some(Arc::clone(&cluster)), Some(cluster as Arc<dyn Elsewhere>))
        }
        None => (None, elsewhere),
    };
    match &elsewhere {
        Some(elsewhere) => {
            let elsewhere = Arc::clone(elsewhere);
            app.share(move |site| elsewhere.serves(site));
        }
        None => app.resume().await?,
    }
    let gate = Arc::new(Gate { keys, callers: auth::LocalCallers::new(&config.web) });
    let state = AppState {
        app: Arc::clone(&app),
        gate: Arc::clone(&gate),
        elsewhere,
        places: Arc::new(Places::new(&config.limits)),
        metrics: telemetry::handle(),
    };
    let stop = CancellationToken::new();
    let router = router::build_router(state);
    let serving = tokio::spawn(listener::serve(
        listener,
        certificate.clone(),
        router,
        config.limits.clone(),
        stop.clone(),
    ));
    let place = config.storage.address.clone().unwrap_or_else(|| config.data_directory.display().to_string());
    tracing::info!(%address, storage = place, "listening");
    #[cfg(feature = "object-store")]
    if let Some(cluster) = &cluster {
        cluster.take_part(&app);
    }
    Ok(RunningServer {
        address,
        app,
        gate,
        certificate,
        #[cfg(feature = "object-store")]
        cluster,
        stop,
        serving,
    })
}

/// The storage that the configuration names.
struct Opened {
    storage: Arc<dyn Storage>,
    /// What it shares with other servers.
    #[cfg(feature = "object-store")]
    shared: Option<(Arc<dyn object_store::ObjectStore>, object_store::path::Path)>,
}

impl Opened {
    async fn of(config: &ServerConfig) -> Result<Self, StorageError> {
        #[cfg(feature = "object-store")]
        if let Some((bucket, prefix)) = config.storage.bucket() {
            let (store, prefix) = storage::object::store_at(bucket, prefix)?;
            return Self::over(store, prefix, config).await;
        }
        let directory = config.data_directory.clone();
        let cache_bytes_per_site = config.storage.cache_bytes_per_site;
        Ok(Self {
            storage: Arc::new(SledStorage::new(SledConfig { directory, cache_bytes_per_site })?),
            #[cfg(feature = "object-store")]
            shared: None,
        })
    }

    #[cfg(feature = "object-store")]
    async fn over(
        store: Arc<dyn object_store::ObjectStore>,
        prefix: object_store::path::Path,
        config: &ServerConfig,
    ) -> Result<Self, StorageError> {
        use std::time::Duration;

        use storage::object::{ObjectConfig, ObjectStorage};
        let settings = &config.storage.object;
        let settings = ObjectConfig {
            flush_interval: Duration::from_secs_f64(settings.flush_interval_s),
            patience: Duration::from_secs_f64(settings.patience_s),
            cache_bytes: settings.cache_bytes,
        };
        let storage = ObjectStorage::connect(Arc::clone(&store), prefix.clone(), settings).await?;
        Ok(Self { storage: Arc::new(storage), shared: Some((store, prefix)) })
    }
}
