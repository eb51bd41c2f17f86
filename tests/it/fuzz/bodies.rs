//! Bodies and headers through the front door: every answer is a success or a problem that names the fault, never a failure
//! of the server, and what was stored before is as it was.

use locution_server::config::{ApiKeyConfig, Scope};
use locution_tests::{Answer, TestServer, drive, geometry};
use reqwest::Method;
use serde_json::{Value, json};

use super::{Inputs, entries};

const JSON: (&str, &str) = ("content-type", "application/json");
const CBOR: (&str, &str) = ("content-type", "application/cbor");

fn check(answer: &Answer) {
    let status = answer.status.as_u16();
    assert!(answer.status.is_success() || (400..500).contains(&status), "{status}: {}", answer.text());
    if !answer.status.is_success() {
        let problem = answer.json();
        assert!(problem["type"].is_string() && problem["detail"].is_string(), "{}", answer.text());
        assert!(answer.bytes.len() < 2_000, "{} bytes of refusal", answer.bytes.len());
    }
}

/// Posts whatever a target gives to a path.
async fn post_all(server: &TestServer, path: &str, header: (&str, &str), inputs: Inputs) {
    for input in inputs {
        check(&server.api.send(Method::POST, path, &[header], input).await.unwrap());
    }
}

/// Batches of different sizes for a run of [`drive`].
fn batches() -> Vec<Value> {
    let scans = drive(30, 1);
    [(0, 2), (0, 1), (0, 0), (2, 4)]
        .map(|(first, end)| json!({"first_sequence": first, "scans": scans[first..end]}))
        .to_vec()
}

fn as_json(values: &[Value]) -> Vec<Vec<u8>> {
    values.iter().map(|value| serde_json::to_vec(value).unwrap()).collect()
}

fn as_cbor(values: &[Value]) -> Vec<Vec<u8>> {
    let encoded = |value: &Value| {
        let mut bytes = Vec::new();
        ciborium::into_writer(value, &mut bytes).unwrap();
        bytes
    };
    values.iter().map(encoded).collect()
}

/// A batch whose ranges are one byte string, as quick clients send it.
fn packed_batch() -> Vec<u8> {
    use ciborium::Value::{Array, Bytes, Float, Integer, Map, Text};
    let text = |name: &str| Text(name.to_owned());
    let ranges = (0..90u8).flat_map(|beam| f32::from(beam % 7 + 1).to_le_bytes()).collect();
    let pose = Map(["x", "y", "theta"].map(|name| (text(name), Float(0.25))).to_vec());
    let scan = Map(vec![
        (text("timestamp_ns"), Integer(7.into())),
        (text("odom_from_robot"), pose),
        (text("ranges_m"), Bytes(ranges)),
    ]);
    let batch = Map(vec![(text("first_sequence"), Integer(0.into())), (text("scans"), Array(vec![scan]))]);
    let mut bytes = Vec::new();
    ciborium::into_writer(&batch, &mut bytes).unwrap();
    bytes
}

#[tokio::test(flavor = "multi_thread")]
async fn batches_in_json_and_cbor() {
    let server = TestServer::start().await;
    server.api.make_run("s", "kept").await;
    let kept = drive(30, 2);
    server.api.post_all("s", "kept", &kept, 30).await;
    let before = server.api.all("/v1/sites/s/runs/kept/scans").await;
    let mut json_seeds = as_json(&batches());
    json_seeds.extend(entries("batch"));
    let mut cbor_seeds = as_cbor(&batches());
    cbor_seeds.push(packed_batch());
    for (header, target, seeds) in [(JSON, "batch-json", json_seeds), (CBOR, "batch-cbor", cbor_seeds)] {
        let mut num_taken = 0;
        for (idx, input) in Inputs::with(target, seeds, 600).enumerate() {
            // A run that took scans refuses the next ones for their number; a new one looks at all of them.
            let run = format!("{target}-{}", idx / 20);
            if idx % 20 == 0 {
                server.api.make_run("s", &run).await;
            }
            let path = format!("/v1/sites/s/runs/{run}/batches");
            let answer = server.api.send(Method::POST, &path, &[header], input).await.unwrap();
            check(&answer);
            num_taken += usize::from(answer.status.is_success());
        }
        assert!(num_taken > 0, "{target}: nothing was taken");
    }
    assert_eq!(server.api.all("/v1/sites/s/runs/kept/scans").await, before);
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn configurations_of_sites() {
    let server = TestServer::start().await;
    server.api.put("/v1/sites/plain", &json!({})).await.ok();
    let whole = json!({"config": server.api.get("/v1/sites/plain").await.ok()["config"]});
    let mut seeds = as_json(&[whole]);
    seeds.extend(entries("site"));
    let batch = batches().swap_remove(0);
    for input in Inputs::with("site", seeds, 250) {
        let answer = server.api.send(Method::PUT, "/v1/sites/f", &[JSON], input).await.unwrap();
        check(&answer);
        if answer.status.is_success() {
            // A configuration that was taken must be one that can be worked with.
            check(&server.api.put("/v1/sites/f/runs/r", &json!({"geometry": geometry()})).await);
            check(&server.api.post("/v1/sites/f/runs/r/batches", &batch).await);
            assert_eq!(server.api.delete("/v1/sites/f").await.status, 204);
        }
    }
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn questions() {
    let server = TestServer::start().await;
    server.api.make_run("s", "r").await;
    server.api.post_all("s", "r", &drive(300, 1), 300).await;
    server.api.post("/v1/sites/s/runs/r/finish", &json!({})).await.ok();
    server.api.post("/v1/sites/s/builds?wait=true", &json!({})).await.ok();
    let examples = as_json(&[json!({"geometry": geometry(), "scans": drive(8, 3)})]);
    post_all(&server, "/v1/sites/s/queries/words", JSON, Inputs::of("words", 400)).await;
    post_all(&server, "/v1/sites/s/queries/labels", JSON, Inputs::with("labels", entries("words"), 200))
        .await;
    post_all(&server, "/v1/sites/s/queries/example", JSON, Inputs::with("example", examples, 100)).await;
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn keys() {
    let key = ApiKeyConfig {
        name: "admin".into(),
        // Of `admin`.
        sha256: "8c6976e5b5410415bde908bd4dee15dfb167a9c873fc4bb8a81f6f2ab448a918".into(),
        scope: Scope::Admin,
        sites: vec!["*".into()],
        ..ApiKeyConfig::default()
    };
    let server = TestServer::start_with(|config| config.keys = vec![key]).await;
    let admin = server.api.with_key("admin");
    for input in Inputs::of("key", 300) {
        check(&admin.send(Method::POST, "/v1/keys", &[JSON], input).await.unwrap());
    }
    let headers = ["Bearer admin", "bearer loc_0123456789abcdef", "Basic YWRtaW46YWRtaW4=", "Bearer"];
    let mut num_sent = 0;
    for input in Inputs::with("authorization", headers.map(|text| text.as_bytes().to_vec()).to_vec(), 600) {
        let text = String::from_utf8_lossy(&input);
        // The client itself refuses what cannot stand in a header.
        let Ok(answer) =
            server.api.send(Method::GET, "/v1/keys", &[("authorization", &text)], Vec::new()).await
        else {
            continue;
        };
        num_sent += 1;
        let is_key = text.split_once(' ').is_some_and(|(scheme, secret)| {
            scheme.trim().eq_ignore_ascii_case("bearer") && secret.trim() == "admin"
        });
        assert_eq!(answer.status, if is_key { 200 } else { 401 }, "{text:?}");
    }
    assert!(num_sent > 100, "{num_sent}");
    server.stop().await;
}
