//! How fast scans go in over HTTP, durable and translated, with the client on the same machine.
//!
//! `cargo run --release -p locution-lab --example ingest -- [RUNS] [SCANS] [BATCH] [json|cbor] [refined|raw]`
//!
//! Posts a simulated drive as several runs at once to a server of its own in a temporary directory, over at most eight
//! connections with one batch in flight each, and prints scans per second, latency, CPU time, bytes on disk and memory.
#![allow(clippy::unwrap_used)]

use std::sync::Arc;
use std::time::{Duration, Instant};

use locution_tests::{Api, TestServer, drive_with, geometry_with};
use serde_json::json;

const NUM_RANGES: usize = 180;
/// Connections, so that the memory of many open runs is not that of as many connections.
const NUM_CONNECTIONS_MAX: usize = 8;

struct Options {
    num_runs: usize,
    num_scans: usize,
    batch: usize,
    is_cbor: bool,
    odometry: String,
}

impl Options {
    fn read() -> Self {
        let arguments: Vec<String> = std::env::args().skip(1).collect();
        let number =
            |idx: usize, default: usize| arguments.get(idx).map_or(default, |text| text.parse().unwrap());
        Self {
            num_runs: number(0, 2),
            num_scans: number(1, 10_000),
            batch: number(2, 100),
            is_cbor: arguments.get(3).is_some_and(|format| format == "cbor"),
            odometry: arguments.get(4).cloned().unwrap_or_else(|| "raw".into()),
        }
    }
}

fn main() {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().unwrap();
    runtime.block_on(measure(Options::read()));
}

async fn measure(options: Options) {
    let bodies = Arc::new(bodies(&options));
    let server = TestServer::start_with(|config| config.limits.num_open_runs_max = 10_000).await;
    let config = json!({"config": {"translator": {"odometry": options.odometry}}});
    server.api.put("/v1/sites/bench", &config).await.ok();
    for run in 0..options.num_runs {
        let body = json!({"geometry": geometry_with(NUM_RANGES)});
        server.api.put(&format!("/v1/sites/bench/runs/r{run}"), &body).await.ok();
    }
    let (before_s, before_kib) = (cpu_seconds(), resident_kib());
    let started = Instant::now();
    let num_connections = options.num_runs.min(NUM_CONNECTIONS_MAX);
    let posting = (0..num_connections).map(|first_run| {
        let runs: Vec<usize> = (first_run..options.num_runs).step_by(num_connections).collect();
        let (api, bodies, is_cbor) = (server.api.clone(), Arc::clone(&bodies), options.is_cbor);
        tokio::spawn(async move { post(&api, &runs, &bodies, is_cbor).await })
    });
    let mut latencies = Vec::new();
    for connection in posting.collect::<Vec<_>>() {
        latencies.extend(connection.await.unwrap());
    }
    let elapsed_s = started.elapsed().as_secs_f64();
    latencies.sort_unstable();
    let total = (options.num_runs * options.num_scans) as f64;
    let at = |share: f64| latencies[((latencies.len() - 1) as f64 * share) as usize].as_secs_f64() * 1e3;
    let site = server.api.get("/v1/sites/bench").await.ok();
    let num_body_bytes: usize = bodies.iter().map(Vec::len).sum();
    println!("{total} scans of {NUM_RANGES} ranges, {} runs, batches of {}", options.num_runs, options.batch);
    println!(
        "  {:.0} scans/s, {:.1} µs CPU per scan (server and client)",
        total / elapsed_s,
        (cpu_seconds() - before_s) / total * 1e6
    );
    println!("  latency p50 {:.1} ms, p99 {:.1} ms", at(0.5), at(0.99));
    println!("  {:.0} bytes per scan sent", num_body_bytes as f64 / options.num_scans as f64);
    println!("  {:.0} bytes per scan on disk", site["bytes_on_disk"].as_f64().unwrap() / total);
    println!(
        "  {:.0} KiB of memory more per open run",
        (resident_kib() - before_kib) / options.num_runs as f64
    );
    server.stop().await;
}

fn bodies(options: &Options) -> Vec<Vec<u8>> {
    let scans = drive_with(options.num_scans, 1, NUM_RANGES);
    let batches = scans.chunks(options.batch).enumerate();
    batches
        .map(|(idx, scans)| {
            let body = json!({"first_sequence": idx * options.batch, "scans": scans});
            if options.is_cbor { cbor(&body) } else { serde_json::to_vec(&body).unwrap() }
        })
        .collect()
}

/// The batch as CBOR with the readings of a scan as one byte string.
fn cbor(body: &serde_json::Value) -> Vec<u8> {
    let mut value = ciborium::Value::serialized(body).unwrap();
    let scans = entry(&mut value, "scans").as_array_mut().unwrap();
    for (scan, sent) in scans.iter_mut().zip(body["scans"].as_array().unwrap()) {
        let ranges = sent["ranges_m"].as_array().unwrap();
        let floats = ranges.iter().map(|range_m| range_m.as_f64().map_or(f32::NAN, |range_m| range_m as f32));
        *entry(scan, "ranges_m") = ciborium::Value::Bytes(floats.flat_map(f32::to_le_bytes).collect());
    }
    let mut bytes = Vec::new();
    ciborium::into_writer(&value, &mut bytes).unwrap();
    bytes
}

fn entry<'a>(map: &'a mut ciborium::Value, name: &str) -> &'a mut ciborium::Value {
    let entries = map.as_map_mut().unwrap();
    entries.iter_mut().find(|(key, _)| key.as_text() == Some(name)).map(|(_, value)| value).unwrap()
}

/// Posts every batch to each of the runs in turn.
async fn post(api: &Api, runs: &[usize], bodies: &[Vec<u8>], is_cbor: bool) -> Vec<Duration> {
    let content_type = if is_cbor { "application/cbor" } else { "application/json" };
    let headers = [("content-type", content_type)];
    let mut latencies = Vec::with_capacity(runs.len() * bodies.len());
    for body in bodies {
        for run in runs {
            let path = format!("/v1/sites/bench/runs/r{run}/batches");
            let started = Instant::now();
            api.send(reqwest::Method::POST, &path, &headers, body.clone()).await.unwrap().ok();
            latencies.push(started.elapsed());
        }
    }
    latencies
}

/// User and system time of this process, seconds.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<f64> = stat
        .rsplit(')')
        .next()
        .unwrap_or("")
        .split_whitespace()
        .map(|field| field.parse().unwrap_or(0.0))
        .collect();
    fields.get(11).zip(fields.get(12)).map_or(0.0, |(user, system)| (user + system) / 100.0)
}

fn resident_kib() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0.0)
}
