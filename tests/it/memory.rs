//! Bodies made to fill the server's memory are refused before they do, and refusals echo little of them.

use std::io::Write;
use std::sync::Arc;

use flate2::Compression;
use flate2::write::GzEncoder;
use locution_tests::{Answer, Api, TestServer, geometry_with, locution_binary};
use reqwest::Method;
use serde_json::json;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use super::crash::Process;

const JSON: (&str, &str) = ("content-type", "application/json");
const GZIP: (&str, &str) = ("content-encoding", "gzip");

/// So much text, packed to nearly nothing.
fn bomb(num_bytes: usize) -> Vec<u8> {
    let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
    gzip.write_all(b"{\"config\":\"").unwrap();
    for _ in 0..num_bytes >> 10 {
        gzip.write_all(&[b'a'; 1024]).unwrap();
    }
    gzip.write_all(b"\"}").unwrap();
    gzip.finish().unwrap()
}

/// The answers to the same request sent many times at once; a refusal may also be a connection that is gone.
async fn answers(
    api: &Api,
    num: usize,
    path: &str,
    headers: &[(&'static str, &'static str)],
    body: &[u8],
) -> Vec<Answer> {
    let mut sending = Vec::new();
    for _ in 0..num {
        let (api, path, headers, body) = (api.clone(), path.to_owned(), headers.to_vec(), body.to_vec());
        let method = if path.ends_with("batches") { Method::POST } else { Method::PUT };
        sending.push(tokio::spawn(async move { api.send(method, &path, &headers, body).await.ok() }));
    }
    let mut answers = Vec::new();
    for task in sending {
        answers.extend(task.await.unwrap());
    }
    answers
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bomb_as_configuration_is_refused_at_the_small_limit() {
    let server = TestServer::start().await;
    for answer in answers(&server.api, 50, "/v1/sites/a", &[JSON, GZIP], &bomb(15 << 20)).await {
        answer.problem(413, "too-large");
    }
    server.api.get("/v1/sites/a").await.problem(404, "not-found");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn millions_of_numbers_wait_for_memory_or_are_refused() {
    let server = TestServer::start_with(|config| {
        config.limits.received_bytes_max = 4 << 20;
        config.limits.parsed_bytes_max = 8 << 20;
    })
    .await;
    server.api.put("/v1/sites/a", &json!({})).await.ok();
    server.api.put("/v1/sites/a/runs/r", &json!({"geometry": geometry_with(4)})).await.ok();
    let numbers = "1,".repeat(500_000) + "1";
    let scan = "{\"timestamp_ns\":1,\"odom_from_robot\":{\"x\":0,\"y\":0,\"theta\":0},\"ranges_m\":[";
    let body = format!("{{\"first_sequence\":0,\"scans\":[{scan}{numbers}]}}]}}");
    let path = "/v1/sites/a/runs/r/batches";
    let answers = answers(&server.api, 12, path, &[JSON], body.as_bytes()).await;
    assert!(!answers.is_empty());
    for answer in answers {
        assert!([422, 429, 503].contains(&answer.status.as_u16()), "{}", answer.text());
    }
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_refusal_echoes_little_of_what_it_refuses() {
    let server = TestServer::start().await;
    server.api.make_run("a", "r").await;
    let long = "x".repeat(1 << 20);
    let path = "/v1/sites/a/runs/r/batches";
    for body in [
        json!({ "first_sequence": long }),
        json!({ &long: 1 }),
        json!({"first_sequence": 0, "scans": [{ &long: 1 }]}),
    ] {
        let answer = server.api.post(path, &body).await;
        answer.problem(400, "malformed-body");
        assert!(answer.bytes.len() < 1_500, "{} bytes", answer.bytes.len());
    }
    for path in
        [format!("/v1/sites/{}", &long[..10_000]), format!("/v1/sites/a/runs/r/scans?{}=1", &long[..10_000])]
    {
        let answer = server.api.get(&path).await;
        assert!(
            answer.status.is_client_error() && answer.bytes.len() < 1_500,
            "{} bytes",
            answer.bytes.len()
        );
    }
    server.stop().await;
}

/// Most memory that the server may ever have taken, whatever was sent.
const RESIDENT_BYTES_MAX: u64 = 600 << 20;

/// The most memory that a process ever had; none where the system does not tell.
fn peak_bytes(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(peak.trim().trim_end_matches(" kB").parse::<u64>().unwrap() << 10)
}

/// Sends the same request on many connections at once and reads what comes; the first line of every answer.
async fn send_at_once(base: &str, num: usize, head: &str, body: Vec<u8>) -> Vec<String> {
    let head =
        format!("{head}\r\nHost: localhost\r\nConnection: close\r\nContent-Length: {}\r\n\r\n", body.len());
    let request: Arc<[u8]> = [head.as_bytes(), &body].concat().into();
    let mut sending = Vec::new();
    for _ in 0..num {
        let (request, address) = (Arc::clone(&request), base.trim_start_matches("http://").to_owned());
        sending.push(tokio::spawn(async move {
            let mut stream = TcpStream::connect(address).await.unwrap();
            let mut answer = Vec::new();
            let (mut reader, mut writer) = stream.split();
            // A refusal may come before everything is sent.
            let _ = tokio::join!(writer.write_all(&request), reader.read_to_end(&mut answer));
            String::from_utf8_lossy(&answer).lines().next().unwrap_or_default().to_owned()
        }));
    }
    let mut lines = Vec::new();
    for task in sending {
        lines.push(task.await.unwrap());
    }
    lines
}

#[tokio::test(flavor = "multi_thread")]
async fn resident_memory_is_bounded_whatever_bodies_come() {
    let directory = tempfile::tempdir().unwrap();
    let server = Process::start(&locution_binary(), directory.path());
    if peak_bytes(server.id()).is_none() {
        println!("skipped: the system does not tell the memory of a process");
        return;
    }
    server.api().put("/v1/sites/a", &json!({})).await.ok();
    server.api().put("/v1/sites/a/runs/r", &json!({"geometry": geometry_with(4)})).await.ok();
    let numbers = "1,".repeat(5_000_000) + "1";
    let scan = "{\"timestamp_ns\":1,\"odom_from_robot\":{\"x\":0,\"y\":0,\"theta\":0},\"ranges_m\":[";
    let numbers = format!("{{\"first_sequence\":0,\"scans\":[{scan}{numbers}]}}]}}").into_bytes();
    let echo = format!("{{\"first_sequence\":\"{}\"}}", "x".repeat(10_000_000)).into_bytes();
    let post = "POST /v1/sites/a/runs/r/batches HTTP/1.1\r\nContent-Type: application/json";
    let put = "PUT /v1/sites/b HTTP/1.1\r\nContent-Type: application/json\r\nContent-Encoding: gzip";
    let loads = [
        ("configurations of 15 MiB in gzip", 200, put, bomb(15 << 20)),
        ("batches of 5 M numbers", 50, post, numbers),
        ("errors about 10 MB", 50, post, echo),
    ];
    for (what, num, head, body) in loads {
        let answers = send_at_once(&server.api().base, num, head, body).await;
        let peak = peak_bytes(server.id()).unwrap();
        let mut by_status = std::collections::BTreeMap::new();
        for line in &answers {
            *by_status.entry(line.split(' ').nth(1).unwrap_or("none").to_owned()).or_insert(0) += 1;
        }
        println!("{num} {what}: {by_status:?}, at most {} MiB resident so far", peak >> 20);
        assert!(peak <= RESIDENT_BYTES_MAX, "{what}: {} MiB", peak >> 20);
        assert!(by_status.keys().any(|status| status.starts_with('4')), "{by_status:?}");
        server.api().get("/readyz").await;
    }
    // It goes on as if nothing had happened.
    let scan =
        json!({"timestamp_ns": 1, "odom_from_robot": {"x": 0, "y": 0, "theta": 0}, "ranges_m": [1, 2, 3, 4]});
    assert_eq!(server.api().post_batch("a", "r", 0, &[scan]).await.ok()["next_sequence"], 1);
}
