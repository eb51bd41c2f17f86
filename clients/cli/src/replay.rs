//! `locution replay`: posts CARMEN logs to a running server, as their robots would have.

use std::path::PathBuf;

use anyhow::{Result, ensure};
use clap::{Args, ValueEnum};
use futures::future::try_join_all;
use indicatif::MultiProgress;
use locution_client::{Client, Encoding};
use locution_engine::formats::CarmenOptions;

use super::upload::{UploadOptions, progress_bar, upload_recording};
use locution_lab::recordings::{Recording, read_recording};

/// How scans travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Readable.
    Json,
    /// Smaller and faster.
    Cbor,
}

impl From<Format> for Encoding {
    fn from(format: Format) -> Self {
        match format {
            Format::Json => Self::Json,
            Format::Cbor => Self::Cbor,
        }
    }
}

/// Every file becomes a run; what the server already has of it is not sent again.
#[derive(Debug, Args)]
pub struct ReplayArguments {
    /// CARMEN logs (FLASER or ROBOTLASER1), plain or gzipped; several are sent at once.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// The server.
    #[arg(long, default_value = "http://127.0.0.1:7070", env = "LOCUTION_URL")]
    url: String,
    /// API key, when the server asks for one.
    #[arg(long, env = "LOCUTION_API_KEY", hide_env_values = true)]
    api_key: Option<String>,
    /// The site to which the runs belong; made when missing.
    #[arg(long)]
    site: String,
    /// Name of the robot [default: the name of the file].
    #[arg(long)]
    robot: Option<String>,
    /// Name of the run, when there is one file [default: the name of the file].
    #[arg(long)]
    run: Option<String>,
    /// Times the recorded speed [default: as fast as the server takes them].
    #[arg(long)]
    rate: Option<f64>,
    /// How scans travel.
    #[arg(long, value_enum, default_value = "json")]
    format: Format,
    /// Scans per batch.
    #[arg(long, default_value_t = 100)]
    batch: usize,
    /// Readings at or above this many metres are no return [default: as the log shows].
    #[arg(long)]
    range_max: Option<f64>,
    /// Pass over lines that cannot be read.
    #[arg(long)]
    skip_malformed: bool,
    /// Leave the runs open for more scans.
    #[arg(long)]
    keep_open: bool,
}

/// Replays all files.
///
/// # Errors
/// A file that cannot be read; a server that refuses or does not answer.
pub fn run(arguments: &ReplayArguments) -> Result<()> {
    ensure!(
        arguments.run.is_none() || arguments.files.len() == 1,
        "--run names one run, but there are several files"
    );
    ensure!(arguments.rate.is_none_or(|rate| rate > 0.0), "--rate must be above zero");
    ensure!(arguments.batch > 0, "--batch must be above zero");
    let options =
        CarmenOptions { range_max_m: arguments.range_max, skip_malformed: arguments.skip_malformed };
    let mut recordings: Vec<Recording> = Vec::new();
    for file in &arguments.files {
        let mut recording = read_recording(file, options)?;
        for skipped in &recording.log.skipped {
            eprintln!("{}: {skipped}", file.display());
        }
        if let Some(run) = &arguments.run {
            recording.name.clone_from(run);
        }
        let is_taken = recordings.iter().any(|other| other.name == recording.name);
        ensure!(!is_taken, "two files would become the run '{}'", recording.name);
        recordings.push(recording);
    }
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    runtime.block_on(replay(arguments, &recordings))
}

async fn replay(arguments: &ReplayArguments, recordings: &[Recording]) -> Result<()> {
    let mut client = Client::new(&arguments.url)?;
    if let Some(api_key) = &arguments.api_key {
        client = client.with_api_key(api_key);
    }
    let site = arguments.site.as_str();
    // A site that stands with a configuration of its own is used as it is.
    if client.site(site).await.is_err() {
        client.put_site(site, None).await?;
    }
    let options = UploadOptions {
        encoding: arguments.format.into(),
        num_scans_per_batch: arguments.batch,
        rate: arguments.rate,
        is_finishing: !arguments.keep_open,
    };
    let bars = MultiProgress::new();
    let uploads = recordings.iter().map(|recording| {
        let bar = progress_bar(&bars, &recording.name, recording.log.scans.len());
        let (client, options) = (&client, &options);
        async move {
            let robot = arguments.robot.as_deref().unwrap_or(&recording.name);
            upload_recording(client, (site, &recording.name, robot), &recording.log, options, &bar).await
        }
    });
    let uploads = try_join_all(uploads).await?;
    for (recording, uploaded) in recordings.iter().zip(&uploads) {
        println!(
            "{}: {} scans posted in {:.1} s ({:.0} scans/s), {} observations, {} words",
            recording.name,
            uploaded.num_scans,
            uploaded.duration_s,
            uploaded.num_scans as f64 / uploaded.duration_s.max(1e-9),
            uploaded.num_observations,
            uploaded.num_words,
        );
    }
    Ok(())
}
