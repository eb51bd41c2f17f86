//! No key takes all places: whoever sends much is told to wait, whoever sends little is served.

use locution_server::config::{ApiKeyConfig, Scope};
use locution_tests::{TestServer, drive};
use serde_json::json;

/// SHA-256 of `writer` and `admin`.
const HASHES: [(&str, &str); 2] = [
    ("writer", "b93006774cbdd4b299389a03ac3d88c3a76b460d538795bc12718011a909fba5"),
    ("admin", "8c6976e5b5410415bde908bd4dee15dfb167a9c873fc4bb8a81f6f2ab448a918"),
];
const NUM_RUNS: usize = 24;

#[tokio::test(flavor = "multi_thread")]
async fn a_key_that_floods_the_queue_of_batches_leaves_places_to_others() {
    let server = TestServer::start_with(|config| {
        config.limits.num_batches_max = 4;
        config.keys = HASHES
            .map(|(name, sha256)| ApiKeyConfig {
                name: name.into(),
                sha256: sha256.into(),
                scope: Scope::Admin,
                sites: vec!["*".into()],
                ..ApiKeyConfig::default()
            })
            .to_vec();
    })
    .await;
    let (greedy, modest) = (server.api.with_key("writer"), server.api.with_key("admin"));
    for run in 0..NUM_RUNS {
        greedy.make_run("s", &format!("g{run}")).await;
    }
    modest.make_run("s", "m").await;
    let scans = drive(600, 1);
    let body = json!({"first_sequence": 0, "scans": scans});
    let flood: Vec<_> = (0..NUM_RUNS)
        .map(|run| {
            let (api, body) = (greedy.clone(), body.clone());
            tokio::spawn(async move { api.post(&format!("/v1/sites/s/runs/g{run}/batches"), &body).await })
        })
        .collect();
    let mut num_served_meanwhile = 0;
    for first in (0..600).step_by(20) {
        num_served_meanwhile += usize::from(!flood.iter().all(|task| task.is_finished()));
        modest.post_batch("s", "m", first, &scans[first..first + 20]).await.ok();
    }
    let mut num_refused = 0;
    for task in flood {
        let answer = task.await.unwrap();
        if !answer.status.is_success() {
            answer.problem(429, "busy");
            num_refused += 1;
        }
    }
    println!(
        "{num_refused} of {NUM_RUNS} large batches refused, {num_served_meanwhile} small ones served meanwhile"
    );
    assert!(num_refused > 0 && num_served_meanwhile > 0);
    server.stop().await;
}
