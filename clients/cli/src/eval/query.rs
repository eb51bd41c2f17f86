//! `locution eval query`: pieces of recordings that are not stored, asked about in the map of another recording.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Result, ensure};
use clap::Args;
use locution_client::{Client, Geometry, LocalizationState, Scan};
use locution_engine::formats::CarmenOptions;
use locution_engine::geometry::Pose2;
use locution_lab::evaluation::{ExampleReport, ExampleTrial, judge_examples};
use serde::Serialize;

use super::local_server::{LocalServer, SITE};
use super::localization::{Known, MAPPED_M, MapAndLog, build, expected_pose, travel};
use crate::wire::{wire_geometry, wire_scan};
use locution_lab::plot::{Line, Plot};
use locution_lab::recordings::read_recording;
use locution_lab::report::write_json;

/// The first truth belongs to the map's recording, the second to the other.
#[derive(Debug, Args)]
pub struct QueryArguments {
    #[command(flatten)]
    recordings: MapAndLog,
    /// CARMEN logs of other buildings: none of their pieces is here.
    #[arg(long, num_args = 1..)]
    elsewhere: Vec<PathBuf>,
    /// Metres driven in a piece.
    #[arg(long, default_value_t = 12.0)]
    length: f64,
    /// Pieces of --log; each of --elsewhere gives a quarter as many.
    #[arg(long, default_value_t = 100)]
    pieces: usize,
    /// JSON file with the engine's configuration, whole or in part [default: the defaults].
    #[arg(long)]
    config: Option<PathBuf>,
    /// Write the report here, and beside it the reliability diagram as a picture.
    #[arg(long)]
    json: Option<PathBuf>,
}

#[derive(Serialize)]
struct Report {
    map_from: String,
    log: String,
    length_m: f64,
    #[serde(flatten)]
    examples: ExampleReport,
    seconds: f64,
}

pub(super) async fn run(arguments: &QueryArguments) -> Result<()> {
    ensure!(arguments.length > 0.0 && arguments.pieces > 0, "--length and --pieces must be above zero");
    let (map, log) = arguments.recordings.read()?;
    let began = Instant::now();
    let server = LocalServer::start().await?;
    let config = arguments.config.as_ref().map(|path| -> Result<serde_json::Value> {
        Ok(serde_json::from_str(&std::fs::read_to_string(path)?)?)
    });
    let mapped = build(&server, &map, config.transpose()?.as_ref()).await?;
    let mut trials = Vec::new();
    for piece in pieces(&log, arguments.length, arguments.pieces) {
        // Between near and far from where the map has been nobody can say whether the piece was made here.
        let Some(truth) = log.truth[*piece.end()] else { continue };
        let nearest_m = mapped.iter().map(|(known, _)| known.distance(&truth)).fold(f64::INFINITY, f64::min);
        let expected = (nearest_m < MAPPED_M).then(|| expected_pose(&truth, &mapped));
        if expected.is_some() || nearest_m > 2.0 * MAPPED_M {
            trials.push(ask(&server.client, &log, piece, expected).await?);
        }
    }
    for path in &arguments.elsewhere {
        let other = elsewhere(path)?;
        for piece in pieces(&other, arguments.length, arguments.pieces.div_ceil(4)) {
            trials.push(ask(&server.client, &other, piece, None).await?);
        }
    }
    let report = Report {
        map_from: map.recording.name.clone(),
        log: log.recording.name.clone(),
        length_m: arguments.length,
        examples: judge_examples(&trials),
        seconds: began.elapsed().as_secs_f64(),
    };
    print_report(&report);
    if let Some(path) = &arguments.json {
        write_json(path, &report)?;
        let picture = path.with_extension("png");
        std::fs::write(&picture, reliability_picture(&report)?)?;
        println!("wrote {}", picture.display());
    }
    server.stop().await
}

/// A recording of another building, whose truth does not matter.
fn elsewhere(path: &Path) -> Result<Known> {
    let recording = read_recording(path, CarmenOptions::default())?;
    let travel_m = travel(&recording.log);
    let truth = vec![None; travel_m.len()];
    Ok(Known { recording, truth, travel_m })
}

/// Scans of pieces of a length, evenly spread over a recording.
fn pieces(log: &Known, length_m: f64, count: usize) -> Vec<std::ops::RangeInclusive<usize>> {
    let slack_m = log.travel_m.last().copied().unwrap_or(0.0) - length_m;
    if slack_m < 0.0 {
        return Vec::new();
    }
    let piece = |number: usize| {
        let end_m = length_m + slack_m * (number as f64 + 0.5) / count as f64;
        let last = log.travel_m.partition_point(|&at| at < end_m).min(log.travel_m.len() - 1);
        let first = log.travel_m.partition_point(|&at| at < log.travel_m[last] - length_m);
        first..=last
    };
    (0..count).map(piece).collect()
}

async fn ask(
    client: &Client,
    log: &Known,
    piece: std::ops::RangeInclusive<usize>,
    expected: Option<Pose2>,
) -> Result<ExampleTrial> {
    let geometry = &log.recording.log.geometry;
    let scans: Vec<Scan> =
        log.recording.log.scans[piece].iter().map(|scan| wire_scan(geometry, scan)).collect();
    let wire: Geometry = wire_geometry(geometry);
    let began = Instant::now();
    let answer = client.query_example(SITE, &wire, &scans).await?;
    let latency_s = began.elapsed().as_secs_f64();
    let place = |pose: &locution_client::Pose| Pose2::new(pose.x, pose.y, pose.theta);
    Ok(ExampleTrial {
        expected,
        answered: answer
            .places
            .iter()
            .map(|found| (place(&found.map_from_robot), found.probability))
            .collect(),
        is_sure: answer.state == LocalizationState::Converged,
        latency_s,
    })
}

/// What was right over what was said; on the diagonal it is the same.
fn reliability_picture(report: &Report) -> Result<Vec<u8>> {
    let bins = &report.examples.reliability;
    Plot {
        title: format!("pieces of {} m on {}", report.length_m, report.map_from),
        x_label: "probability said".into(),
        y_label: "share that was right".into(),
        x_range: (0.0, 1.0),
        y_range: (0.0, 1.0),
        lines: vec![
            Line {
                name: "calibrated".into(),
                color: [160, 160, 160],
                points: vec![(0.0, 0.0), (1.0, 1.0)],
                has_markers: false,
            },
            Line {
                name: "answered".into(),
                color: [31, 119, 180],
                points: bins.iter().map(|bin| (bin.said, bin.right)).collect(),
                has_markers: true,
            },
        ],
    }
    .to_png()
}

fn print_report(report: &Report) {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let result = &report.examples;
    println!(
        "\n{} pieces of {} m made on the map of {}, {} made elsewhere",
        result.here, report.length_m, report.map_from, result.elsewhere
    );
    println!(
        "  here: first place right {}, sure and right {}",
        percent(result.first_right),
        percent(result.found)
    );
    println!("  here: a right place among the first five {}", percent(result.among_first_five));
    println!("  here: sure and wrong    {}", percent(result.wrongly_sure));
    println!("  elsewhere: \"not here\"   {}", percent(result.not_here));
    println!("  elsewhere: sure         {}", percent(result.sure_elsewhere));
    println!(
        "  probability said and share that was right (calibration error {:.3}, Brier score {:.3}):",
        result.calibration_error, result.brier
    );
    for bin in &result.reliability {
        println!("    {:.2}  {:.2} of {}", bin.said, bin.right, bin.places);
    }
    let ms = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.1} ms"));
    println!(
        "  answered in median {}, p99 {}; all in {:.1} s",
        ms(result.latency_ms.median),
        ms(result.latency_ms.p99),
        report.seconds
    );
}
