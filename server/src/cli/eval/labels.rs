//! `locution eval labels`: the places of the built map, labelled, judged by what a person drew.

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use clap::Args;
use locution_client::Client;
use locution_engine::evaluation::{LabelReport, LabelledObservation, judge_labels};
use locution_engine::formats::LabelledPlaces;
use locution_engine::geometry::Pose2;
use locution_engine::semantics::{DrivenRun, PlaceLabel, SemanticsConfig, label_runs};

use super::local_server::{LocalServer, RecordingArguments, SITE, SentRecording, build_map};
use super::recognition::judged_run;
use crate::cli::output::{table, write_json};
use crate::cli::recordings::{read_text, read_truth};

/// Distance between the scans from which places are labelled, metres.
const SCAN_SPACING_M: f64 = 0.2;

/// One truth and one file of labels for each log, in the same order.
#[derive(Debug, Args)]
pub struct LabelsArguments {
    #[command(flatten)]
    recordings: RecordingArguments,
    /// True poses, one for each log.
    #[arg(long, required = true, num_args = 1..)]
    truth: Vec<PathBuf>,
    /// Labelled regions in the frame of the truth, one for each log.
    #[arg(long, required = true, num_args = 1..)]
    labels: Vec<PathBuf>,
    /// Write the report here.
    #[arg(long)]
    json: Option<PathBuf>,
}

/// A run in the map.
struct MappedRun {
    component: u64,
    /// Poses of all scans.
    map_from_scans: Vec<Pose2>,
    /// Scan of each observation.
    observed_scans: Vec<usize>,
    /// Metres driven and true label of each observation.
    truth: Vec<(f64, Option<String>)>,
}

pub(super) async fn run(arguments: &LabelsArguments) -> Result<()> {
    let num_logs = arguments.recordings.logs.len();
    let is_paired = arguments.truth.len() == num_logs && arguments.labels.len() == num_logs;
    ensure!(is_paired, "give one --truth and one --labels for each --log, in the same order");
    let recordings = arguments.recordings.read()?;
    let server = LocalServer::start().await?;
    let sent = arguments.recordings.send(&server, recordings).await?;
    build_map(&server).await?;
    let mut runs = Vec::new();
    for (idx, sent) in sent.iter().enumerate() {
        runs.push(mapped_run(&server.client, sent, &arguments.truth[idx], &arguments.labels[idx]).await?);
    }
    let predicted = predicted_labels(&sent, &runs);
    let judged: Vec<Vec<LabelledObservation<'_>>> = runs
        .iter()
        .zip(&predicted)
        .map(|(run, labels)| {
            let labelled = run.truth.iter().zip(labels);
            labelled
                .map(|((travel_m, actual), label)| LabelledObservation {
                    travel_m: *travel_m,
                    actual: actual.as_deref(),
                    predicted: Some(label.name()),
                })
                .collect()
        })
        .collect();
    let report = judge_labels(&judged);
    print_report(&report);
    if let Some(path) = &arguments.json {
        write_json(path, &report)?;
    }
    server.stop().await
}

async fn mapped_run(
    client: &Client,
    sent: &SentRecording,
    truth_path: &PathBuf,
    labels_path: &PathBuf,
) -> Result<MappedRun> {
    let name = &sent.recording.name;
    let observations = client.observations(SITE, name).await?;
    let trajectory = client.trajectory(SITE, name, "map").await?;
    let places: LabelledPlaces =
        serde_json::from_str(&read_text(labels_path)?).with_context(|| labels_path.display().to_string())?;
    let judged = judged_run(&sent.recording, &observations, &read_truth(truth_path)?, 0);
    let label_of = |pose: Option<Pose2>| places.label_at(&pose?.position()).map(str::to_owned);
    Ok(MappedRun {
        component: trajectory.component.unwrap_or(0),
        map_from_scans: trajectory.poses.iter().map(|pose| Pose2::new(pose.x, pose.y, pose.theta)).collect(),
        observed_scans: observations.iter().map(|observation| observation.scan_seq as usize).collect(),
        truth: judged.visits.iter().map(|visit| (visit.travel_m, label_of(visit.truth_from_robot))).collect(),
    })
}

/// A label for each observation of each run; runs of one component of the map are labelled together.
fn predicted_labels(sent: &[SentRecording], runs: &[MappedRun]) -> Vec<Vec<PlaceLabel>> {
    let mut by_component: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
    for (idx, run) in runs.iter().enumerate() {
        by_component.entry(run.component).or_default().push(idx);
    }
    let mut predicted = vec![Vec::new(); runs.len()];
    for members in by_component.values() {
        let driven: Vec<DrivenRun<'_>> =
            members.iter().map(|&idx| driven_run(&sent[idx], &runs[idx])).collect();
        let labelled = label_runs(&SemanticsConfig::default(), &driven);
        for (&idx, labelled) in members.iter().zip(labelled) {
            predicted[idx] = labelled.labels;
        }
    }
    predicted
}

fn driven_run<'a>(sent: &'a SentRecording, run: &MappedRun) -> DrivenRun<'a> {
    let log = &sent.recording.log;
    let mut scans: Vec<(Pose2, &[f32])> = Vec::new();
    for (scan, pose) in log.scans.iter().zip(&run.map_from_scans) {
        if scans.last().is_none_or(|(last, _)| last.distance(pose) >= SCAN_SPACING_M) {
            scans.push((*pose, scan.ranges_m.as_slice()));
        }
    }
    let pose_of = |&scan: &usize| run.map_from_scans.get(scan).copied().unwrap_or_default();
    let map_from_observations = run.observed_scans.iter().map(pose_of).collect();
    DrivenRun { geometry: &log.geometry, scans, map_from_observations }
}

fn print_report(report: &LabelReport) {
    let names: Vec<&str> = report.labels.keys().map(String::as_str).collect();
    let mut header = vec!["actual \\ predicted"];
    header.extend(&names);
    let rows: Vec<Vec<String>> = report
        .confusion
        .iter()
        .map(|(actual, row)| {
            let cells = names.iter().map(|name| row.get(*name).copied().unwrap_or(0).to_string());
            std::iter::once(actual.clone()).chain(cells).collect()
        })
        .collect();
    println!("\n{}", table(&header, &rows));
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let scores: Vec<Vec<String>> = report
        .labels
        .iter()
        .map(|(name, score)| {
            vec![name.clone(), percent(score.precision), percent(score.recall), score.support.to_string()]
        })
        .collect();
    println!("{}", table(&["label", "precision", "recall", "observations"], &scores));
}
