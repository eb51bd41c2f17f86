//! A server of the evaluation's own, on a free port, with a directory that goes away; and recordings sent to it.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use clap::Args;
use indicatif::MultiProgress;
use locution_client::Client;
use locution_engine::formats::CarmenOptions;

use crate::replay::Format;
use crate::upload::{UploadOptions, Uploaded, build_with_progress, progress_bar, upload_recording};
use locution_lab::recordings::{Recording, read_recording};
use locution_server::config::ServerConfig;
use locution_server::{RunningServer, start_server};

/// A server that nobody else uses.
pub struct LocalServer {
    running: RunningServer,
    /// Speaks to it.
    pub client: Client,
    /// Kept for its end: the directory is removed with it.
    _directory: tempfile::TempDir,
}

impl LocalServer {
    /// Starts it.
    ///
    /// # Errors
    /// No temporary directory or no port can be had.
    pub async fn start() -> Result<Self> {
        let directory = tempfile::tempdir().context("no temporary directory")?;
        let mut config = ServerConfig::default();
        config.address.set_port(0);
        config.data_directory = directory.path().to_owned();
        // Builds are asked for when everything is there, so that none disturbs the timing.
        config.builds.is_automatic = false;
        let running = start_server(config).await?;
        let client = Client::new(&running.url())?;
        Ok(Self { running, client, _directory: directory })
    }

    /// Stops it and removes its data.
    ///
    /// # Errors
    /// The storage could not be closed.
    pub async fn stop(self) -> Result<()> {
        Ok(self.running.shutdown().await?)
    }
}

/// Which recordings to send, and how; common to all evaluations.
#[derive(Debug, Args)]
pub struct RecordingArguments {
    /// CARMEN log, plain or gzipped; give several for several runs of one site.
    #[arg(long = "log", required = true, num_args = 1..)]
    pub logs: Vec<PathBuf>,
    /// JSON file with the engine's configuration, whole or in part [default: the defaults].
    #[arg(long)]
    config: Option<PathBuf>,
    /// How scans travel.
    #[arg(long, value_enum, default_value = "json")]
    format: Format,
    /// Scans per batch.
    #[arg(long, default_value_t = 100)]
    batch: usize,
    /// Readings at or above this many metres are no return [default: as the logs show].
    #[arg(long)]
    range_max: Option<f64>,
}

/// A recording on the server.
pub struct SentRecording {
    /// What was sent; its name is the run's.
    pub recording: Recording,
    /// How the sending went.
    pub uploaded: Uploaded,
    /// By how much the site grew on disk.
    pub bytes_on_disk: u64,
}

/// The site that evaluations use.
pub const SITE: &str = "evaluation";

impl RecordingArguments {
    /// Reads all logs. Two files of one name become runs of different names.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn read(&self) -> Result<Vec<Recording>> {
        ensure!(self.batch > 0, "--batch must be above zero");
        let options = CarmenOptions { range_max_m: self.range_max, ..CarmenOptions::default() };
        let mut recordings: Vec<Recording> = Vec::new();
        for path in &self.logs {
            let mut recording = read_recording(path, options)?;
            if recordings.iter().any(|other| other.name == recording.name) {
                recording.name = format!("{}-{}", recording.name, recordings.len() + 1);
            }
            recordings.push(recording);
        }
        Ok(recordings)
    }

    /// Makes the site and sends the recordings one after the other, so that each can be timed.
    ///
    /// # Errors
    /// The server refused something.
    pub async fn send(&self, server: &LocalServer, recordings: Vec<Recording>) -> Result<Vec<SentRecording>> {
        let config = self.config.as_ref().map(|path| -> Result<serde_json::Value> {
            let text =
                std::fs::read_to_string(path).with_context(|| format!("cannot open {}", path.display()))?;
            serde_json::from_str(&text).with_context(|| path.display().to_string())
        });
        server.client.put_site(SITE, config.transpose()?.as_ref()).await?;
        let options = UploadOptions {
            encoding: self.format.into(),
            num_scans_per_batch: self.batch,
            ..UploadOptions::default()
        };
        let bars = MultiProgress::new();
        let (mut sent, mut bytes_before) = (Vec::new(), server.client.site(SITE).await?.bytes_on_disk);
        for recording in recordings {
            let bar = progress_bar(&bars, &recording.name, recording.log.scans.len());
            let names = (SITE, recording.name.as_str(), recording.name.as_str());
            let uploaded = upload_recording(&server.client, names, &recording.log, &options, &bar).await?;
            let bytes_after = server.client.site(SITE).await?.bytes_on_disk;
            let bytes_on_disk = bytes_after.saturating_sub(bytes_before);
            bytes_before = bytes_after;
            sent.push(SentRecording { recording, uploaded, bytes_on_disk });
        }
        Ok(sent)
    }
}

/// Builds the map of the site and says how long it took, in seconds.
///
/// # Errors
/// The build failed.
pub async fn build_map(server: &LocalServer) -> Result<f64> {
    let began = Instant::now();
    build_with_progress(&server.client, SITE).await?;
    Ok(began.elapsed().as_secs_f64())
}
