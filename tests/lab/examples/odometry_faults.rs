//! Maps recordings whose odometry lies, and recordings of few beams, and judges what comes of it beside the clean ones.
//!
//! `LOCUTION_DATASETS=… cargo run --release --example odometry_faults -- aces intel --map --seed 1 --only reversed`
//! prints for every fault how far the refined poses go wrong over 5 m of travel before any map is made, and with
//! `--map` the map's error by relations. `--json FILE` writes the same as JSON. `--beams` thins the readings instead.

use std::io::Read;
use std::path::PathBuf;
use std::time::Instant;

use locution_engine::config::EngineConfig;
use locution_engine::formats::{
    CarmenLog, CarmenOptions, Relation, parse_relations, parse_truth, read_carmen_log,
};
use locution_engine::geometry::{Pose2, wrap_angle};
use locution_engine::mapping::{Keyframe, RegistrationMemo, RunRecord, SitePieces, map_site};
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
    /// First scans of the pieces but for the first.
    cuts: Vec<u64>,
}

impl Driven {
    fn take(&mut self, translation: Translation, scans: &[Scan]) {
        self.observations.extend(translation.observations);
        self.words.extend(translation.words);
        self.cuts.extend(translation.cut.map(|cut| cut.scan_seq));
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

    fn to_json(&self) -> serde_json::Value {
        json!({"mean": self.mean(), "p99": self.quantile(0.99), "max": self.quantile(1.0)})
    }
}

impl std::fmt::Display for Errors {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.4} (99 %: {:.3}, all: {:.3})", self.mean(), self.quantile(0.99), self.quantile(1.0))
    }
}

/// Errors of the motion over the window, metres and degrees, one for every half metre, but for those across cuts.
fn open_loop(poses: &[Pose2], truth: &[Option<Pose2>], cuts: &[u64]) -> Vec<(f64, f64)> {
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
        if cuts.iter().any(|&cut| (from as u64) < cut && cut <= to as u64) {
            continue;
        }
        let difference = true_pose(from).between(&true_pose(to)).between(&poses[from].between(&poses[to]));
        errors.push((difference.x.hypot(difference.y), difference.theta.abs().to_degrees()));
    }
    errors
}

/// Poses of the scans of a piece, whose keyframes are placed.
fn mapped_poses(
    scans: &[Scan],
    held: std::ops::Range<usize>,
    run_from_robot: &[Pose2],
    (keyframes, map_from_keyframes): (&[Keyframe], &[Pose2]),
    component: u32,
) -> Vec<EstimatedPose> {
    let place = |scan_seq: usize| {
        let after = keyframes.partition_point(|keyframe| keyframe.scan_seq <= scan_seq as u64);
        let first = after.saturating_sub(1);
        let before = keyframes.get(first)?;
        let run = |seq: u64| run_from_robot[seq as usize];
        let moved = |seq: u64| {
            map_from_keyframes.get(first).map(|at| at.compose(&run(before.scan_seq).between(&run(seq))))
        };
        let here = moved(scan_seq as u64)?;
        let Some(next) = keyframes.get(after).filter(|_| after > 0) else { return Some(here) };
        let (carried, known) = (moved(next.scan_seq)?, map_from_keyframes.get(after)?);
        let share = (scan_seq as u64 - before.scan_seq) as f64 / (next.scan_seq - before.scan_seq) as f64;
        Some(Pose2::new(
            here.x + share * (known.x - carried.x),
            here.y + share * (known.y - carried.y),
            here.theta + share * wrap_angle(known.theta - carried.theta),
        ))
    };
    let estimated = |scan_seq: usize| {
        place(scan_seq).map(|map_from_robot| EstimatedPose {
            timestamp_ns: scans[scan_seq].timestamp_ns,
            component: u64::from(component),
            map_from_robot,
        })
    };
    held.filter_map(estimated).collect()
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

/// What to try, from the command line.
#[derive(Default)]
struct Options {
    names: Vec<String>,
    config: EngineConfig,
    seed: u64,
    with_map: bool,
    with_beams: bool,
    only: String,
    json_file: Option<String>,
}

fn options() -> Result<Options, Failure> {
    let mut options = Options { seed: 1, ..Options::default() };
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--map" => options.with_map = true,
            "--beams" => options.with_beams = true,
            "--seed" => options.seed = arguments.next().ok_or("a seed")?.parse()?,
            "--only" => options.only = arguments.next().ok_or("part of a name")?,
            "--json" => options.json_file = arguments.next(),
            _ if argument.starts_with('{') => options.config = serde_json::from_str(&argument)?,
            _ => options.names.push(argument),
        }
    }
    Ok(options)
}

/// A recording changed in one way.
struct Case {
    name: String,
    log: CarmenLog,
    num_faults: usize,
}

fn cases(log: &CarmenLog, options: &Options) -> Vec<Case> {
    if options.with_beams {
        let case =
            |beams: usize| Case { name: format!("{beams} beams"), log: thinned(log, beams), num_faults: 0 };
        return [180, 60, 30, 11].map(case).into();
    }
    let case = |fault: OdometryFault| {
        let mut log = log.clone();
        let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
        let places = inject(&mut log.scans, fault, NUM_FAULTS, &mut rng);
        Case { name: fault.name().to_owned(), log, num_faults: places.len() }
    };
    OdometryFault::ALL.map(case).into()
}

/// Translates a case, maps it if wanted, prints what came of it, and returns the same as JSON.
fn judge(
    recording: &str,
    case: &Case,
    truth: &[Option<Pose2>],
    relations: &[Relation],
    options: &Options,
) -> Result<serde_json::Value, Failure> {
    let Case { name, log, num_faults } = case;
    let began = Instant::now();
    let driven = translate(&options.config, &log.geometry, &log.scans)?;
    let scans_per_s = log.scans.len() as f64 / began.elapsed().as_secs_f64();
    let errors = open_loop(&driven.run_from_robot, truth, &driven.cuts);
    let meters = Errors::of(errors.iter().map(|error| error.0).collect());
    let degrees = Errors::of(errors.iter().map(|error| error.1).collect());
    print!("{recording:12} {name:18} {num_faults:2} faults, over {WINDOW_M} m {meters} m, {degrees}°");
    let mut row = json!({
        "recording": recording, "case": name, "faults": num_faults, "scans_per_s": scans_per_s,
        "open_loop_m": meters.to_json(), "open_loop_deg": degrees.to_json(),
    });
    if options.with_map {
        let record = RunRecord {
            geometry: &log.geometry,
            observations: &driven.observations,
            words: &driven.words,
            keyframes: &driven.keyframes,
            area: None,
        };
        let pieces = SitePieces::new(&[record], std::slice::from_ref(&driven.cuts));
        let map =
            map_site(&options.config.mapping, &pieces.records(), &[], &mut RegistrationMemo::default())?;
        let mut poses = Vec::new();
        for (piece, mapped) in pieces.pieces().iter().zip(&map.runs) {
            let (scans, keyframes) = (&piece.scans, &piece.keyframes);
            let held = scans.start as usize..(scans.end as usize).min(log.scans.len());
            let keyframes = &driven.keyframes[keyframes.start as usize..keyframes.end as usize];
            let placed = (keyframes, mapped.map_from_keyframes.as_slice());
            poses.extend(mapped_poses(&log.scans, held, &driven.run_from_robot, placed, mapped.component));
        }
        print!("; {} pieces in {} components", map.runs.len(), map.num_components);
        row["pieces"] = json!(map.runs.len());
        row["components"] = json!(map.num_components);
        let report = judge_map(&poses, relations);
        let (place, turn) = (&report.translation_m, &report.rotation_deg);
        print!("; map {:.4} ± {:.4} m, {:.3} ± {:.3}°", place.mean, place.sd, turn.mean, turn.sd);
        row["map"] = serde_json::to_value(report)?;
    }
    println!("; {scans_per_s:.0} scans/s");
    Ok(row)
}

fn main() -> Result<(), Failure> {
    let options = options()?;
    let mut rows = Vec::new();
    for recording in &options.names {
        let log = read_carmen_log(read_text("laser", recording, "log")?.lines(), &CarmenOptions::default())?;
        let truth = parse_truth(&read_text("laser", recording, "truth").unwrap_or_default())?;
        let relations = parse_relations(&read_text("relations", recording, "relations").unwrap_or_default())?;
        let odometry: Vec<OdometryPose> = log
            .scans
            .iter()
            .map(|scan| OdometryPose {
                timestamp_ns: scan.timestamp_ns,
                odom_from_robot: scan.odom_from_robot,
            })
            .collect();
        let truth = join_truth(&odometry, &truth);
        let is_wanted = |case: &Case| options.only.split(',').any(|part| case.name.contains(part));
        for case in cases(&log, &options).iter().filter(|case| is_wanted(case)) {
            rows.push(judge(recording, case, &truth, &relations, &options)?);
        }
    }
    if let Some(file) = &options.json_file {
        std::fs::write(file, serde_json::to_string_pretty(&rows)?)?;
    }
    Ok(())
}
