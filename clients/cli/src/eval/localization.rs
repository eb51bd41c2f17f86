//! `locution eval localization`: robots switched on at random moments of one recording, on the map of another.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use locution_client::{Client, Frame, LocalizationState, NewLocalization, Scan};
use locution_engine::formats::{CarmenLog, CarmenOptions};
use locution_engine::geometry::Pose2;
use locution_lab::evaluation::{
    LocalizationReport, LocalizationTrial, OdometryPose, TrialOutcome, join_truth, judge_localization,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::local_server::{LocalServer, SITE, build_map};
use crate::upload::{UploadOptions, open_run, progress_bar, upload_recording};
use crate::wire::{wire_geometry, wire_scan};
use locution_lab::recordings::{Recording, read_recording, read_truth};
use locution_lab::report::write_json;

/// A start is only fair where the map has been: nearer than this to a mapped place.
pub(super) const MAPPED_M: f64 = 2.0;

/// The first truth belongs to the map's recording, the second to the other.
#[derive(Debug, Args)]
pub struct LocalizationArguments {
    #[command(flatten)]
    recordings: MapAndLog,
    /// Number of robots switched on.
    #[arg(long, default_value_t = 100)]
    trials: usize,
    /// A robot that is not sure after driving this far, in metres, is unsure.
    #[arg(long, default_value_t = 20.0)]
    meters: f64,
    /// Chooses the moments.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write the report here.
    #[arg(long)]
    json: Option<PathBuf>,
}

/// The recording of a map and the one that is looked for in it.
#[derive(Debug, Args)]
pub(super) struct MapAndLog {
    /// CARMEN log of which the map is made.
    #[arg(long)]
    map_from: PathBuf,
    /// CARMEN log that is looked for in it; may be the same file when parts are given.
    #[arg(long)]
    log: PathBuf,
    /// True poses of --map-from, then of --log, in one frame.
    #[arg(long, required = true, num_args = 1..)]
    truth: Vec<PathBuf>,
    /// Part of --map-from that is used, from and to as shares of its scans.
    #[arg(long, value_delimiter = ',', default_value = "0,1")]
    map_part: Vec<f64>,
    /// Part of --log that is used.
    #[arg(long, value_delimiter = ',', default_value = "0,1")]
    part: Vec<f64>,
}

impl MapAndLog {
    /// Reads both with their truths.
    pub fn read(&self) -> Result<(Known, Known)> {
        let [map_truth, log_truth] = self.truth.as_slice() else {
            bail!("give two files to --truth: of --map-from, then of --log");
        };
        Ok((known(&self.map_from, map_truth, &self.map_part)?, known(&self.log, log_truth, &self.part)?))
    }
}

/// A recording with a true pose for each scan that has one.
pub(super) struct Known {
    pub recording: Recording,
    pub truth: Vec<Option<Pose2>>,
    /// Metres driven at each scan, by odometry.
    pub travel_m: Vec<f64>,
}

#[derive(Serialize)]
struct Report {
    map_from: String,
    log: String,
    #[serde(flatten)]
    localization: LocalizationReport,
    seconds: f64,
}

pub(super) async fn run(arguments: &LocalizationArguments) -> Result<()> {
    let (map, log) = arguments.recordings.read()?;
    let began = std::time::Instant::now();
    let server = LocalServer::start().await?;
    let mapped = build(&server, &map, None).await?;
    let starts = starts(&log, &mapped, arguments);
    ensure!(
        !starts.is_empty(),
        "no scan of the log lies within {MAPPED_M} m of the map with enough driving after it"
    );
    let style = ProgressStyle::with_template("{prefix} {bar:32.cyan/white} {pos:>4}/{len}  {msg}")?;
    let bar = ProgressBar::new(starts.len() as u64).with_style(style).with_prefix("localising");
    let mut trials = Vec::new();
    for (idx, &start) in starts.iter().enumerate() {
        trials.push(trial(&server.client, &log, start, &mapped, arguments.meters).await?);
        let found = trials.iter().filter(|trial| trial.outcome() == TrialOutcome::Found).count();
        let wrong = trials.iter().filter(|trial| trial.outcome() == TrialOutcome::WronglySure).count();
        bar.set_message(format!("{found} found, {wrong} wrongly sure, {} unsure", idx + 1 - found - wrong));
        bar.inc(1);
    }
    bar.finish();
    let report = Report {
        map_from: map.recording.name.clone(),
        log: log.recording.name.clone(),
        localization: judge_localization(&trials),
        seconds: began.elapsed().as_secs_f64(),
    };
    print_report(&report);
    if let Some(path) = &arguments.json {
        write_json(path, &report)?;
    }
    server.stop().await
}

/// Reads a part of a recording with its truth.
fn known(log: &Path, truth: &Path, part: &[f64]) -> Result<Known> {
    let &[from, to] = part else { bail!("a part is two shares, such as 0,0.5") };
    ensure!((0.0..=1.0).contains(&from) && from < to && to <= 1.0, "a part is two rising shares of 0 to 1");
    let mut recording = read_recording(log, CarmenOptions::default())?;
    let odometry: Vec<OdometryPose> = recording
        .log
        .scans
        .iter()
        .map(|scan| OdometryPose { timestamp_ns: scan.timestamp_ns, odom_from_robot: scan.odom_from_robot })
        .collect();
    let mut truth = join_truth(&odometry, &read_truth(truth)?);
    let at = |share: f64| (share * odometry.len() as f64).round() as usize;
    recording.log.scans = recording.log.scans[at(from)..at(to)].to_vec();
    truth = truth[at(from)..at(to)].to_vec();
    let travel_m = travel(&recording.log);
    Ok(Known { recording, truth, travel_m })
}

/// Metres driven at each scan, by odometry.
pub(super) fn travel(log: &CarmenLog) -> Vec<f64> {
    let mut driven_m = 0.0;
    let mut last: Option<Pose2> = None;
    log.scans
        .iter()
        .map(|scan| {
            driven_m += last.map_or(0.0, |last| last.distance(&scan.odom_from_robot));
            last = Some(scan.odom_from_robot);
            driven_m
        })
        .collect()
}

/// Sends the map's recording and answers pairs of (true, mapped) poses along it.
pub(super) async fn build(
    server: &LocalServer,
    map: &Known,
    config: Option<&serde_json::Value>,
) -> Result<Vec<(Pose2, Pose2)>> {
    server.client.put_site(SITE, config).await?;
    let name = map.recording.name.as_str();
    let bar = progress_bar(name, map.recording.log.scans.len());
    let options = UploadOptions::default();
    let upload = open_run(&server.client, (SITE, name, name), &map.recording.log, &options).await?;
    upload_recording(&server.client, (SITE, name), upload, &map.recording.log, &options, &bar).await?;
    bar.finish();
    build_map(server).await?;
    let trajectory = server.client.trajectory(SITE, name, Frame::Map, None).await?;
    let pairs = trajectory.poses.iter().filter_map(|pose| {
        let truth = (*map.truth.get(usize::try_from(pose.scan_seq).ok()?)?)?;
        Some((truth, Pose2::new(pose.x, pose.y, pose.theta)))
    });
    Ok(pairs.collect())
}

/// Random scans from which a robot can drive far enough, within the mapped area.
fn starts(log: &Known, mapped: &[(Pose2, Pose2)], arguments: &LocalizationArguments) -> Vec<usize> {
    let end_m = log.travel_m.last().copied().unwrap_or(0.0);
    let is_fair = |idx: &usize| {
        let near = |truth: Pose2| mapped.iter().any(|(known, _)| known.distance(&truth) < MAPPED_M);
        end_m - log.travel_m[*idx] >= arguments.meters && log.truth[*idx].is_some_and(near)
    };
    let fair: Vec<usize> = (0..log.travel_m.len()).filter(is_fair).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(arguments.seed);
    let num_trials = if fair.is_empty() { 0 } else { arguments.trials };
    (0..num_trials).map(|_| fair[rng.random_range(0..fair.len())]).collect()
}

/// Switches a robot on at a scan and drives until it is sure or has driven far enough.
async fn trial(
    client: &Client,
    log: &Known,
    start: usize,
    mapped: &[(Pose2, Pose2)],
    limit_m: f64,
) -> Result<LocalizationTrial> {
    let recording = &log.recording;
    let geometry = wire_geometry(&recording.log.geometry);
    let robot = NewLocalization { robot: Some("evaluation".into()), geometry, prior: None, area: None };
    let opened = client.open_localization(SITE, &robot).await.context("a localisation cannot be opened")?;
    let mut next = start;
    let mut answered = None;
    while answered.is_none() && log.travel_m[next] - log.travel_m[start] < limit_m {
        // A batch for every half metre, as a robot would send them.
        let goes_on = |idx: &usize| log.travel_m[*idx] - log.travel_m[next] < 0.5 && idx - next < 200;
        let end = (next..log.travel_m.len()).take_while(goes_on).count() + next;
        let geometry = &recording.log.geometry;
        let scans: Vec<Scan> =
            recording.log.scans[next..end].iter().map(|scan| wire_scan(geometry, scan)).collect();
        let answer = client.localize(SITE, &opened.id, (next - start) as u64, &scans).await?;
        next = end.min(log.travel_m.len() - 1);
        if answer.state == LocalizationState::Converged {
            answered = answer.hypotheses.first().map(|best| (end - 1, best.map_from_robot));
        }
        if end >= log.travel_m.len() {
            break;
        }
    }
    client.close_localization(SITE, &opened.id).await?;
    let last = answered.map_or(next, |(last, _)| last);
    let truth = log.truth[last].map_or(Pose2::identity(), |truth| expected_pose(&truth, mapped));
    Ok(LocalizationTrial {
        answered: answered.map(|(_, pose)| Pose2::new(pose.x, pose.y, pose.theta)),
        truth,
        driven_m: log.travel_m[last] - log.travel_m[start],
    })
}

/// A true pose in the map's frame, by the nearest mapped place: a map that is bent far away is right here.
pub(super) fn expected_pose(truth: &Pose2, mapped: &[(Pose2, Pose2)]) -> Pose2 {
    let nearest = mapped.iter().min_by(|a, b| a.0.distance(truth).total_cmp(&b.0.distance(truth)));
    nearest.map_or(*truth, |(known, map_pose)| map_pose.compose(&known.between(truth)))
}

fn print_report(report: &Report) {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let meters = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.1} m"));
    let result = &report.localization;
    println!("\n{} switched on in {} on the map of {}", result.trials, report.log, report.map_from);
    println!("  found            {}", percent(result.found));
    println!("  wrongly sure     {}", percent(result.wrongly_sure));
    println!("  honestly unsure  {}", percent(result.honestly_unsure));
    println!(
        "  driven until sure: median {}, nine of ten within {}",
        meters(result.meters_to_converge.median),
        meters(result.meters_to_converge.p90)
    );
    println!("  time             {:.1} s", report.seconds);
}
