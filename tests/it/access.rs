//! Keys, scopes, sites and overload.

use locution_server::config::{ApiKeyConfig, Scope, ServerConfig};
use locution_server::start_server;
use locution_tests::{TestServer, drive, geometry};
use serde_json::json;

/// SHA-256 of `reader`, `writer` and `admin`.
const HASHES: [(&str, Scope, &str, &str); 3] = [
    ("reader", Scope::Read, "*", "3d0941964aa3ebdcb00ccef58b1bb399f9f898465e9886d5aec7f31090a0fb30"),
    ("writer", Scope::Write, "a", "b93006774cbdd4b299389a03ac3d88c3a76b460d538795bc12718011a909fba5"),
    ("admin", Scope::Admin, "*", "8c6976e5b5410415bde908bd4dee15dfb167a9c873fc4bb8a81f6f2ab448a918"),
];

#[tokio::test(flavor = "multi_thread")]
async fn keys_open_what_they_should_and_nothing_else() {
    let server = TestServer::start_with(|config| {
        config.keys = HASHES
            .iter()
            .map(|(name, scope, site, sha256)| ApiKeyConfig {
                name: (*name).into(),
                sha256: (*sha256).into(),
                scope: *scope,
                sites: vec![(*site).into()],
            })
            .collect();
    })
    .await;
    let nobody = server.api.clone();
    let [reader, writer, admin] = ["reader", "writer", "admin"].map(|key| server.api.with_key(key));
    nobody.get("/v1/sites").await.problem(401, "unauthorized");
    nobody.get("/metrics").await.problem(401, "unauthorized");
    nobody.with_key("guess").get("/v1/sites").await.problem(401, "unauthorized");
    assert_eq!(nobody.get("/healthz").await.status, 200);
    writer.put("/v1/sites/a", &json!({})).await.problem(403, "forbidden");
    admin.put("/v1/sites/a", &json!({})).await.ok();
    admin.put("/v1/sites/b", &json!({})).await.ok();
    writer.put("/v1/sites/a/runs/r", &json!({"geometry": geometry()})).await.ok();
    writer.post_batch("a", "r", 0, &drive(3, 1)).await.ok();
    writer.put("/v1/sites/b/runs/r", &json!({"geometry": geometry()})).await.problem(403, "forbidden");
    writer.get("/v1/sites/b").await.problem(403, "forbidden");
    reader.post_batch("a", "r", 3, &drive(3, 1)).await.problem(403, "forbidden");
    reader.get("/v1/sites/a/runs/r").await.ok();
    reader.delete("/v1/sites/a").await.problem(403, "forbidden");
    assert_eq!(reader.all("/v1/sites").await.len(), 2);
    assert_eq!(writer.all("/v1/sites").await.len(), 1);
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn other_machines_are_refused_without_a_key() {
    let config = ServerConfig { address: "0.0.0.0:0".parse().unwrap(), ..Default::default() };
    let Err(error) = start_server(config).await else { panic!("the server started") };
    assert!(error.to_string().contains("keys"), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn overload_is_refused_politely_and_passes() {
    let server = TestServer::start_with(|config| {
        config.limits.num_batches_max = 2;
        config.limits.num_batches_per_run_max = 1;
    })
    .await;
    // Bodies that fit the buffers of a connection: a refusal may come before a longer one is sent.
    let scans = drive(40, 1);
    server.api.make_run("a", "r").await;
    let mut tasks = Vec::new();
    for _ in 0..24 {
        let (api, scans) = (server.api.clone(), scans.clone());
        tasks.push(tokio::spawn(async move { api.post_batch("a", "r", 0, &scans).await }));
    }
    let mut num_refused = 0;
    for task in tasks {
        let answer = task.await.unwrap();
        if answer.status == 429 {
            answer.problem(429, "busy");
            assert!(answer.headers["retry-after"].to_str().unwrap().parse::<u64>().unwrap() >= 1);
            num_refused += 1;
        } else {
            answer.ok();
        }
    }
    assert!(num_refused > 0);
    assert_eq!(server.api.post_batch("a", "r", 0, &scans).await.ok()["next_sequence"], 40);
    server.stop().await;
}
