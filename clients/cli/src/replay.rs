//! `locution replay`: posts recordings to a running server, as their robots would have.

use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use clap::{Args, ValueEnum};
use futures::future::try_join_all;
use locution_client::{Client, Encoding, MapAt, RunUpload};
use locution_engine::formats::CarmenOptions;

use super::bags::{BagOptions, BagRecording, is_bag, read_bag};
use super::upload::{
    UploadOptions, Uploaded, build_with_progress, open_run, progress_bar, reach_server, upload_recording,
};
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
    /// CARMEN logs (FLASER or ROBOTLASER1), plain or gzipped; MCAP files, or folders of them, of ROS 1 or ROS 2; bags of
    /// ROS 1. Runs are made in this order and sent at once.
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
    /// Where the runs belong, for instance a floor; they are never joined to runs of another area.
    #[arg(long)]
    area: Option<String>,
    /// Name of the run, when there is one file [default: the name of the file].
    #[arg(long)]
    run: Option<String>,
    /// Times the recorded speed; gaps of more than 5 s between scans are not waited for [default: as fast as the
    /// server takes them].
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
    /// Angle that the readings of FLASER messages cover, degrees [default: as the log states].
    #[arg(long, value_name = "DEGREES")]
    fov: Option<f64>,
    /// Topic of the laser in a bag [default: the only one, or the usual one].
    #[arg(long, value_name = "TOPIC")]
    scan_topic: Option<String>,
    /// Topic of the odometry in a bag [default: the only one, or the usual one, or tf].
    #[arg(long, value_name = "TOPIC")]
    odom_topic: Option<String>,
    /// Pass over lines that cannot be read, and over what follows where a packed file is cut off.
    #[arg(long)]
    skip_malformed: bool,
    /// Build the map when everything is posted, and wait for it.
    #[arg(long)]
    wait: bool,
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
    let options = CarmenOptions {
        range_max_m: arguments.range_max,
        field_of_view_deg: arguments.fov,
        skip_malformed: arguments.skip_malformed,
    };
    let mut recordings: Vec<Recording> = Vec::new();
    for file in &arguments.files {
        let mut recording = arguments.read(file, options)?;
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
    reach_server(&client).await?;
    let site = arguments.site.as_str();
    // A site that stands with a configuration of its own is used as it is.
    if let Err(error) = client.site(site).await {
        ensure!(error.problem().is_some_and(|problem| problem.status == 404), error);
        client.put_site(site, None).await?;
    }
    let options = UploadOptions {
        encoding: arguments.format.into(),
        num_scans_per_batch: arguments.batch,
        rate: arguments.rate,
        is_finishing: !arguments.keep_open,
        area: arguments.area.clone(),
    };
    // One after the other, since a site's runs are ordered by when they were made.
    let mut opened: Vec<(&Recording, RunUpload)> = Vec::new();
    for recording in recordings {
        let robot = arguments.robot.as_deref().unwrap_or(&recording.name);
        let names = (site, recording.name.as_str(), robot);
        opened.push((recording, open_run(&client, names, &recording.log, &options).await?));
    }
    let num_scans = recordings.iter().map(|recording| recording.log.scans.len()).sum();
    let bar = progress_bar(site, num_scans);
    let uploads = opened.into_iter().map(|(recording, upload)| {
        upload_recording(&client, (site, &recording.name), upload, &recording.log, &options, &bar)
    });
    let uploads = try_join_all(uploads).await?;
    bar.finish_and_clear();
    for (recording, uploaded) in recordings.iter().zip(&uploads) {
        println!("{}", summary(&recording.name, uploaded));
    }
    if arguments.wait {
        build_with_progress(&client, site).await?;
    }
    print_where_to_look(&client, site, arguments.wait).await
}

impl ReplayArguments {
    /// Reads a recording of any format, and says on standard error what there is to say of it.
    fn read(&self, file: &Path, options: CarmenOptions) -> Result<Recording> {
        if !is_bag(file)? {
            let recording = read_recording(file, options)?;
            for skipped in &recording.log.skipped {
                eprintln!("{}: {skipped}", file.display());
            }
            return Ok(recording);
        }
        let options = BagOptions {
            scan_topic: self.scan_topic.clone(),
            odometry_topic: self.odom_topic.clone(),
            range_max_m: self.range_max,
            skip_malformed: self.skip_malformed,
        };
        let BagRecording { recording, notes } = read_bag(file, &options)?;
        for note in notes {
            eprintln!("{}: {note}", file.display());
        }
        Ok(recording)
    }
}

fn summary(run: &str, uploaded: &Uploaded) -> String {
    format!(
        "{run}: {} scans posted in {:.1} s ({:.0} scans/s), {} observations, {} words",
        uploaded.num_scans,
        uploaded.duration_s,
        uploaded.num_scans as f64 / uploaded.duration_s.max(1e-9),
        uploaded.num_observations,
        uploaded.num_words,
    )
}

async fn print_where_to_look(client: &Client, site: &str, is_built: bool) -> Result<()> {
    let url = client.base_url();
    if is_built {
        let map = client.map(site, MapAt::default()).await?;
        println!("map version {} is served, in {} part(s)", map.version, map.components.len());
    } else {
        println!("the server builds the map in the background; --wait waits for it");
    }
    println!("to look at: {url}/ui");
    println!("            {url}/v1/sites/{site}/map/picture.png");
    println!("            {url}/v1/sites/{site}/map");
    Ok(())
}
