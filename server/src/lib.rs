//! The Locution server: HTTP in front of the engine, with storage underneath.
//!
//! ```text
//! router ─► handlers ─► dto (checks) ─► app (use cases) ─► engine (pure) and storage (ordered bytes)
//! ```
//!
//! [`start_server`] puts the parts together; the command line and every test call it.
#![cfg_attr(test, allow(clippy::unwrap_used))]

use std::net::SocketAddr;
use std::sync::{Arc, OnceLock};

use axum::serve::ListenerExt;
use metrics_exporter_prometheus::{Matcher, PrometheusBuilder, PrometheusHandle};
use thiserror::Error;
use tokio::net::TcpListener;
use tokio::sync::watch;
use tokio::task::JoinHandle;

mod app;
mod auth;
pub mod config;
mod dto;
mod error;
mod extract;
mod handlers;
pub mod openapi;
mod picture;
mod records;
mod router;
mod state;
mod storage;

use app::App;
use config::{ServerConfig, ServerConfigError};
use state::AppState;
use storage::{SledConfig, SledStorage, StorageError};

/// Why a server did not start.
#[derive(Debug, Error)]
pub enum StartError {
    /// The configuration cannot work.
    #[error(transparent)]
    Config(#[from] ServerConfigError),
    /// The data directory cannot be used.
    #[error("the data directory cannot be used")]
    Storage(#[from] StorageError),
    /// The address cannot be listened on.
    #[error("cannot listen on {address}")]
    Listen {
        /// The address of the configuration.
        address: SocketAddr,
        /// What the system said.
        source: std::io::Error,
    },
    /// The use cases could not take up their work.
    #[error(transparent)]
    App(#[from] app::AppError),
}

/// A server that listens.
pub struct RunningServer {
    address: SocketAddr,
    app: Arc<App>,
    stop: watch::Sender<bool>,
    serving: JoinHandle<std::io::Result<()>>,
}

impl RunningServer {
    /// Where it listens, with the port that the system chose.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The base of its URLs.
    pub fn url(&self) -> String {
        format!("http://{}", self.address)
    }

    /// Takes no more requests, finishes those under way and closes the storage.
    ///
    /// # Errors
    /// [`StartError::App`] when the storage could not be closed; everything acknowledged is durable anyway.
    pub async fn shutdown(self) -> Result<(), StartError> {
        let _ = self.stop.send(true);
        if let Ok(Err(error)) = self.serving.await {
            tracing::warn!(%error, "the listener ended badly");
        }
        Ok(self.app.close().await?)
    }
}

/// Starts a server; it serves in background tasks of the current runtime until shut down.
///
/// # Errors
/// See [`StartError`].
pub async fn start_server(config: ServerConfig) -> Result<RunningServer, StartError> {
    config.validate()?;
    let storage = SledStorage::new(SledConfig {
        directory: config.data_directory.clone(),
        cache_bytes_per_site: config.storage.cache_bytes_per_site,
    })?;
    let listen = |source| StartError::Listen { address: config.address, source };
    let listener = TcpListener::bind(config.address).await.map_err(listen)?;
    let address = listener.local_addr().map_err(listen)?;
    let app = Arc::new(App::new(config.clone(), Arc::new(storage)));
    app.resume().await?;
    let state = AppState {
        app: Arc::clone(&app),
        keys: Arc::new(auth::Keys::new(&config.keys)),
        metrics: metrics_handle(),
    };
    let (stop, mut stopped) = watch::channel(false);
    let service = router::build_router(state);
    // Small answers must not wait for the acknowledgement of the ones before.
    let listener = listener.tap_io(|stream| {
        let _ = stream.set_nodelay(true);
    });
    let serving = tokio::spawn(async move {
        let until_stopped = async move {
            let _ = stopped.wait_for(|is_stopped| *is_stopped).await;
        };
        axum::serve(listener, service).with_graceful_shutdown(until_stopped).await
    });
    tracing::info!(%address, data_directory = %config.data_directory.display(), "listening");
    Ok(RunningServer { address, app, stop, serving })
}

/// The process has one recorder; servers in one process, as in tests, share it.
fn metrics_handle() -> PrometheusHandle {
    static HANDLE: OnceLock<PrometheusHandle> = OnceLock::new();
    let install = || {
        let buckets = [0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0];
        let recorder = PrometheusBuilder::new()
            .set_buckets_for_metric(Matcher::Suffix("_seconds".into()), &buckets)
            .expect("the list of buckets is not empty")
            .build_recorder();
        let handle = recorder.handle();
        if metrics::set_global_recorder(recorder).is_err() {
            tracing::warn!("another metrics recorder is installed; /metrics will stay empty");
        }
        handle
    };
    HANDLE.get_or_init(install).clone()
}
