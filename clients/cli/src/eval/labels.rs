//! `locution eval labels`: the places of the built map, labelled, judged by what a person drew.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::Args;
use locution_client::{Client, LabeledStretch};
use locution_engine::formats::LabeledPlaces;
use locution_engine::geometry::Pose2;
use locution_lab::evaluation::{LabelReport, LabeledObservation, judge_labels};

use super::local_server::{LocalServer, RecordingArguments, SITE, SentRecording, build_map};
use super::recognition::judged_run;
use locution_lab::recordings::{read_text, read_truth};
use locution_lab::report::{table, write_json};

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

/// One observation of a run.
struct Labeled {
    travel_m: f64,
    actual: Option<String>,
    predicted: Option<String>,
}

pub(super) async fn run(arguments: &LabelsArguments) -> Result<()> {
    let num_logs = arguments.recordings.logs.len();
    let is_paired = arguments.truth.len() == num_logs && arguments.labels.len() == num_logs;
    ensure!(is_paired, "give one --truth and one --labels for each --log, in the same order");
    let recordings = arguments.recordings.read()?;
    let server = LocalServer::start().await?;
    let sent = arguments.recordings.send(&server, recordings).await?;
    build_map(&server).await?;
    let stretches = server.client.labels(SITE).await?;
    let mut runs = Vec::new();
    for (idx, sent) in sent.iter().enumerate() {
        let files = (arguments.truth[idx].as_path(), arguments.labels[idx].as_path());
        runs.push(labeled_run(&server.client, sent, files, &stretches).await?);
    }
    let judged: Vec<Vec<LabeledObservation<'_>>> = runs
        .iter()
        .map(|run| {
            let judged = run.iter().map(|labeled| LabeledObservation {
                travel_m: labeled.travel_m,
                actual: labeled.actual.as_deref(),
                predicted: labeled.predicted.as_deref(),
            });
            judged.collect()
        })
        .collect();
    let report = judge_labels(&judged);
    print_report(&report);
    if let Some(path) = &arguments.json {
        write_json(path, &report)?;
    }
    server.stop().await
}

async fn labeled_run(
    client: &Client,
    sent: &SentRecording,
    (truth_path, labels_path): (&Path, &Path),
    stretches: &[LabeledStretch],
) -> Result<Vec<Labeled>> {
    let name = &sent.recording.name;
    let observations = client.observations(SITE, name).await?;
    let places: LabeledPlaces =
        serde_json::from_str(&read_text(labels_path)?).with_context(|| labels_path.display().to_string())?;
    let judged = judged_run(&sent.recording, &observations, &read_truth(truth_path)?, 0);
    let label_of = |pose: Option<Pose2>| places.label_at(&pose?.position()).map(str::to_owned);
    let mut labeled: Vec<Labeled> = judged
        .visits
        .iter()
        .map(|visit| Labeled {
            travel_m: visit.travel_m,
            actual: label_of(visit.truth_from_robot),
            predicted: None,
        })
        .collect();
    for stretch in stretches.iter().filter(|stretch| stretch.run == *name) {
        let (first, last) = (usize::try_from(stretch.first)?, usize::try_from(stretch.last)?);
        for observation in labeled.iter_mut().take(last.saturating_add(1)).skip(first) {
            observation.predicted = Some(stretch.label.clone());
        }
    }
    Ok(labeled)
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
