//! Three servers in one process over one store: any of them answers, one dies, nothing acknowledged is lost.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use object_store::ObjectStore;
use object_store::memory::InMemory;
use object_store::path::Path;
use serde_json::{Value, json};

use crate::config::ServerConfig;
use crate::{Opened, RunningServer, start_on};

const NUM_SITES: usize = 6;
const NUM_SCANS_PER_BATCH: usize = 5;
/// As long as the issue allows a site to be without a server.
const UNSERVED_MAX: Duration = Duration::from_secs(30);

async fn server(store: &Arc<dyn ObjectStore>) -> RunningServer {
    let mut config = ServerConfig::default();
    config.address.set_port(0);
    config.builds.is_automatic = false;
    config.storage.object.flush_interval_s = 0.02;
    config.cluster.lease_s = 3.0;
    let opened = Opened::over(Arc::clone(store), Path::from("fleet"), &config).await.unwrap();
    start_on(config, opened).await.unwrap()
}

/// A robot or a person that asks any server again until it is answered.
struct Caller {
    client: reqwest::Client,
    urls: Vec<String>,
    longest_wait: Duration,
}

impl Caller {
    fn of(servers: &[RunningServer]) -> Self {
        let client = reqwest::Client::builder().timeout(Duration::from_secs(10)).build().unwrap();
        Self { client, urls: servers.iter().map(RunningServer::url).collect(), longest_wait: Duration::ZERO }
    }

    /// Sends a request to one server after the other until one answers with something else than 503.
    async fn insist(&mut self, method: &str, path: &str, body: Option<&Value>) -> (u16, Value) {
        let since = Instant::now();
        for attempt in 0.. {
            assert!(since.elapsed() < UNSERVED_MAX, "{method} {path} was not served for {UNSERVED_MAX:?}");
            let url = format!("{}{path}", self.urls[attempt % self.urls.len()]);
            let request = self.client.request(method.parse().unwrap(), url);
            let request = body.into_iter().fold(request, |request, body| request.json(body));
            if let Ok(answer) = request.send().await
                && answer.status().as_u16() != 503
            {
                self.longest_wait = self.longest_wait.max(since.elapsed());
                return (answer.status().as_u16(), answer.json().await.unwrap_or_default());
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
        unreachable!("the loop ends by an answer or a panic")
    }
}

fn batch(first_sequence: usize) -> Value {
    let scan = |sequence: usize| {
        json!({
            "timestamp_ns": sequence * 100_000_000,
            "odom_from_robot": {"x": 0.1 * sequence as f64, "y": 0.0, "theta": 0.0},
            "ranges_m": [2.0, 2.5, 3.0, 2.5, 2.0],
        })
    };
    let scans: Vec<Value> = (first_sequence..first_sequence + NUM_SCANS_PER_BATCH).map(scan).collect();
    json!({"first_sequence": first_sequence, "scans": scans})
}

async fn make_sites(caller: &mut Caller) {
    for site in 0..NUM_SITES {
        let (status, answer) = caller.insist("PUT", &format!("/v1/sites/s{site}"), None).await;
        assert!([200, 201].contains(&status), "{answer}");
        let run = json!({"geometry": {
            "num_ranges": 5, "angle_min_rad": -1.0, "angle_increment_rad": 0.5, "range_max_m": 10.0,
        }});
        let (status, answer) = caller.insist("PUT", &format!("/v1/sites/s{site}/runs/r"), Some(&run)).await;
        assert!([200, 201].contains(&status), "{answer}");
    }
}

/// Posts batches to one site until told to stop; how many scans were acknowledged, and the longest wait for an answer.
async fn drive(mut caller: Caller, site: usize, stop: Arc<AtomicBool>) -> (usize, Duration) {
    caller.urls.rotate_left(site % 3);
    let mut next = 0;
    while !stop.load(Ordering::Relaxed) {
        let path = format!("/v1/sites/s{site}/runs/r/batches");
        let (status, answer) = caller.insist("POST", &path, Some(&batch(next))).await;
        assert_eq!(status, 200, "{answer}");
        next = answer["next_sequence"].as_u64().unwrap() as usize;
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    (next, caller.longest_wait)
}

async fn num_scans(caller: &mut Caller, site: usize) -> usize {
    let (_, answer) = caller.insist("GET", &format!("/v1/sites/s{site}"), None).await;
    answer["num_scans"].as_u64().unwrap() as usize
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn any_server_answers_and_when_one_dies_its_sites_come_back_whole() {
    let store: Arc<dyn ObjectStore> = Arc::new(InMemory::new());
    let mut servers = vec![server(&store).await, server(&store).await, server(&store).await];
    let mut caller = Caller::of(&servers);
    make_sites(&mut caller).await;
    let stop = Arc::new(AtomicBool::new(false));
    let drivers =
        (0..NUM_SITES).map(|site| tokio::spawn(drive(Caller::of(&servers), site, Arc::clone(&stop))));
    let drivers: Vec<_> = drivers.collect();
    tokio::time::sleep(Duration::from_secs(2)).await;
    // It answers nobody any more and renews nothing, as one that was killed or cut off.
    servers.remove(0).kill();
    tokio::time::sleep(Duration::from_secs(8)).await;
    // Another one comes while all are at work.
    servers.push(server(&store).await);
    tokio::time::sleep(Duration::from_secs(4)).await;
    stop.store(true, Ordering::Relaxed);
    let mut acknowledged = HashMap::new();
    for (site, driver) in drivers.into_iter().enumerate() {
        let (num_scans, longest_wait) = driver.await.unwrap();
        println!("site {site}: {num_scans} scans acknowledged, longest wait {longest_wait:?}");
        acknowledged.insert(site, num_scans);
    }
    let mut caller = Caller::of(&servers);
    for (site, num_acknowledged) in &acknowledged {
        assert!(*num_acknowledged > 20 * NUM_SCANS_PER_BATCH);
        assert_eq!(num_scans(&mut caller, *site).await, *num_acknowledged, "site {site}");
    }
    for server in servers {
        server.shutdown().await.unwrap();
    }
    // What is there without any of them.
    let alone = vec![server(&store).await];
    let mut caller = Caller::of(&alone);
    for (site, num_acknowledged) in &acknowledged {
        assert_eq!(num_scans(&mut caller, *site).await, *num_acknowledged, "site {site}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn a_list_of_sites_and_a_question_about_all_cover_every_server_and_name_what_is_silent() {
    let store: Arc<dyn ObjectStore> = Arc::new(InMemory::new());
    let mut servers = vec![server(&store).await, server(&store).await];
    let mut caller = Caller::of(&servers);
    make_sites(&mut caller).await;
    for site in 0..NUM_SITES {
        let path = format!("/v1/sites/s{site}/runs/r");
        for first in (0..300).step_by(NUM_SCANS_PER_BATCH) {
            let (status, _) = caller.insist("POST", &format!("{path}/batches"), Some(&batch(first))).await;
            assert_eq!(status, 200);
        }
        assert_eq!(caller.insist("POST", &format!("{path}/finish"), None).await.0, 200);
    }
    let names: Vec<String> = (0..NUM_SITES).map(|site| format!("s{site}")).collect();
    let states = |answer: &Value| -> Vec<(String, String)> {
        let text = |value: &Value| value.as_str().unwrap().to_owned();
        answer["items"]
            .as_array()
            .unwrap()
            .iter()
            .map(|item| (text(&item["site"]), text(&item["state"])))
            .collect()
    };
    let serving: Vec<_> = names.iter().map(|name| (name.clone(), "serving".to_owned())).collect();
    let question = json!({"words": [{}], "limit": 1000});
    for url in servers.iter().map(RunningServer::url) {
        let listed: Value =
            caller.client.get(format!("{url}/v1/sites")).send().await.unwrap().json().await.unwrap();
        assert_eq!(states(&listed), serving);
        let page = caller.client.get(format!("{url}/v1/sites?limit=2&cursor=1")).send().await.unwrap();
        let page: Value = page.json().await.unwrap();
        assert_eq!(states(&page), serving[1..3]);
        assert_eq!(page["next_cursor"], "3");
        let answer =
            caller.client.post(format!("{url}/v1/queries/words")).json(&question).send().await.unwrap();
        assert!(answer.headers().get("locution-unanswered").is_none());
        let found: Vec<Value> = answer.json().await.unwrap();
        for name in &names {
            assert!(
                found.iter().any(|found| found["site"] == **name),
                "{name} is not in the answer of {url}"
            );
        }
    }
    servers.remove(1).kill();
    // Connections that are open end within a moment; its lease goes on for longer.
    tokio::time::sleep(Duration::from_millis(500)).await;
    let url = servers[0].url();
    let answer = caller.client.post(format!("{url}/v1/queries/words")).json(&question).send().await.unwrap();
    let silent = answer.headers()["locution-unanswered"].to_str().unwrap().to_owned();
    let found: Vec<Value> = answer.json().await.unwrap();
    let silent: Vec<&str> = silent.split(',').collect();
    assert!(!silent.is_empty());
    for name in &names {
        let is_found = found.iter().any(|found| found["site"] == **name);
        assert!(is_found != silent.contains(&name.as_str()), "{name}");
    }
    let listed: Value =
        caller.client.get(format!("{url}/v1/sites")).send().await.unwrap().json().await.unwrap();
    for (name, state) in states(&listed) {
        assert_eq!(state == "unreadable", silent.contains(&name.as_str()), "{name}");
    }
    servers.remove(0).shutdown().await.unwrap();
}
