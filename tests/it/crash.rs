//! The real binary, killed at random moments, loses nothing that it acknowledged and never shows half a change.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use locution_tests::{Api, drive};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

const NUM_KILLS: usize = 20;
const NUM_SCANS_PER_BATCH: usize = 20;

/// A server process; killed when dropped.
pub(crate) struct Process {
    child: Child,
    api: Api,
}

impl Process {
    pub(crate) fn start(binary: &Path, directory: &Path) -> Self {
        let mut child = Command::new(binary)
            .args(["serve", "--address", "127.0.0.1:0", "--data-directory"])
            .arg(directory)
            .env("LOCUTION_STORAGE__NUM_SCANS_PER_CHECKPOINT", "150")
            .env_remove("LOCUTION_BIN")
            .env("LOCUTION_BUILDS__IS_AUTOMATIC", "false")
            .env("LOCUTION_LOG__FILTER", "error")
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let url = line.trim().strip_prefix("listening on ").unwrap_or_else(|| panic!("no address: {line}"));
        let api = Api::new(url.to_owned());
        Self { child, api }
    }

    /// Speaks to it.
    pub(crate) fn api(&self) -> &Api {
        &self.api
    }

    /// Its number in the system.
    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    /// SIGTERM: it may end in order, within the time given.
    #[cfg(unix)]
    pub(crate) fn terminate(mut self, time_max: Duration) -> std::process::ExitStatus {
        let told = Command::new("kill").args(["-s", "TERM", &self.id().to_string()]).status().unwrap();
        assert!(told.success());
        let told_at = std::time::Instant::now();
        while told_at.elapsed() < time_max {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        panic!("it did not end");
    }

    /// SIGKILL: no destructor, no flush, no goodbye.
    pub(crate) fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

async fn post(api: &Api, first: usize, scans: &[Value]) -> Option<Value> {
    let body = serde_json::to_vec(&json!({"first_sequence": first, "scans": scans})).unwrap();
    let headers = [("content-type", "application/json")];
    let answer = api.send(reqwest::Method::POST, "/v1/sites/a/runs/r/batches", &headers, body).await.ok()?;
    Some(answer.ok())
}

/// Posts from where the server stands until it dies or all is sent; the highest acknowledged number.
async fn post_until_killed(api: &Api, scans: &[Value], from: usize, acknowledged: &AtomicUsize) -> usize {
    let mut next = from;
    while next < scans.len() {
        let end = scans.len().min(next + NUM_SCANS_PER_BATCH);
        let Some(receipt) = post(api, next, &scans[next..end]).await else { break };
        next = receipt["next_sequence"].as_u64().unwrap() as usize;
        assert_eq!(next, end);
        acknowledged.store(next, Ordering::Release);
    }
    next
}

async fn everything(api: &Api) -> Vec<String> {
    let mut texts = Vec::new();
    for level in 0..3 {
        texts
            .push(Value::from(api.all(&format!("/v1/sites/a/runs/r/words?level={level}")).await).to_string());
    }
    texts.push(Value::from(api.all("/v1/sites/a/runs/r/observations").await).to_string());
    texts.push(api.get_text("/v1/sites/a/runs/r/trajectory").await);
    texts.push(Value::from(api.all("/v1/sites/a/runs/r/scans").await).to_string());
    texts
}

#[tokio::test(flavor = "multi_thread")]
async fn twenty_kills_lose_nothing_and_change_no_byte() {
    let binary = locution_tests::locution_binary();
    let scans = drive(10_000, 11);
    let mut rng = ChaCha8Rng::seed_from_u64(20);
    let directory = tempfile::tempdir().unwrap();
    let mut process = Process::start(&binary, directory.path());
    process.api.make_run("a", "r").await;
    let mut num_acknowledged = 0;
    let mut num_kills = 0;
    while num_kills < NUM_KILLS {
        let (api, to_send) = (process.api.clone(), scans.clone());
        let from = num_acknowledged;
        let acknowledged = Arc::new(AtomicUsize::new(from));
        let shared = Arc::clone(&acknowledged);
        let client = tokio::spawn(async move { post_until_killed(&api, &to_send, from, &shared).await });
        // A random number of batches and then a random part of one, so that a slow machine is hit as evenly.
        let target = scans.len().min(from + NUM_SCANS_PER_BATCH * rng.random_range(0..20));
        while acknowledged.load(Ordering::Acquire) < target && !client.is_finished() {
            tokio::time::sleep(Duration::from_micros(200)).await;
        }
        tokio::time::sleep(Duration::from_micros(rng.random_range(0..15_000))).await;
        process.kill();
        num_kills += 1;
        num_acknowledged = client.await.unwrap();
        process = Process::start(&binary, directory.path());
        let run = process.api.get("/v1/sites/a/runs/r").await.ok();
        let num_stored = run["num_scans"].as_u64().unwrap() as usize;
        // A batch may have become durable without its answer reaching the client.
        assert!(num_stored >= num_acknowledged, "{num_acknowledged} acknowledged, {num_stored} there");
        assert!(num_stored <= num_acknowledged + NUM_SCANS_PER_BATCH);
        num_acknowledged = if rng.random_bool(0.5) { num_stored } else { num_acknowledged };
        if num_acknowledged >= scans.len() {
            break;
        }
    }
    println!("{num_kills} kills, the last one after {num_acknowledged} of {} scans", scans.len());
    assert_eq!(num_kills, NUM_KILLS, "the recording was too short to be interrupted often enough");
    assert_eq!(
        post_until_killed(&process.api, &scans, num_acknowledged, &AtomicUsize::new(0)).await,
        scans.len()
    );
    process.api.post("/v1/sites/a/runs/r/finish", &json!({})).await.ok();
    let interrupted = everything(&process.api).await;
    process.kill();

    let fresh = tempfile::tempdir().unwrap();
    let undisturbed = Process::start(&binary, fresh.path());
    undisturbed.api.make_run("a", "r").await;
    assert_eq!(post_until_killed(&undisturbed.api, &scans, 0, &AtomicUsize::new(0)).await, scans.len());
    undisturbed.api.post("/v1/sites/a/runs/r/finish", &json!({})).await.ok();
    for (interrupted, undisturbed) in interrupted.iter().zip(&everything(&undisturbed.api).await) {
        assert!(interrupted == undisturbed, "the texts differ");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_kill_while_new_texts_are_written_leaves_the_old_ones() {
    let binary = locution_tests::locution_binary();
    let scans = drive(1_000, 12);
    let directory = tempfile::tempdir().unwrap();
    let mut process = start_with_mean_shift(&binary, directory.path(), &scans).await;
    let words = "/v1/sites/a/runs/r/words";
    let (old, old_words) = (everything(&process.api).await, process.api.get_text(words).await);
    let build = "/v1/sites/a/builds";
    // The work begins anew every time, so longer and longer waits reach every part of it.
    let (mut wait, mut num_kills_before_the_switch) = (Duration::from_millis(1), 0);
    loop {
        process.api.post(build, &json!({})).await.ok();
        tokio::time::sleep(wait).await;
        process.kill();
        process = Process::start(&binary, directory.path());
        let served = process.api.get_text(words).await;
        if process.api.get("/v1/sites/a").await.ok()["generation"] == 1 {
            break;
        }
        assert!(served == old_words, "neither the old texts nor the new ones, killed after {wait:?}");
        num_kills_before_the_switch += 1;
        wait *= 2;
    }
    println!("{num_kills_before_the_switch} kills before the switch, the last wait was {wait:?}");
    assert!(num_kills_before_the_switch >= 3);
    let job = process.api.post(&format!("{build}?wait=true"), &json!({})).await.ok();
    assert_eq!(job["state"], "done", "{job}");
    let interrupted = everything(&process.api).await;
    assert!(interrupted != old, "a partition by mean shift gives other texts");
    process.kill();

    let fresh = tempfile::tempdir().unwrap();
    let undisturbed = start_with_mean_shift(&binary, fresh.path(), &scans).await;
    undisturbed.api.post(&format!("{build}?wait=true"), &json!({})).await.ok();
    assert_eq!(undisturbed.api.get("/v1/sites/a").await.ok()["generation"], 1);
    assert!(everything(&undisturbed.api).await == interrupted, "the new texts differ");
}

/// A server with one finished run of a site whose classes are the modes of its densities.
async fn start_with_mean_shift(binary: &Path, directory: &Path, scans: &[Value]) -> Process {
    let process = Process::start(binary, directory);
    let config = json!({"config": {"translator": {"quantizer": {"mean_shift": {
        "num_initial_classes": 8, "bandwidth": 0.03, "min_share": 0.01, "max_moved_share": 0.1}}}}});
    process.api.put("/v1/sites/a", &config).await.ok();
    process.api.make_run("a", "r").await;
    assert_eq!(post_until_killed(&process.api, scans, 0, &AtomicUsize::new(0)).await, scans.len());
    process.api.post("/v1/sites/a/runs/r/finish", &json!({})).await.ok();
    process
}
