//! What the log says of requests, and what it never says. A process has one log, so this is a process of its own.
#![allow(clippy::unwrap_used)]

use std::io::Write;
use std::sync::{Arc, Mutex};

use locution_server::config::{ApiKeyConfig, Scope};
use locution_tests::{TestServer, drive};
use reqwest::Method;
use serde_json::{Value, json};

#[derive(Clone, Default)]
struct Lines(Arc<Mutex<Vec<u8>>>);

impl Write for Lines {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn requests_changes_and_refusals_are_told_and_no_secret_is() {
    let lines = Lines::default();
    let writer = lines.clone();
    tracing_subscriber::fmt().json().with_writer(move || writer.clone()).init();
    let server = TestServer::start_with(|config| {
        config.keys.push(ApiKeyConfig {
            name: "boss".into(),
            // Of `secret-of-the-boss`.
            sha256: "07bd329d831b401294a6578a35b44410cdbcf8a498a0d49f61835841b785e76e".into(),
            scope: Scope::Admin,
            sites: vec!["*".into()],
            ..ApiKeyConfig::default()
        });
    })
    .await;
    let boss = server.api.with_key("secret-of-the-boss");
    boss.make_run("office", "r").await;
    let mut scans = drive(5, 1);
    scans[0]["ranges_m"][3] = json!(7.654321);
    boss.post_batch("office", "r", 0, &scans).await.ok();
    let numbered = [("x-request-id", "robot-7.42")];
    let answer =
        boss.send(Method::GET, "/v1/sites/office?token=in-the-query", &numbered, Vec::new()).await.unwrap();
    assert_eq!(answer.headers["x-request-id"], "robot-7.42");
    let refused = server.api.with_key("secret-of-a-stranger").delete("/v1/sites/office").await;
    let refused_id = refused.headers["x-request-id"].to_str().unwrap().to_owned();
    assert_eq!(refused.status, 401);
    let issued = boss.post("/v1/keys", &json!({"name": "robot", "scope": "read", "sites": ["*"]})).await.ok();
    assert_eq!(boss.delete("/v1/sites/office").await.status, 204);
    server.stop().await;

    let text = String::from_utf8(lines.0.lock().unwrap().clone()).unwrap();
    let events: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let told = |target: &str, wanted: &[(&str, Value)]| {
        events.iter().any(|event| {
            event["target"] == target && wanted.iter().all(|(name, value)| event["fields"][name] == *value)
        })
    };
    let route = json!("/v1/sites/{site}/runs/{run}/batches");
    assert!(
        told("locution::access", &[("route", route), ("status", json!(200)), ("key", json!("boss"))]),
        "{text}"
    );
    assert!(told(
        "locution::audit",
        &[("event", json!("refused")), ("status", json!(401)), ("problem", json!("unauthorized"))]
    ));
    assert!(told(
        "locution::audit",
        &[("event", json!("changed")), ("method", json!("DELETE")), ("path", json!("/v1/sites/office"))]
    ));
    assert!(told("locution::audit", &[("event", json!("key made")), ("name", json!("robot"))]));
    for id in ["robot-7.42", &refused_id] {
        assert!(events.iter().any(|event| event["span"]["id"] == id), "{id} is not in the log");
    }
    let secret = issued["secret"].as_str().unwrap();
    for hidden in ["secret-of", secret, "7.654321", "in-the-query", "\u{1b}["] {
        assert!(!text.contains(hidden), "{hidden:?} is in the log");
    }
}
