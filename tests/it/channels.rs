//! Channels: what a fleet drives by stays, is moved, and goes back, whatever is built meanwhile.

use locution_tests::{Api, TestServer, drive};
use serde_json::{Value, json};

const CHANNEL: &str = "/v1/sites/a/channels/stable";

/// Adds a run and builds; answers the version that serves then.
async fn add_run(api: &Api, run: &str, seed: u64) -> u64 {
    api.make_run("a", run).await;
    api.post_all("a", run, &drive(200, seed), 100).await;
    api.post(&format!("/v1/sites/a/runs/{run}/finish"), &json!({})).await.ok();
    api.post("/v1/sites/a/builds?wait=true", &json!({})).await.ok();
    api.get("/v1/sites/a").await.ok()["map_version"].as_u64().unwrap()
}

async fn kept(api: &Api, version: u64) -> bool {
    api.get(&format!("/v1/sites/a/map?version={version}")).await.status.is_success()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_version_that_a_channel_holds_is_kept_and_gone_back_to() {
    let server = TestServer::start_with(|config| config.builds.num_versions_kept = 1).await;
    let api = &server.api;
    api.put("/v1/sites/a", &json!({})).await.ok();
    api.put(CHANNEL, &json!({})).await.problem(409, "not-ready");
    let first = add_run(api, "r1", 1).await;
    let made = api.put(CHANNEL, &json!({})).await;
    assert_eq!(made.status, 201);
    assert_eq!(made.headers["location"], CHANNEL);
    assert_eq!(made.ok()["map_version"], first);
    let second = add_run(api, "r2", 2).await;
    let third = add_run(api, "r3", 3).await;
    assert!(first < second && second < third);
    assert!(kept(api, first).await && !kept(api, second).await);
    api.put(CHANNEL, &json!({"map_version": second})).await.problem(404, "not-found");

    let moved = api.put(CHANNEL, &json!({"map_version": third})).await.ok();
    assert_eq!((&moved["map_version"], &moved["map_version_before"]), (&json!(third), &json!(first)));
    assert_eq!(moved["vda5050"]["mapId"], "a");
    assert_eq!(moved["vda5050"]["mapVersion"], third.to_string());
    let grid = moved["vda5050"]["mapDownloadLink"].as_str().unwrap();
    assert!(api.get(grid).await.status.is_success());
    // Robots say what they have.
    let robot = |name: &str| format!("{CHANNEL}/robots/{name}");
    for (name, version) in [("r7", first), ("r8", third), ("r7", third), ("r9", first)] {
        let said = api.put(&robot(name), &json!({"map_version": version})).await;
        assert_eq!(said.status, 204);
    }
    let robots: Vec<(Value, Value)> = (api.all(&format!("{CHANNEL}/robots")).await.iter())
        .map(|robot| (robot["robot"].clone(), robot["is_current"].clone()))
        .collect();
    assert_eq!(robots, [("r7", true), ("r8", true), ("r9", false)].map(|(r, is)| (json!(r), json!(is))));

    // After a restart, too.
    let server = server.restart().await;
    let api = &server.api;
    let fourth = add_run(api, "r4", 4).await;
    assert!(kept(api, first).await && kept(api, third).await && kept(api, fourth).await);
    let back = api.post(&format!("{CHANNEL}/rollback"), &json!({})).await.ok();
    assert_eq!((&back["map_version"], &back["map_version_before"]), (&json!(first), &Value::Null));
    assert_eq!(back["moves"].as_array().unwrap().len(), 1);
    api.post(&format!("{CHANNEL}/rollback"), &json!({})).await.problem(409, "not-ready");
    assert_eq!(api.all("/v1/sites/a/channels").await.len(), 1);

    assert_eq!(api.delete(CHANNEL).await.status, 204);
    api.get(CHANNEL).await.problem(404, "not-found");
    api.put(&robot("r7"), &json!({"map_version": 1})).await.problem(404, "not-found");
    add_run(api, "r5", 5).await;
    assert!(!kept(api, first).await && !kept(api, third).await, "nobody holds them any more");
}
