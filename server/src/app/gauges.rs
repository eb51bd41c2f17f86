//! What is looked up when somebody asks for the metrics.

use std::sync::{Arc, PoisonError};

use super::App;
use super::site::Site;

impl App {
    /// Tells the metrics what cannot be counted as it happens. Nothing here waits for a lock that work holds.
    pub async fn observe(&self) {
        let sites: Vec<Arc<Site>> =
            self.sites.lock().unwrap_or_else(PoisonError::into_inner).values().cloned().collect();
        let (mut num_queued, mut num_running, mut num_index_bytes, mut num_stored_bytes) = (0, 0, 0, 0);
        for site in &sites {
            let (queued, running) = site.jobs().num_jobs();
            num_queued += queued;
            num_running += running;
            num_index_bytes += site.num_index_bytes();
            num_stored_bytes += site.store().num_bytes_on_disk().await.unwrap_or(0);
        }
        metrics::gauge!("locution_sites").set(sites.len() as f64);
        metrics::gauge!("locution_jobs", "state" => "queued").set(num_queued as f64);
        metrics::gauge!("locution_jobs", "state" => "running").set(num_running as f64);
        metrics::gauge!("locution_text_index_bytes").set(num_index_bytes as f64);
        metrics::gauge!("locution_storage_bytes").set(num_stored_bytes as f64);
        metrics::gauge!("locution_localizations").set(self.localizations.num_sessions() as f64);
        if let Some(num_free) = num_free_bytes(&self.config.data_directory) {
            metrics::gauge!("locution_disk_free_bytes").set(num_free as f64);
        }
    }
}

/// Bytes that a file system has left for this process, where the system tells.
fn num_free_bytes(directory: &std::path::Path) -> Option<u64> {
    #[cfg(unix)]
    {
        let stat = rustix::fs::statvfs(directory).ok()?;
        Some(stat.f_bavail * stat.f_frsize)
    }
    #[cfg(not(unix))]
    None
}
