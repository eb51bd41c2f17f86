//! Bodies made to fill the server's memory are refused before they do, and refusals echo little of them.

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;
use locution_tests::{Answer, Api, TestServer, geometry_with};
use reqwest::Method;
use serde_json::json;

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
