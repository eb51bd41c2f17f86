//! The batch contract: idempotent, in order of sequence numbers, all or nothing, the same after a restart.

use std::io::Write;

use locution_tests::{TestServer, drive};
use reqwest::Method;
use serde_json::{Value, json};

#[tokio::test(flavor = "multi_thread")]
async fn a_repeated_batch_is_answered_as_before() {
    let server = TestServer::start().await;
    let api = &server.api;
    let scans = drive(300, 1);
    api.make_run("a", "r").await;
    let first = api.post_batch("a", "r", 0, &scans[..100]).await.ok();
    let second = api.post_batch("a", "r", 100, &scans[100..200]).await.ok();
    assert_eq!(api.post_batch("a", "r", 0, &scans[..100]).await.ok(), first);
    assert_eq!(api.post_batch("a", "r", 100, &scans[100..200]).await.ok(), second);
    // Cut differently, but the same scans: the answer is where the run stands.
    assert_eq!(api.post_batch("a", "r", 50, &scans[50..120]).await.ok()["next_sequence"], 200);
    assert_eq!(api.post_batch("a", "r", 200, &[]).await.ok()["next_sequence"], 200);
    // Repeating the known and going on beyond it.
    assert_eq!(api.post_batch("a", "r", 150, &scans[150..300]).await.ok()["next_sequence"], 300);
    assert_eq!(api.get("/v1/sites/a/runs/r").await.ok()["num_scans"], 300);
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn gaps_and_differences_are_refused_with_the_expected_number() {
    let server = TestServer::start().await;
    let api = &server.api;
    let scans = drive(200, 1);
    api.make_run("a", "r").await;
    api.post_all("a", "r", &scans[..100], 50).await;
    let before = api.get("/v1/sites/a/runs/r").await.ok();
    let gap = api.post_batch("a", "r", 101, &scans[101..]).await.problem(409, "sequence");
    assert_eq!(gap["expected_sequence"], 100);
    let mut changed = scans[80..120].to_vec();
    changed[5]["ranges_m"][0] = json!(1.234);
    let difference = api.post_batch("a", "r", 80, &changed).await.problem(409, "sequence");
    assert_eq!(difference["expected_sequence"], 100);
    assert!(difference["detail"].as_str().unwrap().contains("scans[5]"));
    assert_eq!(api.get("/v1/sites/a/runs/r").await.ok(), before);
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_finished_run_takes_nothing_new() {
    let server = TestServer::start().await;
    let api = &server.api;
    let scans = drive(200, 1);
    api.make_run("a", "r").await;
    let receipt = api.post_batch("a", "r", 0, &scans[..100]).await.ok();
    let finished = api.post("/v1/sites/a/runs/r/finish", &json!({})).await.ok();
    assert_eq!(api.post("/v1/sites/a/runs/r/finish", &json!({})).await.ok(), finished);
    api.post_batch("a", "r", 100, &scans[100..]).await.problem(409, "finished");
    assert_eq!(api.post_batch("a", "r", 0, &scans[..100]).await.ok(), receipt);
    assert_eq!(api.get("/v1/sites/a/runs/r").await.ok(), finished);
    server.stop().await;
}

/// Everything that a run became, as bytes.
async fn everything(server: &TestServer, run: &str) -> Vec<String> {
    let run = format!("/v1/sites/a/runs/{run}");
    let mut texts = vec![server.api.get_text(&format!("{run}/words")).await];
    for level in 0..3 {
        let words = server.api.all(&format!("{run}/words?level={level}")).await;
        texts.push(Value::from(words).to_string());
    }
    texts.push(Value::from(server.api.all(&format!("{run}/observations")).await).to_string());
    texts.push(server.api.get_text(&format!("{run}/trajectory")).await);
    texts
}

#[tokio::test(flavor = "multi_thread")]
async fn batch_size_restarts_and_sleep_do_not_change_the_text() {
    let scans = drive(1500, 5);
    let mut server = TestServer::start_with(|config| {
        config.storage.num_scans_per_checkpoint = 200;
        config.limits.num_open_runs_max = 1;
    })
    .await;
    server.api.make_run("a", "whole").await;
    server.api.make_run("a", "pieces").await;
    server.api.post_all("a", "whole", &scans, 500).await;
    for (idx, chunk) in scans.chunks(83).enumerate() {
        server.api.post_batch("a", "pieces", idx * 83, chunk).await.ok();
        // Another run pushes this one out of memory.
        server.api.post_batch("a", "whole", 0, &scans[..1]).await.ok();
        if idx % 6 == 4 {
            server = server.restart().await;
        }
    }
    for run in ["whole", "pieces"] {
        server.api.post(&format!("/v1/sites/a/runs/{run}/finish"), &json!({})).await.ok();
    }
    assert_eq!(everything(&server, "whole").await, everything(&server, "pieces").await);
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn cbor_and_compressed_bodies_mean_the_same() {
    let server = TestServer::start().await;
    let api = &server.api;
    let scans = drive(60, 2);
    let body = json!({"first_sequence": 0, "scans": scans});
    let mut cbor = Vec::new();
    ciborium::into_writer(&body, &mut cbor).unwrap();
    let mut packed = ciborium::Value::serialized(&body).unwrap();
    pack_ranges(&mut packed);
    let mut bytes = Vec::new();
    ciborium::into_writer(&packed, &mut bytes).unwrap();
    let json = serde_json::to_vec(&body).unwrap();
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    gzip.write_all(&json).unwrap();
    let gzip = gzip.finish().unwrap();
    api.make_run("a", "r").await;
    let forms: [(&[(&str, &str)], Vec<u8>); 4] = [
        (&[("content-type", "application/cbor")], bytes),
        (&[("content-type", "application/cbor")], cbor),
        (&[("content-type", "application/json")], json),
        (&[("content-type", "application/json"), ("content-encoding", "gzip")], gzip),
    ];
    let mut receipts = Vec::new();
    for (headers, body) in forms {
        let answer = api.send(Method::POST, "/v1/sites/a/runs/r/batches", headers, body).await.unwrap();
        receipts.push(answer.ok());
    }
    assert!(receipts.iter().all(|receipt| *receipt == receipts[0]));
    assert_eq!(receipts[0]["next_sequence"], 60);
    server.stop().await;
}

/// Turns every list of ranges into a byte string of floats.
fn pack_ranges(tree: &mut ciborium::Value) {
    let meters = |value: &ciborium::Value| value.as_float().map_or(f32::NAN, |meters| meters as f32);
    match tree {
        ciborium::Value::Map(entries) => {
            for (key, value) in entries {
                match (key.as_text(), &value) {
                    (Some("ranges_m"), ciborium::Value::Array(ranges)) => {
                        let bytes = ranges.iter().flat_map(|range| meters(range).to_le_bytes()).collect();
                        *value = ciborium::Value::Bytes(bytes);
                    }
                    _ => pack_ranges(value),
                }
            }
        }
        ciborium::Value::Array(items) => items.iter_mut().for_each(pack_ranges),
        _ => {}
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn concurrent_batches_of_one_run_end_in_one_order() {
    let server = TestServer::start_with(|config| config.limits.num_batches_per_run_max = 64).await;
    let scans = drive(400, 4);
    server.api.make_run("a", "r").await;
    let mut tasks = Vec::new();
    for idx in (0..20).rev() {
        let (api, chunk) = (server.api.clone(), scans[idx * 20..idx * 20 + 20].to_vec());
        tasks.push(tokio::spawn(async move {
            loop {
                let answer = api.post_batch("a", "r", idx * 20, &chunk).await;
                if answer.status.is_success() {
                    return;
                }
                answer.problem(409, "sequence");
                tokio::time::sleep(std::time::Duration::from_millis(5)).await;
            }
        }));
    }
    for task in tasks {
        task.await.unwrap();
    }
    assert_eq!(server.api.get("/v1/sites/a/runs/r").await.ok()["num_scans"], 400);
    server.stop().await;
}
