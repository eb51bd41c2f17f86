//! What `/metrics` says: every name with its meaning, and what is looked up when somebody asks.
//!
//! No name of a site, a run or a key is a label: any key that may read sees the same figures of the whole server.

use std::sync::OnceLock;

use metrics::{Unit, describe_counter, describe_gauge, describe_histogram};
use metrics_exporter_prometheus::{Matcher, PrometheusBuilder, PrometheusHandle};

use crate::state::AppState;

/// Bounds of the buckets of all durations, seconds.
const BUCKETS_S: [f64; 17] = [
    0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 60.0, 300.0, 1800.0,
];

/// Counters, which only grow.
const COUNTERS: [(&str, &str); 8] = [
    ("locution_http_requests_total", "Requests answered, by method, route and status"),
    ("locution_refusals_total", "Requests answered with a problem, by its type"),
    ("locution_connections_refused_total", "Connections refused because all others were at work"),
    ("locution_connections_evicted_total", "Connections that made way for another while they sent nothing"),
    ("locution_batches_total", "Batches accepted"),
    ("locution_scans_total", "Scans accepted"),
    ("locution_closures_total", "Matches verified by builds that the map version before did not have"),
    ("locution_jobs_failed_total", "Jobs that failed"),
];

/// Durations.
const HISTOGRAMS: [(&str, &str); 6] = [
    ("locution_http_request_seconds", "From the head of a request to the head of its answer, by route"),
    ("locution_batch_seconds", "From a batch at the head of its run's queue to its commit"),
    ("locution_translate_seconds", "Translation of a batch"),
    ("locution_commit_seconds", "A commit, from its call until it is on disk"),
    ("locution_storage_sync_seconds", "One sync of the storage, shared by the commits that waited for it"),
    ("locution_build_seconds", "Builds of maps"),
];

/// Values that go up and down.
const GAUGES: [(&str, Unit, &str); 16] = [
    ("locution_build_info", Unit::Count, "Always 1; the label says which version runs"),
    ("locution_connections_open", Unit::Count, "Open connections"),
    ("locution_requests_served", Unit::Count, "Requests being served; their bodies are there"),
    ("locution_batches_queued", Unit::Count, "Batches and examples waiting or being worked on"),
    ("locution_received_body_bytes", Unit::Bytes, "Bodies being received or served"),
    ("locution_parsed_body_bytes", Unit::Bytes, "Memory that bodies being served take at worst"),
    ("locution_sites", Unit::Count, "Sites that are open"),
    ("locution_open_runs", Unit::Count, "Runs whose translator is in memory"),
    ("locution_jobs", Unit::Count, "Jobs waiting or running, by state"),
    ("locution_localizations", Unit::Count, "Localisation sessions"),
    ("locution_text_index_bytes", Unit::Bytes, "Indexes of texts in memory"),
    ("locution_storage_bytes", Unit::Bytes, "Bytes on disk of all open sites"),
    ("locution_disk_free_bytes", Unit::Bytes, "Bytes that the data directory's file system has left"),
    ("process_resident_memory_bytes", Unit::Bytes, "Memory of the process"),
    ("process_open_fds", Unit::Count, "Open files and sockets of the process"),
    ("process_start_time_seconds", Unit::Seconds, "When the process started, since 1970"),
];

/// Every name that `/metrics` knows.
pub fn names() -> Vec<&'static str> {
    let counted = COUNTERS.iter().chain(&HISTOGRAMS).map(|(name, _)| *name);
    counted.chain(GAUGES.iter().map(|(name, ..)| *name)).collect()
}

/// The process has one recorder; servers in one process, as in tests, share it.
pub(crate) fn handle() -> PrometheusHandle {
    static HANDLE: OnceLock<PrometheusHandle> = OnceLock::new();
    let install = || {
        let recorder = PrometheusBuilder::new()
            .set_buckets_for_metric(Matcher::Suffix("_seconds".into()), &BUCKETS_S)
            .expect("the list of buckets is not empty")
            .build_recorder();
        let handle = recorder.handle();
        if metrics::set_global_recorder(recorder).is_err() {
            tracing::warn!("another metrics recorder is installed; /metrics will stay empty");
        }
        describe();
        handle
    };
    HANDLE.get_or_init(install).clone()
}

fn describe() {
    COUNTERS.iter().for_each(|(name, meaning)| describe_counter!(*name, *meaning));
    HISTOGRAMS.iter().for_each(|(name, meaning)| describe_histogram!(*name, Unit::Seconds, *meaning));
    GAUGES.iter().for_each(|(name, unit, meaning)| describe_gauge!(*name, *unit, *meaning));
    metrics::gauge!("locution_build_info", "version" => env!("CARGO_PKG_VERSION")).set(1.0);
    metrics::gauge!("process_start_time_seconds").set(crate::auth::now_s() as f64);
    // Counters are there from the start, so that the first increase is seen as one.
    for name in ["locution_batches_total", "locution_scans_total", "locution_closures_total"] {
        metrics::counter!(name).increment(0);
    }
    for name in ["locution_connections_refused_total", "locution_connections_evicted_total"] {
        metrics::counter!(name).increment(0);
    }
    metrics::counter!("locution_jobs_failed_total").increment(0);
}

/// The page, with everything looked up that is not counted as it happens.
pub(crate) async fn render(state: &AppState) -> String {
    state.places.observe();
    state.app.observe().await;
    observe_process();
    state.metrics.render()
}

/// What the system says of the process, where it says it in files.
fn observe_process() {
    if let Ok(status) = std::fs::read_to_string("/proc/self/status") {
        let resident = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let kib = resident.and_then(|text| text.trim().trim_end_matches(" kB").parse::<f64>().ok());
        if let Some(kib) = kib {
            metrics::gauge!("process_resident_memory_bytes").set(kib * 1024.0);
        }
    }
    if let Ok(files) = std::fs::read_dir("/proc/self/fd") {
        metrics::gauge!("process_open_fds").set(files.count() as f64);
    }
}
