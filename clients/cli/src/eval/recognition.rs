//! `locution eval recognition`: recordings in over HTTP, matches out, judged by true poses.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use clap::Args;
use locution_client::{Client, Observation, PlaceMatch, Word};
use locution_engine::formats::TruthPose;
use locution_engine::index::Lattice;
use locution_engine::mapping::Interval;
use locution_engine::matching::{MatchingConfig, Relation, find_chains};
use locution_engine::text::{self, Direction};
use locution_lab::evaluation::{
    JudgedMatch, JudgedRun, OdometryPose, RecognitionReport, Visit, join_truth, judge_recognition,
};
use serde::Serialize;

use super::local_server::{LocalServer, RecordingArguments, SITE, SentRecording, build_map};
use locution_lab::plot::{Line, Plot};
use locution_lab::recordings::{Recording, read_truth};
use locution_lab::report::{table, write_json};

/// One truth file for each log, in the same order.
#[derive(Debug, Args)]
pub struct RecognitionArguments {
    #[command(flatten)]
    recordings: RecordingArguments,
    /// True poses `timestamp x y theta`, plain or gzipped; one for each log.
    #[arg(long, required = true, num_args = 1..)]
    truth: Vec<PathBuf>,
    /// Building of each log, in the same order and separated by commas, when they are not all of one: truths of
    /// different buildings have no common frame, and any match between them is false.
    #[arg(long, value_delimiter = ',')]
    buildings: Vec<String>,
    /// Write the report here, and the curve beside it as a picture.
    #[arg(long)]
    json: Option<PathBuf>,
}

/// What became of one recording.
#[derive(Serialize)]
struct RecordingReport {
    name: String,
    scans: u64,
    observations: u64,
    words: u64,
    bytes_on_disk: u64,
    scans_per_s: f64,
    /// Maximal chains of level-0 words of the run with itself, by their number of words.
    ngram_matches: BTreeMap<usize, usize>,
}

#[derive(Serialize)]
struct Report {
    recordings: Vec<RecordingReport>,
    #[serde(flatten)]
    recognition: RecognitionReport,
    candidates: usize,
    verified_matches: usize,
    build_seconds: f64,
    seconds: f64,
}

pub(super) async fn run(arguments: &RecognitionArguments) -> Result<()> {
    let num_logs = arguments.recordings.logs.len();
    ensure!(arguments.truth.len() == num_logs, "give one --truth for each --log, in the same order");
    let buildings = &arguments.buildings;
    ensure!(
        buildings.is_empty() || buildings.len() == num_logs,
        "--buildings names one building for each --log"
    );
    let recordings = arguments.recordings.read()?;
    let server = LocalServer::start().await?;
    let began = Instant::now();
    let sent = arguments.recordings.send(&server, recordings).await?;
    let build_seconds = build_map(&server).await?;
    let (mut runs, mut reports) = (Vec::new(), Vec::new());
    for (idx, sent) in sent.iter().enumerate() {
        let name = &sent.recording.name;
        let observations = server.client.observations(SITE, name).await?;
        let truth = read_truth(&arguments.truth[idx])?;
        let truth_frame = buildings
            .get(idx)
            .map_or(0, |building| buildings.iter().position(|other| other == building).unwrap_or(idx) as u32);
        runs.push(judged_run(&sent.recording, &observations, &truth, truth_frame));
        reports.push(recording_report(&server.client, sent).await?);
    }
    let names: Vec<&str> = sent.iter().map(|sent| sent.recording.name.as_str()).collect();
    let matches = server.client.matches(SITE, "").await?;
    let judged: Vec<JudgedMatch> = matches.iter().filter_map(|found| judged_match(found, &names)).collect();
    let report = Report {
        recordings: reports,
        recognition: judge_recognition(&runs, &judged),
        candidates: judged.len(),
        verified_matches: judged.iter().filter(|found| found.is_verified).count(),
        build_seconds,
        seconds: began.elapsed().as_secs_f64(),
    };
    print_report(&report);
    if let Some(path) = &arguments.json {
        write_json(path, &report)?;
        let picture = path.with_extension("png");
        std::fs::write(&picture, curve_picture(&report.recognition)?)
            .with_context(|| format!("cannot write {}", picture.display()))?;
        println!("wrote {}", picture.display());
    }
    server.stop().await
}

/// The run's observations with their true poses.
pub fn judged_run(
    recording: &Recording,
    observations: &[Observation],
    truth: &[TruthPose],
    truth_frame: u32,
) -> JudgedRun {
    let odometry: Vec<OdometryPose> = recording
        .log
        .scans
        .iter()
        .map(|scan| OdometryPose { timestamp_ns: scan.timestamp_ns, odom_from_robot: scan.odom_from_robot })
        .collect();
    let joined = join_truth(&odometry, truth);
    let visits = observations
        .iter()
        .map(|observation| {
            let scan_idx = usize::try_from(observation.scan_seq).unwrap_or(usize::MAX);
            Visit {
                travel_m: observation.travel_m,
                truth_from_robot: joined.get(scan_idx).copied().flatten(),
            }
        })
        .collect();
    JudgedRun { truth_frame, visits }
}

/// A served match in the judge's terms; `None` if it names a run that was not sent.
pub fn judged_match(found: &PlaceMatch, names: &[&str]) -> Option<JudgedMatch> {
    let interval = |interval: &locution_client::MatchInterval| {
        Some(Interval {
            run_idx: names.iter().position(|name| *name == interval.run)? as u32,
            first: u32::try_from(interval.first).ok()?,
            last: u32::try_from(interval.last).ok()?,
        })
    };
    Some(JudgedMatch {
        earlier: interval(&found.earlier)?,
        later: interval(&found.later)?,
        direction: if found.direction == "opposite" { Direction::Opposite } else { Direction::Same },
        score: found.probability,
        is_verified: found.state == "verified",
    })
}

async fn recording_report(client: &Client, sent: &SentRecording) -> Result<RecordingReport> {
    let words = client.words(SITE, &sent.recording.name, Some(0)).await?;
    Ok(RecordingReport {
        name: sent.recording.name.clone(),
        scans: sent.recording.log.scans.len() as u64,
        observations: sent.uploaded.num_observations,
        words: sent.uploaded.num_words,
        bytes_on_disk: sent.bytes_on_disk,
        scans_per_s: sent.uploaded.num_scans as f64 / sent.uploaded.duration_s.max(1e-9),
        ngram_matches: ngram_matches(&words)?,
    })
}

/// Maximal chains of two or more matching words of the run with itself, by length.
fn ngram_matches(words: &[Word]) -> Result<BTreeMap<usize, usize>> {
    let words: Vec<text::Word> = words
        .iter()
        .map(|word| text::Word {
            id: text::WordId { level: word.id.level, index: word.id.index },
            class: word.class,
            size: word.size,
            turn_rad: word.turn_rad,
            observations: word.observations,
            predecessors: word
                .predecessors
                .iter()
                .filter(|id| id.level == 0)
                .map(|id| text::WordId { level: id.level, index: id.index })
                .collect(),
        })
        .collect();
    let lattice = Lattice::from_words(&words).context("the words served are not a text")?;
    let config = MatchingConfig { min_chain_words: vec![2], ..MatchingConfig::default() };
    let mut by_length = BTreeMap::new();
    for chain in find_chains(&lattice, &lattice, Relation::SameRun, &config) {
        *by_length.entry(chain.pairs.len()).or_default() += 1;
    }
    Ok(by_length)
}

fn print_report(report: &Report) {
    let rows: Vec<Vec<String>> = report
        .recordings
        .iter()
        .map(|recording| {
            let at_least = |n: usize| {
                recording.ngram_matches.range(n..).map(|(_, count)| count).sum::<usize>().to_string()
            };
            vec![
                recording.name.clone(),
                recording.scans.to_string(),
                recording.observations.to_string(),
                recording.words.to_string(),
                format!("{:.2}", recording.bytes_on_disk as f64 / 1e6),
                format!("{:.0}", recording.scans_per_s),
                at_least(3),
                at_least(5),
                at_least(7),
                at_least(10),
            ]
        })
        .collect();
    let header =
        ["recording", "scans", "observations", "words", "MB on disk", "scans/s", "n≥3", "n≥5", "n≥7", "n≥10"];
    println!("\n{}", table(&header, &rows));
    let recognition = &report.recognition;
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let best = recognition.recall_at_precision_99;
    println!(
        "  revisits: {} same direction, {} opposite, of {} observations with truth",
        recognition.revisits.same, recognition.revisits.opposite, recognition.observations
    );
    println!("  candidates: {}, of which verified: {}", report.candidates, report.verified_matches);
    println!(
        "  recall at precision ≥ 0.99: same {}, opposite {}, all {}",
        percent(best.same),
        percent(best.opposite),
        percent(best.all)
    );
    println!(
        "  verified: {} claims, precision {}, recall {}",
        recognition.verified.claims,
        percent(recognition.verified.precision),
        percent(recognition.verified.recall_all)
    );
    println!("  time: {:.1} s, of which building the map {:.1} s", report.seconds, report.build_seconds);
}

/// Precision over recall.
fn curve_picture(recognition: &RecognitionReport) -> Result<Vec<u8>> {
    let line = |name: &str, color: [u8; 3], recall: &dyn Fn(usize) -> f64| Line {
        name: name.to_owned(),
        color,
        points: (0..recognition.curve.len())
            .map(|idx| (recall(idx), recognition.curve[idx].precision))
            .collect(),
        has_markers: false,
    };
    let curve = &recognition.curve;
    Plot {
        title: "recognition".into(),
        x_label: "recall".into(),
        y_label: "precision".into(),
        x_range: (0.0, 1.0),
        y_range: (0.0, 1.0),
        lines: vec![
            line("same direction", [31, 119, 180], &|idx| curve[idx].recall_same),
            line("opposite direction", [255, 127, 14], &|idx| curve[idx].recall_opposite),
            line("all", [44, 160, 44], &|idx| curve[idx].recall_all),
        ],
    }
    .to_png()
}
