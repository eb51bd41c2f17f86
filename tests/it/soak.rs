//! Many robots at once for a while, with questions beside: nothing acknowledged is missing and memory stays flat.
//!
//! ```text
//! LOCUTION_SOAK_S=600 LOCUTION_SOAK_ROBOTS=200 cargo test --release -p locution-tests --test it soak -- --nocapture
//! ```
//!
//! Each robot sends ten scans a second in batches of five. The short form, without the variables, is part of every run of
//! the tests. Latencies are printed, not asserted.

use std::sync::Arc;
use std::time::{Duration, Instant};

use locution_tests::{Api, drive, locution_binary};
use serde_json::json;

use super::crash::Process;

const NUM_SCANS_PER_BATCH: usize = 5;
const BATCH_PERIOD: Duration = Duration::from_millis(500);
const NUM_SITES: usize = 4;
/// Memory may grow by so much between the first third and the end: caches of pages fill up to their bounds.
const GROWTH_BYTES_MAX: u64 = 256 << 20;

fn setting(name: &str, default: usize) -> usize {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// Sends all bodies at their times; the seconds that each answer took.
async fn drive_robot(api: Api, robot: usize, bodies: Arc<Vec<Vec<u8>>>, num_robots: usize) -> Vec<f64> {
    let path = format!("/v1/sites/s{}/runs/r{robot}/batches", robot % NUM_SITES);
    // Robots do not start at the same moment.
    let start = Instant::now() + BATCH_PERIOD.mul_f64(robot as f64 / num_robots as f64);
    let mut durations_s = Vec::with_capacity(bodies.len());
    for (idx, body) in bodies.iter().enumerate() {
        tokio::time::sleep_until((start + BATCH_PERIOD * idx as u32).into()).await;
        let sent = Instant::now();
        let mut answer;
        loop {
            let headers = [("content-type", "application/json")];
            answer = api.send(reqwest::Method::POST, &path, &headers, body.clone()).await.unwrap();
            if answer.status != 429 {
                break;
            }
            // What a robot does when it is told that the queue is full.
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
        assert_eq!(answer.ok()["next_sequence"], (idx + 1) * NUM_SCANS_PER_BATCH);
        durations_s.push(sent.elapsed().as_secs_f64());
    }
    durations_s
}

/// Asks by words and for lists until told to stop.
async fn ask(api: Api) {
    let words = json!({"words": [{"class": 4}, {"class": 3}], "limit": 5});
    for round in 0.. {
        let site = format!("/v1/sites/s{}", round % NUM_SITES);
        api.post(&format!("{site}/queries/words"), &words).await.ok();
        api.get(&format!("{site}/runs?limit=10")).await.ok();
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
}

async fn resident_bytes(api: &Api) -> u64 {
    let page = api.get_text("/metrics").await;
    let line = page.lines().find_map(|line| line.strip_prefix("process_resident_memory_bytes "));
    line.map_or(0, |number| number.parse::<f64>().unwrap() as u64)
}

#[tokio::test(flavor = "multi_thread")]
async fn many_robots_lose_nothing_and_memory_stays_flat() {
    let num_robots = setting("LOCUTION_SOAK_ROBOTS", 12);
    let duration = Duration::from_secs(setting("LOCUTION_SOAK_S", 6) as u64);
    let num_batches = (duration.as_secs_f64() / BATCH_PERIOD.as_secs_f64()).ceil() as usize;
    let directory = tempfile::tempdir().unwrap();
    let server = Process::start(&locution_binary(), directory.path());
    let api = server.api();
    let scans = drive(num_batches * NUM_SCANS_PER_BATCH, 9);
    let body = |(idx, scans): (usize, &[serde_json::Value])| {
        serde_json::to_vec(&json!({"first_sequence": idx * NUM_SCANS_PER_BATCH, "scans": scans})).unwrap()
    };
    let bodies = Arc::new(scans.chunks(NUM_SCANS_PER_BATCH).enumerate().map(body).collect::<Vec<_>>());
    for robot in 0..num_robots {
        api.make_run(&format!("s{}", robot % NUM_SITES), &format!("r{robot}")).await;
    }
    let robots: Vec<_> = (0..num_robots)
        .map(|robot| tokio::spawn(drive_robot(api.clone(), robot, Arc::clone(&bodies), num_robots)))
        .collect();
    let asking = tokio::spawn(ask(api.clone()));
    tokio::time::sleep(duration / 3).await;
    let early_bytes = resident_bytes(api).await;
    let mut durations_s = Vec::new();
    for robot in robots {
        durations_s.extend(robot.await.unwrap());
    }
    assert!(!asking.is_finished(), "a question failed");
    asking.abort();
    let late_bytes = resident_bytes(api).await;
    durations_s.sort_by(f64::total_cmp);
    let share = |share: f64| 1e3 * durations_s[((durations_s.len() - 1) as f64 * share) as usize];
    println!(
        "{num_robots} robots, {duration:?}: {} batches of {NUM_SCANS_PER_BATCH} scans; answers after {:.1} ms (median), \
         {:.1} ms (99 %), {:.1} ms (longest); resident {} MiB after a third, {} MiB at the end",
        durations_s.len(),
        share(0.5),
        share(0.99),
        share(1.0),
        early_bytes >> 20,
        late_bytes >> 20
    );
    assert_eq!(durations_s.len(), num_robots * num_batches);
    for robot in 0..num_robots {
        let run = api.get(&format!("/v1/sites/s{}/runs/r{robot}", robot % NUM_SITES)).await.ok();
        assert_eq!(run["num_scans"], scans.len(), "{run}");
    }
    assert!(late_bytes <= early_bytes + GROWTH_BYTES_MAX, "{early_bytes} → {late_bytes} bytes");
}
