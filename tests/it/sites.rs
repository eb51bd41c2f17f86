//! Sites and runs as resources.

use locution_tests::{TestServer, drive, geometry};
use serde_json::json;

#[tokio::test(flavor = "multi_thread")]
async fn a_site_is_made_once_and_forgotten_whole() {
    let server = TestServer::start().await;
    let api = &server.api;
    assert_eq!(api.put("/v1/sites/a", &json!({})).await.status, 201);
    assert_eq!(api.put("/v1/sites/a", &json!({})).await.status, 200);
    let other = json!({"config": {"translator": {"sampling": {"delay_m": 1.0}}}});
    api.put("/v1/sites/a", &other).await.problem(409, "exists");
    let site = api.get("/v1/sites/a").await.ok();
    assert_eq!(site["num_runs"], 0);
    assert!(site["config"]["translator"].is_object());
    assert_eq!(api.put("/v1/sites/b", &other).await.status, 201);
    let names: Vec<_> = api.all("/v1/sites").await.into_iter().map(|site| site["site"].clone()).collect();
    assert_eq!(names, ["a", "b"]);
    assert_eq!(api.delete("/v1/sites/a").await.status, 204);
    api.get("/v1/sites/a").await.problem(404, "not-found");
    api.delete("/v1/sites/a").await.problem(404, "not-found");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn configurations_are_checked_by_path() {
    let server = TestServer::start().await;
    let api = &server.api;
    let unknown = json!({"config": {"translator": {"local_map": {"resolution": 0.1}}}});
    let problem = api.put("/v1/sites/a", &unknown).await.problem(400, "malformed-body");
    assert_eq!(problem["field"], "config.translator.local_map.resolution");
    let impossible = json!({"config": {"translator": {"local_map": {"resolution_m": -1.0}}}});
    let problem = api.put("/v1/sites/a", &impossible).await.problem(422, "invalid-value");
    assert_eq!(problem["field"], "config.translator.local_map.resolution_m");
    for name in ["a%20b", "%2Ehidden", "x%2Fy"] {
        api.put(&format!("/v1/sites/{name}"), &json!({})).await.problem(422, "invalid-value");
    }
    assert!(api.all("/v1/sites").await.is_empty());
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_run_keeps_its_geometry() {
    let server = TestServer::start().await;
    let api = &server.api;
    api.put("/v1/sites/a/runs/r", &json!({"geometry": geometry()})).await.problem(404, "not-found");
    api.make_run("a", "r").await;
    assert_eq!(api.put("/v1/sites/a/runs/r", &json!({"geometry": geometry()})).await.status, 200);
    let mut other = geometry();
    other["num_ranges"] = json!(91);
    other["angle_increment_rad"] = json!(0.01);
    api.put("/v1/sites/a/runs/r", &json!({"geometry": other})).await.problem(409, "exists");
    let mut impossible = geometry();
    impossible["angle_increment_rad"] = json!(0.0);
    let problem =
        api.put("/v1/sites/a/runs/x", &json!({"geometry": impossible})).await.problem(422, "invalid-value");
    assert_eq!(problem["field"], "geometry.angle_increment_rad");
    assert_eq!(api.all("/v1/sites/a/runs").await.len(), 1);
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_was_sent_can_be_read_back() {
    let server = TestServer::start().await;
    let api = &server.api;
    let scans = drive(700, 3);
    api.make_run("a", "r").await;
    api.post_all("a", "r", &scans, 97).await;
    let finished = api.post("/v1/sites/a/runs/r/finish", &json!({})).await.ok();
    assert_eq!(finished["state"], "finished");
    assert_eq!(finished["num_scans"], 700);
    for (idx, (stored, sent)) in api.all("/v1/sites/a/runs/r/scans").await.iter().zip(&scans).enumerate() {
        assert_eq!(stored["scan_seq"], idx);
        assert_eq!(stored["timestamp_ns"], sent["timestamp_ns"]);
        let same = |a: &serde_json::Value, b: &serde_json::Value| match (a.as_f64(), b.as_f64()) {
            (Some(a), Some(b)) => a as f32 == b as f32,
            (a, b) => a == b,
        };
        let (stored, sent) = (stored["ranges_m"].as_array().unwrap(), sent["ranges_m"].as_array().unwrap());
        assert!(stored.iter().zip(sent).all(|(stored, sent)| same(stored, sent)), "scan {idx}");
    }
    let observations = api.all("/v1/sites/a/runs/r/observations").await;
    assert_eq!(finished["num_observations"], observations.len());
    assert!(observations.len() > 100);
    let words = api.all("/v1/sites/a/runs/r/words").await;
    assert!(words.len() > 5);
    assert_eq!(api.get_text("/v1/sites/a/runs/r/words").await.lines().count(), words.len());
    for frame in ["odom", "run"] {
        let trajectory = api.get(&format!("/v1/sites/a/runs/r/trajectory?frame={frame}")).await.ok();
        assert_eq!(trajectory["poses"].as_array().unwrap().len(), 700);
    }
    assert_eq!(api.get_text("/v1/sites/a/runs/r/trajectory").await.lines().count(), 700);
    let site = api.get("/v1/sites/a").await.ok();
    assert_eq!(site["num_scans"], 700);
    assert!(site["bytes_on_disk"].as_u64().unwrap() > 0);
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_page_loads_only_what_this_server_has() {
    let server = TestServer::start().await;
    let html = server.api.get("/ui").await.text();
    let linked: Vec<&str> = html.split(['"', '\'']).filter(|text| text.starts_with("/ui/")).collect();
    assert!(linked.len() >= 3, "style, script and icon: {linked:?}");
    assert!(!html.contains("http:") && !html.contains("https:") && !html.contains("<style"), "{html}");
    let client = reqwest::Client::new();
    for path in linked.into_iter().chain(["/ui"]) {
        let answer = client.get(format!("{}{path}", server.api.base)).send().await.unwrap();
        assert_eq!(answer.status(), 200, "{path}");
        let header = |name: &str| answer.headers()[name].to_str().unwrap().to_owned();
        let policy = header("content-security-policy");
        assert!(policy.starts_with("default-src 'none'") && !policy.contains("unsafe"), "{policy}");
        assert_eq!(header("x-content-type-options"), "nosniff");
        let known = client.get(format!("{}{path}", server.api.base)).header("if-none-match", header("etag"));
        assert_eq!(known.send().await.unwrap().status(), 304, "{path} is not sent twice");
    }
    server.api.get("/ui/config.toml").await.problem(404, "not-found");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn operations_answer() {
    let server = TestServer::start().await;
    let api = &server.api;
    assert_eq!(api.get("/healthz").await.text(), "ok\n");
    assert_eq!(api.get("/").await.text(), api.get("/ui").await.text(), "the bare address leads to the page");
    assert_eq!(api.get("/readyz").await.text(), "ready\n");
    api.get("/v1/sites").await.ok();
    assert!(api.get("/metrics").await.text().contains("locution_http_requests_total"));
    let document = api.get("/openapi.json").await.ok();
    assert!(document["openapi"].as_str().unwrap().starts_with("3.1"));
    assert!(document["paths"]["/v1/sites/{site}/runs/{run}/batches"].is_object());
    assert!(api.get("/docs/").await.text().contains("swagger"));
    api.get("/v1/nothing").await.problem(404, "not-found");
    api.post("/healthz", &json!({})).await.problem(405, "method-not-allowed");
    server.stop().await;
}
