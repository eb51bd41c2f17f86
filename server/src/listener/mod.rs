//! Connections: accepted up to a number, given up when they do not send, ended in order when the server stops.
//!
//! Requests run on the router; what a connection is doing meanwhile (waiting for a head, receiving a body, working) is
//! kept in [`Connection`], so that the one that gives the least makes way when there is no room for another.

mod connection;
mod stall;
mod tls;

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::extract::Request;
use axum::response::Response;
use hyper::body::Incoming;
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use hyper_util::server::conn::auto;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use tower::ServiceExt;

pub use connection::Connection;
use connection::{Connections, Place};
use stall::GivesUpOnStalls;
pub use tls::Certificate;

use crate::config::LimitsConfig;

/// Largest head of a request, bytes.
const HEAD_BYTES_MAX: usize = 64 << 10;
/// Most requests at once on one connection of HTTP/2.
const NUM_STREAMS_MAX: u32 = 64;
/// How long to wait before accepting again when the system has no room for another connection.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Serves until `stop`, then lets requests under way end for a while, and returns when every connection is gone.
pub async fn serve(
    tcp: TcpListener,
    certificate: Option<Arc<Certificate>>,
    router: Router,
    limits: LimitsConfig,
    stop: CancellationToken,
) {
    let connections = Arc::new(Connections::new(limits.num_connections_max));
    let tasks = TaskTracker::new();
    loop {
        let accepted = tokio::select! {
            accepted = tcp.accept() => accepted,
            () = stop.cancelled() => break,
        };
        match accepted {
            Ok((stream, _)) => {
                // Small answers must not wait for the acknowledgement of the ones before.
                let _ = stream.set_nodelay(true);
                let Some(place) = connections.admit() else { continue };
                let serving = Serving { place, router: router.clone(), stop: stop.clone() };
                let (limits, certificate) = (limits.clone(), certificate.clone());
                tasks.spawn(async move { serving.greet(stream, certificate, &limits).await });
            }
            Err(error) => {
                tracing::warn!(%error, "a connection could not be accepted");
                tokio::time::sleep(ACCEPT_PAUSE).await;
            }
        }
    }
    drop(tcp);
    tasks.close();
    let patience = Duration::from_secs_f64(limits.shutdown_s);
    if tokio::time::timeout(patience, tasks.wait()).await.is_err() {
        tracing::warn!("connections that did not end in time are closed");
        connections.end_all();
        tasks.wait().await;
    }
}

/// One connection with what it needs.
struct Serving {
    place: Place,
    router: Router,
    stop: CancellationToken,
}

impl Serving {
    /// Agrees on a cipher first where there is a certificate.
    async fn greet(self, stream: TcpStream, certificate: Option<Arc<Certificate>>, limits: &LimitsConfig) {
        let Some(certificate) = certificate else { return self.run(stream, limits).await };
        let connection = Arc::clone(self.place.connection());
        let greeted = tokio::select! {
            greeted = certificate.accept(stream) => greeted,
            () = connection.ended() => return,
            () = connection.quiet_for(Duration::from_secs_f64(limits.head_time_max_s)) => return,
            () = self.stop.cancelled() => return,
        };
        match greeted {
            Ok(stream) => self.run(stream, limits).await,
            Err(error) => tracing::debug!(%error, "a client did not greet as TLS does"),
        }
    }

    async fn run<S: AsyncRead + AsyncWrite + Send + Unpin + 'static>(self, stream: S, limits: &LimitsConfig) {
        let head_time_max = Duration::from_secs_f64(limits.head_time_max_s);
        let stall_max = Duration::from_secs_f64(limits.stall_max_s);
        let mut protocol = auto::Builder::new(TokioExecutor::new());
        protocol
            .http1()
            .timer(TokioTimer::new())
            .header_read_timeout(head_time_max)
            .max_buf_size(HEAD_BYTES_MAX);
        protocol
            .http2()
            .timer(TokioTimer::new())
            .max_concurrent_streams(NUM_STREAMS_MAX)
            .max_header_list_size(HEAD_BYTES_MAX as u32)
            .keep_alive_interval(stall_max)
            .keep_alive_timeout(stall_max);
        let connection = Arc::clone(self.place.connection());
        let (answering, router) = (Arc::clone(&connection), self.router);
        let service = hyper::service::service_fn(move |request| answer(&answering, &router, request));
        let io = TokioIo::new(GivesUpOnStalls::new(stream, stall_max));
        let mut serving = std::pin::pin!(protocol.serve_connection(io, service));
        let mut is_stopping = false;
        loop {
            tokio::select! {
                ended = serving.as_mut() => {
                    if let Err(error) = ended {
                        tracing::debug!(%error, "a connection ended badly");
                    }
                    break;
                }
                () = connection.ended() => break,
                () = connection.quiet_for(head_time_max) => break,
                () = self.stop.cancelled(), if !is_stopping => {
                    is_stopping = true;
                    serving.as_mut().graceful_shutdown();
                }
            }
        }
    }
}

/// Hands a request to the router; the connection counts as busy until the last byte of the answer is sent.
fn answer(
    connection: &Arc<Connection>,
    router: &Router,
    request: hyper::Request<Incoming>,
) -> impl Future<Output = Result<Response, Infallible>> + use<> {
    let busy = connection.begin();
    let mut request: Request = request.map(Body::new);
    request.extensions_mut().insert(Arc::clone(connection));
    let router = router.clone();
    async move {
        let response = router.oneshot(request).await.unwrap_or_else(|never| match never {});
        Ok(response.map(|body| Body::new(busy.until_sent(body))))
    }
}
