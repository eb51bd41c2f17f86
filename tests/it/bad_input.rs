//! Every kind of bad input is refused with the place of the fault, and changes nothing.

use locution_tests::{Api, TestServer, drive};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use reqwest::Method;
use serde_json::{Value, json};

/// A server with a run of 50 scans.
async fn server_with_run() -> TestServer {
    let server = TestServer::start_with(|config| {
        config.limits.body_bytes_max = 1 << 20;
        config.limits.num_scans_per_batch_max = 400;
    })
    .await;
    server.api.make_run("a", "r").await;
    server.api.post_all("a", "r", &drive(50, 1), 25).await;
    server
}

async fn state_of(api: &Api) -> (Value, usize, usize) {
    let run = api.get("/v1/sites/a/runs/r").await.ok();
    let num_scans = api.all("/v1/sites/a/runs/r/scans").await.len();
    let num_observations = api.all("/v1/sites/a/runs/r/observations").await.len();
    (run, num_scans, num_observations)
}

/// Posts 50 good scans after `spoil` and expects a problem at a field; the store must not change.
async fn refused(spoil: impl FnOnce(&mut [Value]), status: u16, slug: &str, field: &str) {
    let server = server_with_run().await;
    let before = state_of(&server.api).await;
    let mut scans = drive(100, 1)[50..].to_vec();
    spoil(&mut scans);
    let problem = server.api.post_batch("a", "r", 50, &scans).await.problem(status, slug);
    assert_eq!(problem["field"], field, "{problem}");
    assert_eq!(state_of(&server.api).await, before);
    // And the run goes on as if nothing had happened.
    assert_eq!(server.api.post_batch("a", "r", 50, &drive(100, 1)[50..]).await.ok()["next_sequence"], 100);
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_wrong_number_of_ranges() {
    let spoil = |scans: &mut [Value]| drop(scans[3]["ranges_m"].as_array_mut().unwrap().pop());
    refused(spoil, 422, "invalid-scan", "scans[3].ranges_m").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_negative_range() {
    refused(|scans| scans[7]["ranges_m"][17] = json!(-0.5), 422, "invalid-scan", "scans[7].ranges_m[17]")
        .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_range_that_is_no_number() {
    refused(|scans| scans[7]["ranges_m"][17] = json!("far"), 400, "malformed-body", "scans[7].ranges_m[17]")
        .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_pose_that_is_null() {
    let field = "scans[2].odom_from_robot.y";
    refused(|scans| scans[2]["odom_from_robot"]["y"] = Value::Null, 400, "malformed-body", field).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_astronomic_pose() {
    let field = "scans[2].odom_from_robot.x";
    refused(|scans| scans[2]["odom_from_robot"]["x"] = json!(1e300), 422, "invalid-scan", field).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_teleport_within_the_batch() {
    let field = "scans[20].odom_from_robot";
    let spoil = |scans: &mut [Value]| {
        for scan in &mut scans[20..] {
            let x = scan["odom_from_robot"]["x"].as_f64().unwrap();
            scan["odom_from_robot"]["x"] = json!(x + 30.0);
        }
    };
    refused(spoil, 422, "invalid-scan", field).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_teleport_from_the_batch_before() {
    let spoil = |scans: &mut [Value]| scans[0]["odom_from_robot"]["y"] = json!(99.0);
    refused(spoil, 422, "invalid-scan", "scans[0].odom_from_robot").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_unknown_field() {
    refused(|scans| scans[4]["intensities"] = json!([1]), 400, "malformed-body", "scans[4].intensities")
        .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_missing_field() {
    let spoil = |scans: &mut [Value]| drop(scans[4].as_object_mut().unwrap().remove("timestamp_ns"));
    refused(spoil, 400, "malformed-body", "scans[4]").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn numbers_that_only_cbor_can_spell() {
    let server = server_with_run().await;
    let api = &server.api;
    let before = state_of(api).await;
    let spoilt = |path: &str, value: f64| {
        let scans = drive(60, 1)[50..].to_vec();
        let body = json!({"first_sequence": 50, "scans": scans});
        let mut tree = ciborium::Value::serialized(&body).unwrap();
        *at(&mut tree, path) = ciborium::Value::Float(value);
        let mut bytes = Vec::new();
        ciborium::into_writer(&tree, &mut bytes).unwrap();
        bytes
    };
    let post = async |body: Vec<u8>| {
        let headers = [("content-type", "application/cbor")];
        api.send(Method::POST, "/v1/sites/a/runs/r/batches", &headers, body).await.unwrap()
    };
    for (path, value, field) in [
        ("scans.2.odom_from_robot.theta", f64::NAN, "scans[2].odom_from_robot.theta"),
        ("scans.2.odom_from_robot.x", f64::INFINITY, "scans[2].odom_from_robot.x"),
        ("scans.9.ranges_m.4", f64::NEG_INFINITY, "scans[9].ranges_m[4]"),
    ] {
        let problem = post(spoilt(path, value)).await.problem(422, "invalid-scan");
        assert_eq!(problem["field"], field);
    }
    assert_eq!(state_of(api).await, before);
    // NaN and infinity among the ranges mean "no return".
    post(spoilt("scans.9.ranges_m.4", f64::NAN)).await.ok();
    let stored = api.get("/v1/sites/a/runs/r/scans?cursor=59&limit=1").await.ok();
    assert_eq!(stored["items"][0]["ranges_m"][4], Value::Null);
    server.stop().await;
}

fn at<'a>(tree: &'a mut ciborium::Value, path: &str) -> &'a mut ciborium::Value {
    path.split('.').fold(tree, |node, part| match node {
        ciborium::Value::Array(items) => &mut items[part.parse::<usize>().unwrap()],
        ciborium::Value::Map(entries) => {
            &mut entries.iter_mut().find(|(key, _)| key.as_text() == Some(part)).unwrap().1
        }
        _ => panic!("no such path"),
    })
}

#[tokio::test(flavor = "multi_thread")]
async fn bodies_that_cannot_be_read() {
    let server = server_with_run().await;
    let api = &server.api;
    let before = state_of(api).await;
    let path = "/v1/sites/a/runs/r/batches";
    let post = async |headers: &[(&str, &str)], body: &[u8]| {
        api.send(Method::POST, path, headers, body.to_vec()).await.unwrap()
    };
    let json = [("content-type", "application/json")];
    let cbor = [("content-type", "application/cbor")];
    for body in [&b"{"[..], b"[]", b"null", b"{\"first_sequence\":50,\"scans\":[]} x", b"\xff\xfe", b"{}"] {
        post(&json, body).await.problem(400, "malformed-body");
    }
    for body in [&b"\xa1"[..], b"", b"\x9f", b"\xff", b"\xa1\x65scans\x9b\xff\xff\xff\xff\xff\xff\xff\xff"] {
        post(&cbor, body).await.problem(400, "malformed-body");
    }
    let deep = [vec![b'['; 100_000], vec![b']'; 100_000]].concat();
    post(&json, &deep).await.problem(400, "malformed-body");
    post(&[("content-type", "text/csv")], b"1,2").await.problem(415, "media-type");
    let encoded = [json[0], ("content-encoding", "br")];
    post(&encoded, b"x").await.problem(415, "coding");
    let gzip = [json[0], ("content-encoding", "gzip")];
    assert_eq!(post(&gzip, b"not gzip").await.status.as_u16() / 100, 4);
    post(&json, &vec![b' '; 2 << 20]).await.problem(413, "too-large");
    assert_eq!(state_of(api).await, before);
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bomb_of_zeros_is_refused_at_the_limit() {
    use std::io::Write;
    let server = server_with_run().await;
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    gzip.write_all(&vec![b' '; 50 << 20]).unwrap();
    let body = gzip.finish().unwrap();
    assert!(body.len() < 100_000);
    let headers = [("content-type", "application/json"), ("content-encoding", "gzip")];
    let answer = server.api.send(Method::POST, "/v1/sites/a/runs/r/batches", &headers, body).await.unwrap();
    answer.problem(413, "too-large");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn too_many_scans_at_once() {
    let server = server_with_run().await;
    let mut scans = drive(451, 1)[50..].to_vec();
    for scan in &mut scans {
        scan["ranges_m"] = json!(vec![1; 90]);
    }
    let problem = server.api.post_batch("a", "r", 50, &scans).await.problem(422, "invalid-value");
    assert_eq!(problem["field"], "scans");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn queries_that_cannot_be_read() {
    let server = server_with_run().await;
    let api = &server.api;
    api.get("/v1/sites/a/runs/r/scans?limit=0").await.problem(422, "invalid-value");
    api.get("/v1/sites/a/runs/r/scans?cursor=x").await.problem(422, "invalid-value");
    api.get("/v1/sites/a/runs/r/scans?lmit=1").await.problem(400, "malformed-query");
    api.get("/v1/sites/a/runs/r/words?level=999").await.problem(400, "malformed-query");
    assert_eq!(
        api.get("/v1/sites/a/runs/r/scans?cursor=18446744073709551615").await.ok()["items"],
        json!([])
    );
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn damaged_bodies_are_read_or_refused_and_never_break_the_server() {
    let server = server_with_run().await;
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    let body = json!({"first_sequence": 50, "scans": drive(54, 1)[50..]});
    let mut cbor = Vec::new();
    ciborium::into_writer(&body, &mut cbor).unwrap();
    for (media_type, whole) in
        [("application/json", body.to_string().into_bytes()), ("application/cbor", cbor)]
    {
        for _ in 0..200 {
            let mut bytes = whole.clone();
            for _ in 0..rng.random_range(1..6) {
                let at = rng.random_range(0..bytes.len());
                match rng.random_range(0..4) {
                    0 => bytes[at] = rng.random(),
                    1 => bytes.truncate(at.max(1)),
                    2 => bytes.insert(at, rng.random()),
                    _ => bytes.extend_from_within(at..),
                }
            }
            let headers = [("content-type", media_type)];
            let path = "/v1/sites/a/runs/r/batches";
            let answer = server.api.send(Method::POST, path, &headers, bytes).await.unwrap();
            let status = answer.status.as_u16();
            assert!([200, 400, 409, 413, 422].contains(&status), "{status}: {}", answer.text());
        }
    }
    server.api.get("/v1/sites/a/runs/r").await.ok();
    server.stop().await;
}
