//! Several servers over one object store: who lives, who serves which site, and how a request gets there.
//!
//! ```text
//! members    every server renews one small object; whoever stopped is gone; a site has one server or none
//! placement  a site belongs to the living server with the highest hash of (site, server)
//! forward    a request on its way to another server
//! everywhere what is asked of the others: one request passed on, or a question put to all their sites
//! ```
//!
//! There is no other coordination service. No acknowledged scan depends on this room: the storage fences whoever
//! writes to a site that another server has opened.

mod everywhere;
mod forward;
mod members;
mod placement;
#[cfg(test)]
mod tests;

use std::sync::Arc;
use std::time::Duration;

use futures::FutureExt;
use object_store::ObjectStore;
use object_store::path::Path;
use rand::TryRng;
use rand::rngs::SysRng;
use tokio::sync::Semaphore;
use tokio_rustls::rustls::crypto::ring;
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

use members::Members;

use crate::app::{App, AppError};
use crate::config::{LimitsConfig, ServerConfig};
use crate::elsewhere::Elsewhere;

/// Letting go of sites is waited for so long; their handles have ended by then in any case.
const LET_GO_MAX: Duration = Duration::from_secs(1);
/// A server that does not take a connection within this time is not there.
const CONNECT_MAX: Duration = Duration::from_secs(2);

/// The servers of one store, seen from one of them.
pub struct Cluster {
    members: Members,
    client: reqwest::Client,
    /// Requests that may be passed on at once.
    places: Semaphore,
    background: TaskTracker,
    stop: CancellationToken,
}

impl Cluster {
    /// A server that others reach at `url`.
    ///
    /// # Errors
    /// [`AppError::Internal`] without randomness, or when no client can be made.
    pub fn new(
        store: Arc<dyn ObjectStore>,
        prefix: &Path,
        url: String,
        config: &ServerConfig,
    ) -> Result<Arc<Self>, AppError> {
        let me = format!("{:016x}", SysRng.try_next_u64().map_err(AppError::internal)?);
        let lease = Duration::from_secs_f64(config.cluster.lease_s);
        Ok(Arc::new(Self {
            members: Members::new(store, prefix, me, url, lease),
            client: client(&config.limits)?,
            places: Semaphore::new(config.limits.num_requests_max),
            background: TaskTracker::new(),
            stop: CancellationToken::new(),
        }))
    }

    /// Takes part until it leaves: renews, lets go of sites that others serve, opens those that it has gained.
    pub fn take_part(self: &Arc<Self>, app: &Arc<App>) {
        let (cluster, app) = (Arc::clone(self), Arc::clone(app));
        self.background.spawn(async move {
            let mut was_settled = false;
            loop {
                cluster.renew(&app).await;
                let is_settled = cluster.members.is_settled();
                if !(was_settled && is_settled) {
                    let app = Arc::clone(&app);
                    // Opening may take longer than a round.
                    cluster.background.spawn(async move {
                        if let Err(error) = app.resume().await {
                            tracing::warn!(%error, "sites that came to this server are not open yet");
                        }
                    });
                }
                was_settled = is_settled;
                tokio::select! {
                    () = tokio::time::sleep(cluster.members.interval()) => {}
                    () = cluster.stop.cancelled() => break,
                }
            }
        });
    }

    /// One round, which does not wait for the store longer than half of the time that others wait for this server.
    async fn renew(&self, app: &App) {
        let let_go = || {
            let gone = app.let_go(|site| self.serves(site));
            let bounded = async move {
                if tokio::time::timeout(LET_GO_MAX, gone).await.is_err() {
                    tracing::warn!("sites that moved away are still being closed");
                }
            };
            bounded.boxed()
        };
        let patience = self.members.lease() / 2;
        match tokio::time::timeout(patience, self.members.renew(let_go)).await {
            Ok(Ok(())) => {}
            Ok(Err(error)) => tracing::warn!(%error, "this server could not renew its lease"),
            Err(_) => tracing::warn!("the object store is too slow to renew the lease of this server"),
        }
    }

    /// Takes part no more without a word, as one that was killed.
    #[cfg(test)]
    pub fn fall_silent(&self) {
        self.stop.cancel();
    }

    /// Says goodbye; to be called once requests have ended and sites are closed.
    pub async fn leave(&self) {
        self.stop.cancel();
        self.background.close();
        let ended = tokio::time::timeout(CONNECT_MAX, self.background.wait()).await;
        if ended.is_err() || tokio::time::timeout(CONNECT_MAX, self.members.leave()).await.is_err() {
            tracing::warn!(
                "the object store is away; the others will notice by the lease that this server has left"
            );
        }
    }
}

fn client(limits: &LimitsConfig) -> Result<reqwest::Client, AppError> {
    // Clients take the provider of the process; whoever set one before has chosen the same.
    let _ = ring::default_provider().install_default();
    reqwest::Client::builder()
        .connect_timeout(CONNECT_MAX)
        .read_timeout(Duration::from_secs(limits.request_timeout_s))
        .redirect(reqwest::redirect::Policy::none())
        .no_gzip()
        .no_proxy()
        .build()
        .map_err(AppError::internal)
}
