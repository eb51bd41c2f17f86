//! Clients that stop sending hold up nobody, and not the end of the server either.

use std::time::{Duration, Instant};

use locution_server::config::ServerConfig;
use locution_tests::{TestServer, drive};
use serde_json::json;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

const HALF_A_BATCH: &[u8] = b"POST /v1/sites/s/runs/r/batches HTTP/1.1\r\nHost: localhost\r\n\
    Content-Type: application/json\r\nContent-Length: 100000\r\n\r\n{";

fn hurried(config: &mut ServerConfig) {
    config.limits.head_time_max_s = 1.0;
    config.limits.stall_max_s = 1.0;
    config.limits.shutdown_s = 1.0;
}

async fn connect(server: &TestServer) -> TcpStream {
    TcpStream::connect(server.api.base.trim_start_matches("http://")).await.unwrap()
}

/// Sends the same on many connections of their own.
async fn open_many(server: &TestServer, num: usize, bytes: &[u8]) -> Vec<TcpStream> {
    let mut streams = Vec::new();
    for _ in 0..num {
        let mut stream = connect(server).await;
        stream.write_all(bytes).await.unwrap();
        streams.push(stream);
    }
    streams
}

/// What comes until the server closes the connection.
async fn rest(mut stream: TcpStream) -> String {
    let mut bytes = Vec::new();
    let reading = tokio::time::timeout(Duration::from_secs(20), stream.read_to_end(&mut bytes));
    let _ = reading.await.expect("the connection stays open");
    String::from_utf8_lossy(&bytes).into_owned()
}

#[tokio::test(flavor = "multi_thread")]
async fn bodies_that_stall_take_no_place_and_are_given_up() {
    let server = TestServer::start_with(|config| {
        hurried(config);
        config.limits.stall_max_s = 5.0;
        config.limits.num_batches_max = 2;
        config.limits.num_requests_max = 4;
    })
    .await;
    server.api.make_run("s", "r").await;
    let scans = drive(40, 1);
    let stalled = open_many(&server, 32, HALF_A_BATCH).await;
    for first in (0..40).step_by(10) {
        server.api.post_batch("s", "r", first, &scans[first..first + 10]).await.ok();
    }
    for stream in stalled {
        let answer = rest(stream).await;
        assert!(answer.starts_with("HTTP/1.1 408"), "{answer}");
        assert!(answer.contains("problems/too-slow"), "{answer}");
    }
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn heads_that_stall_and_idle_connections_are_closed() {
    let server = TestServer::start_with(hurried).await;
    let started = Instant::now();
    let mut idle = connect(&server).await;
    idle.write_all(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n").await.unwrap();
    let mut streams = open_many(&server, 20, b"GET /healthz HTTP/1.1\r\nHost: ").await;
    streams.extend(open_many(&server, 5, b"").await);
    for stream in streams {
        let answer = rest(stream).await;
        assert!(answer.is_empty() || answer.starts_with("HTTP/1.1 408"), "{answer}");
    }
    assert!(rest(idle).await.starts_with("HTTP/1.1 200"));
    assert!(started.elapsed() < Duration::from_secs(15));
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn health_and_metrics_answer_whatever_holds_the_places() {
    let server = TestServer::start_with(|config| {
        hurried(config);
        config.limits.stall_max_s = 30.0;
        config.limits.head_time_max_s = 30.0;
        config.limits.num_connections_max = 40;
    })
    .await;
    server.api.make_run("s", "r").await;
    let _heads = open_many(&server, 50, b"GET /").await;
    let _bodies = open_many(&server, 50, HALF_A_BATCH).await;
    for path in ["/healthz", "/readyz", "/metrics"] {
        let answer = server.api.get(path).await;
        assert_eq!(answer.status, 200, "{path}");
    }
    server.api.post_batch("s", "r", 0, &drive(5, 1)).await.ok();
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_server_ends_in_time_and_keeps_what_it_accepted() {
    let server = TestServer::start_with(hurried).await;
    for (run, seed) in [("r1", 1), ("r2", 2), ("r3", 3)] {
        server.api.make_run("s", run).await;
        server.api.post_all("s", run, &drive(900, seed), 300).await;
    }
    let job = server.api.post("/v1/sites/s/builds", &json!({})).await.ok();
    let _half = open_many(&server, 3, HALF_A_BATCH).await;
    let _head = open_many(&server, 3, b"GET /").await;
    let started = Instant::now();
    let server =
        tokio::time::timeout(Duration::from_secs(10), server.restart()).await.expect("it does not end");
    println!("stopped and started again within {:?}", started.elapsed());
    for run in ["r1", "r2", "r3"] {
        assert_eq!(server.api.get(&format!("/v1/sites/s/runs/{run}")).await.ok()["num_scans"], 900);
    }
    // The interrupted build is begun anew, and being interrupted by an orderly end is no failed attempt.
    let path = format!("/v1/sites/s/jobs/{}", job["id"]);
    let deadline = Instant::now() + Duration::from_secs(120);
    while server.api.get(&path).await.ok()["state"] != "done" {
        assert!(Instant::now() < deadline);
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
    server.stop().await;
}
