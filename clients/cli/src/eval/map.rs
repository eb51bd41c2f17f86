//! `locution eval map`: recordings in over HTTP, the map's trajectory out, judged by hand-verified relative poses.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Result, ensure};
use clap::{Args, ValueEnum};
use locution_engine::geometry::Pose2;
use locution_lab::evaluation::{EstimatedPose, MapErrorReport, judge_map};
use serde::Serialize;

use super::local_server::{LocalServer, RecordingArguments, SITE, build_map};
use locution_lab::recordings::read_relations;
use locution_lab::report::write_json;

/// Which poses are judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Frame {
    /// Those of the optimised map.
    Map,
    /// Those of the run alone: odometry refined against the recent scans, before any loop is closed.
    Run,
    /// Odometry as sent.
    Odom,
}

impl Frame {
    const fn name(self) -> &'static str {
        match self {
            Self::Map => "map",
            Self::Run => "run",
            Self::Odom => "odom",
        }
    }
}

/// One relations file for each log, in the same order.
#[derive(Debug, Args)]
pub struct MapArguments {
    #[command(flatten)]
    recordings: RecordingArguments,
    /// Relations of the Freiburg SLAM benchmark, plain or gzipped; one for each log.
    #[arg(long, required = true, num_args = 1..)]
    relations: Vec<PathBuf>,
    /// Which poses are judged.
    #[arg(long, value_enum, default_value = "map")]
    frame: Frame,
    /// Write the report here.
    #[arg(long)]
    json: Option<PathBuf>,
}

#[derive(Serialize)]
struct MapReport {
    recordings: Vec<String>,
    frame: &'static str,
    #[serde(flatten)]
    error: MapErrorReport,
    seconds: f64,
    build_seconds: f64,
}

pub(super) async fn run(arguments: &MapArguments) -> Result<()> {
    let num_logs = arguments.recordings.logs.len();
    ensure!(arguments.relations.len() == num_logs, "give one --relations for each --log, in the same order");
    let recordings = arguments.recordings.read()?;
    let server = LocalServer::start().await?;
    let began = Instant::now();
    let sent = arguments.recordings.send(&server, recordings).await?;
    let build_seconds = if arguments.frame == Frame::Map { build_map(&server).await? } else { 0.0 };
    let (mut poses, mut relations) = (Vec::new(), Vec::new());
    for (idx, (sent, path)) in sent.iter().zip(&arguments.relations).enumerate() {
        let trajectory = server.client.trajectory(SITE, &sent.recording.name, arguments.frame.name()).await?;
        let component = trajectory.component.unwrap_or(idx as u64);
        poses.extend(trajectory.poses.iter().map(|pose| EstimatedPose {
            timestamp_ns: pose.timestamp_ns,
            component,
            map_from_robot: Pose2::new(pose.x, pose.y, pose.theta),
        }));
        relations.extend(read_relations(path)?);
    }
    let report = MapReport {
        recordings: sent.iter().map(|sent| sent.recording.name.clone()).collect(),
        frame: arguments.frame.name(),
        error: judge_map(&poses, &relations),
        seconds: began.elapsed().as_secs_f64(),
        build_seconds,
    };
    let error = &report.error;
    println!("\nMap error of {} ({} poses)", report.recordings.join(", "), report.frame);
    println!("  relations    {} judged, {} skipped", error.relations, error.skipped);
    println!("  translation  {:.4} ± {:.4} m", error.translation_m.mean, error.translation_m.sd);
    println!("  rotation     {:.3} ± {:.3} °", error.rotation_deg.mean, error.rotation_deg.sd);
    println!("  time         {:.1} s, of which building the map {build_seconds:.1} s", report.seconds);
    if let Some(path) = &arguments.json {
        write_json(path, &report)?;
    }
    server.stop().await
}
