//! Builds as jobs: how far they are, cancelled, fair among sites, ended with their site and with the server; and a map
//! version only for a map that changed.

use std::time::Duration;

use locution_tests::{Api, TestServer, drive, locution_binary};
use serde_json::{Value, json};

use crate::crash::Process;

/// Enough to be built for a while.
const NUM_SCANS_LONG: usize = 2_500;
/// How often a state that has to come is looked for.
const NUM_LOOKS: usize = 2_400;
const LOOK_EVERY: Duration = Duration::from_millis(25);

async fn post_run(api: &Api, site: &str, run: &str, num_scans: usize) {
    api.make_run(site, run).await;
    api.post_all(site, run, &drive(num_scans, 1), 250).await;
    api.post(&format!("/v1/sites/{site}/runs/{run}/finish"), &json!({})).await.ok();
}

/// Queues a build; the path of its job.
async fn begin_build(api: &Api, site: &str) -> String {
    let job = api.post(&format!("/v1/sites/{site}/builds"), &json!({})).await;
    assert_eq!(job.status, 202);
    job.headers["location"].to_str().unwrap().to_owned()
}

async fn build(api: &Api, site: &str) -> Value {
    let job = api.post(&format!("/v1/sites/{site}/builds?wait=true"), &json!({})).await.ok();
    assert_eq!(job["state"], "done", "{job}");
    job
}

/// Looks at a job until it is as wanted.
async fn job_that(api: &Api, path: &str, is_wanted: impl Fn(&Value) -> bool) -> Value {
    for _ in 0..NUM_LOOKS {
        let job = api.get(path).await.ok();
        if is_wanted(&job) {
            return job;
        }
        tokio::time::sleep(LOOK_EVERY).await;
    }
    panic!("{path} did not become what was wanted: {}", api.get(path).await.text());
}

#[tokio::test(flavor = "multi_thread")]
async fn builds_that_change_nothing_push_no_version_out() {
    let server = TestServer::start_with(|config| config.builds.num_versions_kept = 2).await;
    let api = &server.api;
    post_run(api, "a", "r", 1_700).await;
    build(api, "a").await;
    for _ in 0..10 {
        let job = build(api, "a").await;
        assert!(job["detail"].as_str().unwrap().contains("nothing has changed"), "{job}");
    }
    assert_eq!(api.get("/v1/sites/a/map").await.ok()["versions"], json!([1]));
    // Another input that makes the same map is noticed, too.
    api.make_run("a", "silent").await;
    build(api, "a").await;
    let versions = api.get("/v1/sites/a/map").await.ok()["versions"].clone();
    let server = server.restart().await;
    let api = &server.api;
    build(api, "a").await;
    assert_eq!(api.get("/v1/sites/a/map").await.ok()["versions"], versions, "after a restart, too");
    let matches = api.all("/v1/sites/a/matches?state=verified").await;
    let id = matches[0]["id"].as_str().unwrap();
    api.put(&format!("/v1/sites/a/matches/{id}/decision"), &json!({"decision": "veto"})).await.ok();
    build(api, "a").await;
    assert_ne!(api.get("/v1/sites/a/map").await.ok()["versions"], versions, "a veto changes the map");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_tell_how_far_they_are_and_can_be_cancelled() {
    let server = TestServer::start_with(|config| {
        config.builds.num_builds_max = 1;
        config.builds.turn_s = 10_000.0;
    })
    .await;
    let api = &server.api;
    post_run(api, "long", "r", NUM_SCANS_LONG).await;
    post_run(api, "short", "r", 100).await;
    let long = begin_build(api, "long").await;
    let running = job_that(api, &long, |job| job["progress"].as_f64() > Some(0.06)).await;
    assert_eq!(running["state"], "running");
    let further = job_that(api, &long, |job| job["progress"].as_f64() > running["progress"].as_f64()).await;
    assert!(further["left_s"].is_null() || further["left_s"].as_f64() > Some(0.0), "{further}");
    // The other site's build waits for its turn: it is over at once.
    let short = begin_build(api, "short").await;
    let cancelled = api.delete(&short).await.ok();
    assert_eq!((&cancelled["state"], &cancelled["left_s"]), (&json!("cancelled"), &Value::Null));
    let cancelled = api.delete(&long).await.ok();
    assert_eq!(cancelled["state"], "cancelled", "{cancelled}");
    assert!(cancelled["detail"].as_str().unwrap().starts_with("cancelled while"), "{cancelled}");
    assert_eq!(api.get("/v1/sites/long").await.ok()["map_version"], Value::Null);
    // What has ended stays as it is, and other builds go on.
    let done = build(api, "short").await;
    let path = format!("/v1/sites/short/jobs/{}", done["id"].as_str().unwrap());
    assert_eq!(api.delete(&path).await.ok(), done);
    api.delete("/v1/sites/short/jobs/77").await.problem(404, "not-found");
    build(api, "long").await;
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_long_build_lets_those_of_other_sites_pass() {
    let server = TestServer::start_with(|config| {
        config.builds.num_builds_max = 1;
        config.builds.turn_s = 0.05;
    })
    .await;
    let api = &server.api;
    post_run(api, "long", "r", NUM_SCANS_LONG).await;
    post_run(api, "short", "r", 100).await;
    let long = begin_build(api, "long").await;
    job_that(api, &long, |job| job["state"] == "running").await;
    build(api, "short").await;
    assert_eq!(api.get(&long).await.ok()["state"], "running");
    job_that(api, &long, |job| job["state"] == "done").await;
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_deleted_site_ends_its_build() {
    let server = TestServer::start_with(|config| {
        config.builds.num_builds_max = 1;
        config.builds.turn_s = 10_000.0;
    })
    .await;
    let api = &server.api;
    post_run(api, "a", "r", NUM_SCANS_LONG).await;
    post_run(api, "b", "r", 100).await;
    let job = begin_build(api, "a").await;
    job_that(api, &job, |job| job["state"] == "running").await;
    let waiting = tokio::spawn({
        let api = api.clone();
        async move { api.post("/v1/sites/a/builds?wait=true", &json!({})).await }
    });
    // Whoever waits is told, whether he came before or after the site went.
    assert_eq!(api.delete("/v1/sites/a").await.status, 204);
    assert!([404, 503].contains(&waiting.await.unwrap().status.as_u16()));
    build(api, "b").await;
    api.make_run("a", "other").await;
    assert!(api.all("/v1/sites/a/jobs").await.is_empty());
    build(api, "a").await;
    server.stop().await;
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread")]
async fn a_server_that_is_told_to_end_in_a_long_build_ends_and_goes_on_after_the_next_start() {
    let (binary, directory) = (locution_binary(), tempfile::tempdir().unwrap());
    let server = Process::start(&binary, directory.path());
    post_run(server.api(), "a", "r", NUM_SCANS_LONG).await;
    let job = begin_build(server.api(), "a").await;
    job_that(server.api(), &job, |job| job["progress"].as_f64() > Some(0.06)).await;
    let status = server.terminate(Duration::from_secs(60));
    assert!(status.success(), "it ends in order: {status}");
    let server = Process::start(&binary, directory.path());
    let done = job_that(server.api(), &job, |job| job["state"] == "done").await;
    assert!(done["detail"].as_str().unwrap().starts_with("map version 1"), "{done}");
}
