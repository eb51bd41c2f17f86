//! Maps recordings whose odometry lies, and recordings of few beams, and judges what comes of it beside the clean ones.
//!
//! `LOCUTION_DATASETS=… cargo run --release --example odometry_faults -- aces intel --map --seed 1 --only reversed`
//! prints for every fault how far the refined poses go wrong over 5 m of travel before any map is made, and with
//! `--map` the map's error by relations. `--json FILE` writes the same as JSON. `--beams` thins the readings instead.

use std::io::Read;
use std::path::PathBuf;
use std::time::Instant;

use locution_engine::config::EngineConfig;
use locution_engine::formats::{CarmenLog, CarmenOptions, parse_relations, parse_truth, read_carmen_log};
use locution_engine::geometry::{Pose2, wrap_angle};
use locution_engine::mapping::{Keyframe, RegistrationMemo, RunRecord, map_site};
use locution_engine::scan::{Scan, ScanGeometry};
use locution_engine::text::{Observation, Word};
use locution_engine::translator::{Translation, Translator};
use locution_lab::evaluation::{EstimatedPose, OdometryPose, join_truth, judge_map};
use locution_lab::simulation::{OdometryFault, inject};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::json;

type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Poses are judged over this much travel.
const WINDOW_M: f64 = 5.0;
const NUM_FAULTS: usize = 6;

fn read_text(folder: &str, name: &str, ending: &str) -> Result<String, Failure> {
    let datasets = std::env::var_os("LOCUTION_DATASETS").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/datasets"),
        PathBuf::from,
    );
    let mut bytes = Vec::new();
    let file = std::fs::File::open(datasets.join(folder).join(format!("{name}.{ending}.gz")))?;
    flate2::read::MultiGzDecoder::new(file).read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// A run translated, and its pose at every scan.
#[derive(Default)]
struct Driven {
    observations: Vec<Observation>,
    words: Vec<Word>,
    keyframes: Vec<Keyframe>,
    run_from_robot: Vec<Pose2>,
}

impl Driven {
    fn take(&mut self, translation: Translation, scans: &[Scan]) {
        self.observations.extend(translation.observations);
        self.words.extend(translation.words);
        if let Some(pose) = translation.keyframe {
            self.keyframes.push(Keyframe {
                scan_seq: pose.scan_seq,
                timestamp_ns: pose.timestamp_ns,
                odom_from_robot: pose.odom_from_robot,
                run_from_robot: pose.run_from_robot,
                motion_covariance: pose.motion_covariance,
                ranges_m: scans[pose.scan_seq as usize].ranges_m.clone(),
            });
        }
    }
}

fn translate(config: &EngineConfig, geometry: &ScanGeometry, scans: &[Scan]) -> Result<Driven, Failure> {
    let mut translator = Translator::new(&config.translator, geometry.clone())?;
    let mut driven = Driven::default();
    for scan in scans {
        let translation = translator.push(scan);
        driven.run_from_robot.push(translation.run_from_robot);
        driven.take(translation, scans);
    }
    driven.take(translator.finish(), scans);
    Ok(driven)
}

/// Sizes of errors, sorted.
struct Errors(Vec<f64>);

impl Errors {
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        Self(values)
    }
    fn mean(&self) -> f64 {
        self.0.iter().sum::<f64>() / self.0.len().max(1) as f64
    }
    fn quantile(&self, share: f64) -> f64 {
        let last = self.0.len().saturating_sub(1);
        self.0.get((share * last as f64) as usize).copied().unwrap_or(f64::NAN)
    }
}

/// Errors of the motion over the window, metres and degrees, one for every half metre, with the scan at its end.
fn open_loop(poses: &[Pose2], truth: &[Option<Pose2>]) -> Vec<(usize, f64, f64)> {
    let known: Vec<usize> = (0..truth.len()).filter(|&idx| truth[idx].is_some()).collect();
    let true_pose = |idx: usize| truth[idx].unwrap_or_default();
    let mut travel_m = vec![0.0];
    for pair in known.windows(2) {
        travel_m.push(travel_m[travel_m.len() - 1] + true_pose(pair[0]).distance(&true_pose(pair[1])));
    }
    let mut errors = Vec::new();
    let mut next_m = WINDOW_M;
    for end in 0..known.len() {
        if travel_m[end] < next_m {
            continue;
        }
        next_m = travel_m[end] + 0.5;
        let start = travel_m.partition_point(|&travel| travel < travel_m[end] - WINDOW_M);
        let (from, to) = (known[start], known[end]);
        let difference = true_pose(from).between(&true_pose(to)).between(&poses[from].between(&poses[to]));
        errors.push((to, difference.x.hypot(difference.y), difference.theta.abs().to_degrees()));
    }
    errors
}

fn mapped_poses(scans: &[Scan], driven: &Driven, map_from_keyframes: &[Pose2]) -> Vec<EstimatedPose> {
    let place = |scan_seq: usize| {
        let after = driven.keyframes.partition_point(|keyframe| keyframe.scan_seq <= scan_seq as u64);
        let first = after.saturating_sub(1);
        let before = driven.keyframes.get(first)?;
        let run = |seq: u64| driven.run_from_robot[seq as usize];
        let moved = |seq: u64| map_from_keyframes[first].compose(&run(before.scan_seq).between(&run(seq)));
        let here = moved(scan_seq as u64);
        let Some(next) = driven.keyframes.get(after).filter(|_| after > 0) else { return Some(here) };
        let (carried, known) = (moved(next.scan_seq), map_from_keyframes[after]);
        let share = (scan_seq as u64 - before.scan_seq) as f64 / (next.scan_seq - before.scan_seq) as f64;
        Some(Pose2::new(
            here.x + share * (known.x - carried.x),
            here.y + share * (known.y - carried.y),
            here.theta + share * wrap_angle(known.theta - carried.theta),
        ))
    };
    let estimated = |(scan_seq, scan): (usize, &Scan)| {
        place(scan_seq).map(|map_from_robot| EstimatedPose {
            timestamp_ns: scan.timestamp_ns,
            component: 0,
            map_from_robot,
        })
    };
    scans.iter().enumerate().filter_map(estimated).collect()
}

/// Every so many readings of the recording, as many as wanted, about its middle.
fn thinned(log: &CarmenLog, num_beams: usize) -> CarmenLog {
    let stride = log.geometry.num_ranges / num_beams;
    let first = (log.geometry.num_ranges - 1 - stride * (num_beams - 1)) / 2;
    let mut thin = log.clone();
    thin.geometry.num_ranges = num_beams;
    thin.geometry.angle_min_rad = log.geometry.beam_angle_rad(first);
    thin.geometry.angle_increment_rad *= stride as f64;
    for scan in &mut thin.scans {
        scan.ranges_m = (0..num_beams).map(|beam| scan.ranges_m[first + beam * stride]).collect();
    }
    thin
}

fn main() -> Result<(), Failure> {
    let mut config = EngineConfig::default();
    let (mut names, mut seed, mut with_map, mut with_beams, mut only, mut json_file) =
        (Vec::new(), 1, false, false, String::new(), None);
    let mut verbose = false;
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--map" => with_map = true,
            "--beams" => with_beams = true,
            "--verbose" => verbose = true,
            "--seed" => seed = arguments.next().ok_or("a seed")?.parse()?,
            "--only" => only = arguments.next().ok_or("part of a name")?,
            "--json" => json_file = arguments.next(),
            _ if argument.starts_with('{') => config = serde_json::from_str(&argument)?,
            _ => names.push(argument),
        }
    }
    let mut rows = Vec::new();
    for name in &names {
        let log = read_carmen_log(read_text("laser", name, "log")?.lines(), &CarmenOptions::default())?;
        let truth = parse_truth(&read_text("laser", name, "truth").unwrap_or_default())?;
        let relations = parse_relations(&read_text("relations", name, "relations").unwrap_or_default())?;
        let odometry: Vec<OdometryPose> = log
            .scans
            .iter()
            .map(|scan| OdometryPose {
                timestamp_ns: scan.timestamp_ns,
                odom_from_robot: scan.odom_from_robot,
            })
            .collect();
        let truth = join_truth(&odometry, &truth);
        let cases: Vec<(String, CarmenLog, Vec<std::ops::Range<usize>>)> = if with_beams {
            [180, 60, 30, 11]
                .map(|beams| (format!("{beams} beams"), thinned(&log, beams), Vec::new()))
                .to_vec()
        } else {
            let case = |fault: OdometryFault| {
                let mut case = log.clone();
                let places = inject(&mut case.scans, fault, NUM_FAULTS, &mut ChaCha8Rng::seed_from_u64(seed));
                (fault.name().to_owned(), case, places)
            };
            OdometryFault::ALL.map(case).to_vec()
        };
        for (case, log, places) in cases
            .iter()
            .filter(|(case, ..)| only.is_empty() || only.split(',').any(|part| case.contains(part)))
        {
            let began = Instant::now();
            let driven = translate(&config, &log.geometry, &log.scans)?;
            let seconds = began.elapsed().as_secs_f64();
            let errors = open_loop(&driven.run_from_robot, &truth);
            let meters = Errors::of(errors.iter().map(|error| error.1).collect());
            let degrees = Errors::of(errors.iter().map(|error| error.2).collect());
            print!(
                "{name:12} {case:18} {:2} open loop {:.4} p99 {:.3} max {:6.3} m, {:.3} p99 {:.2} max {:6.2}° {:4} keyframes {:.0} scans/s",
                places.len(),
                meters.mean(),
                meters.quantile(0.99),
                meters.quantile(1.0),
                degrees.mean(),
                degrees.quantile(0.99),
                degrees.quantile(1.0),
                driven.keyframes.len(),
                log.scans.len() as f64 / seconds
            );
            if verbose {
                println!();
                let mut worst: Vec<_> = errors.iter().collect();
                worst.sort_by(|a, b| b.1.total_cmp(&a.1));
                let mut shown: Vec<usize> = Vec::new();
                for error in worst {
                    if shown.iter().all(|&other| error.0.abs_diff(other) > 200) && shown.len() < 8 {
                        shown.push(error.0);
                        println!("    scan {:6} {:.3} m {:.2}°", error.0, error.1, error.2);
                    }
                }
                println!("    faults {places:?}");
            }
            let mut row = json!({
                "recording": name, "case": case, "faults": places.len(), "scans_per_s": log.scans.len() as f64 / seconds,
                "open_loop_m": {"mean": meters.mean(), "p99": meters.quantile(0.99), "max": meters.quantile(1.0)},
                "open_loop_deg": {"mean": degrees.mean(), "p99": degrees.quantile(0.99), "max": degrees.quantile(1.0)},
            });
            if with_map {
                let record = RunRecord {
                    geometry: &log.geometry,
                    observations: &driven.observations,
                    words: &driven.words,
                    keyframes: &driven.keyframes,
                };
                let map = map_site(&config.mapping, &[record], &[], &mut RegistrationMemo::default())?;
                let poses = map
                    .runs
                    .first()
                    .map_or(Vec::new(), |run| mapped_poses(&log.scans, &driven, &run.map_from_keyframes));
                let report = judge_map(&poses, &relations);
                print!(
                    "  map {:.4} ± {:.4} m, {:.3} ± {:.3}°, {} of {} relations",
                    report.translation_m.mean,
                    report.translation_m.sd,
                    report.rotation_deg.mean,
                    report.rotation_deg.sd,
                    report.relations,
                    report.relations + report.skipped
                );
                row["map"] = serde_json::to_value(report)?;
            }
            println!();
            rows.push(row);
        }
    }
    if let Some(file) = json_file {
        std::fs::write(file, serde_json::to_string_pretty(&rows)?)?;
    }
    Ok(())
}
