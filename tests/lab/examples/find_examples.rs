//! Looks for short pieces of recordings in the maps of others, and fits the weights that turn evidence into probability.
//!
//! `LOCUTION_DATASETS=… cargo run --release --example find_examples -- fit=intel/2-1:intel/2-2 wean1:wean3` maps the part
//! before each colon and asks where pieces of the part behind it were driven, and where pieces of all other buildings
//! were: nowhere. `intel/2-1` is the first half of a recording. Weights are fitted to the pairs marked `fit=`.
//! An argument that begins with a brace is the configuration; `length=12` is the driven length.

use std::path::PathBuf;
use std::time::Instant;

use locution_engine::config::EngineConfig;
use locution_engine::formats::{CarmenLog, CarmenOptions, TruthPose, parse_truth, read_carmen_log};
use locution_engine::geometry::{Pose2, angle_between};
use locution_engine::mapping::{Keyframe, RegistrationMemo, RunRecord, map_site, place_observations};
use locution_engine::recall::{
    Calibration, Example, NUM_FEATURES, PlaceIndex, PlaceIndexBuilder, PlacedDrive,
};
use locution_engine::scan::{Scan, ScanGeometry};
use locution_engine::text::Observation;
use locution_engine::translator::Translator;
use locution_lab::evaluation::{OdometryPose, join_truth};

type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Pieces asked about for every pair of recordings.
const NUM_PIECES: usize = 60;
/// A piece ends where the map has been when nearer than this to a mapped place, metres; farther than twice this it does
/// not; between the two nobody can say.
const MAPPED_M: f64 = 2.0;

/// A part of a recording.
struct Part {
    building: String,
    geometry: ScanGeometry,
    scans: Vec<Scan>,
    truth: Vec<Option<Pose2>>,
}

/// A pair of parts with the map of the first.
struct Pair {
    name: String,
    is_fitted: bool,
    building: String,
    index: PlaceIndex,
    /// True and mapped poses along the map's recording.
    mapped: Vec<(Pose2, Pose2)>,
    query: Part,
}

/// What was answered to one piece: features and whether it is right, by place.
struct Asked {
    is_here: bool,
    places: Vec<([f64; NUM_FEATURES], bool)>,
}

fn main() -> Result<(), Failure> {
    let mut config = EngineConfig::default();
    let mut length_m = 12.0;
    let mut pairs = Vec::new();
    for argument in std::env::args().skip(1) {
        if argument.starts_with('{') {
            config = serde_json::from_str(&argument)?;
        } else if let Some(length) = argument.strip_prefix("length=") {
            length_m = length.parse()?;
        } else {
            pairs.push(read_pair(&argument, &config)?);
        }
    }
    let mut fitted = Vec::new();
    let mut held_out = Vec::new();
    for pair in &pairs {
        let mut asked = Vec::new();
        let (mut times_s, mut cpu_times_s) = (Vec::new(), Vec::new());
        for other in &pairs {
            let is_own = std::ptr::eq(pair, other);
            if is_own || other.building != pair.building {
                for (first, last) in pieces(&other.query, length_m, if is_own { NUM_PIECES } else { 10 }) {
                    let truth = other.query.truth[last];
                    let Some(expected) = expected(pair, is_own, truth) else { continue };
                    let scans = &other.query.scans[first..=last];
                    let began = Instant::now();
                    let began_cpu = cpu_s();
                    asked.push(ask(pair, &other.query.geometry, scans, expected, &config)?);
                    times_s.push(began.elapsed().as_secs_f64());
                    cpu_times_s.push(cpu_s() - began_cpu);
                }
            }
        }
        times_s.sort_by(f64::total_cmp);
        cpu_times_s.sort_by(f64::total_cmp);
        println!(
            "{}: {} asked, {} here; median {:.1} ms, p99 {:.1} ms; on one core {:.1} and {:.1} ms; index {:.1} MB",
            pair.name,
            asked.len(),
            asked.iter().filter(|asked| asked.is_here).count(),
            1e3 * times_s[times_s.len() / 2],
            1e3 * times_s[times_s.len() * 99 / 100],
            1e3 * cpu_times_s[times_s.len() / 2],
            1e3 * cpu_times_s[times_s.len() * 99 / 100],
            pair.index.num_bytes() as f64 / 1e6
        );
        report(&asked, &config.recall.calibration);
        if pair.is_fitted { fitted.extend(asked) } else { held_out.extend(asked) }
    }
    let fresh = fit(&fitted);
    println!("fitted weights {fresh:.3?}");
    println!("on the fitted pairs:");
    report(&fitted, &Calibration { weights: fresh });
    println!("on the others:");
    report(&held_out, &Calibration { weights: fresh });
    Ok(())
}

fn read_pair(argument: &str, config: &EngineConfig) -> Result<Pair, Failure> {
    let names = argument.strip_prefix("fit=").unwrap_or(argument);
    let (map, query) = names.split_once(':').ok_or("a pair is MAP:QUERY")?;
    let (map, query) = (read_part(map)?, read_part(query)?);
    let began = Instant::now();
    let (index, mapped) = index_of(&map, config)?;
    println!("{names} mapped in {:.1} s", began.elapsed().as_secs_f64());
    Ok(Pair {
        name: names.to_owned(),
        is_fitted: argument.starts_with("fit="),
        building: map.building,
        index,
        mapped,
        query,
    })
}

fn read_part(name: &str) -> Result<Part, Failure> {
    let (name, num_parts, part) = match name.split_once('/') {
        Some((name, parts)) => {
            let (num_parts, part) = parts.split_once('-').ok_or("a part is NAME/N-K")?;
            (name, num_parts.parse::<usize>()?, part.parse::<usize>()? - 1)
        }
        None => (name, 1, 0),
    };
    let log: CarmenLog = read_carmen_log(read_text(name, "log")?.lines(), &CarmenOptions::default())?;
    let truth: Vec<TruthPose> = parse_truth(&read_text(name, "truth")?)?;
    let odometry: Vec<OdometryPose> = log
        .scans
        .iter()
        .map(|scan| OdometryPose { timestamp_ns: scan.timestamp_ns, odom_from_robot: scan.odom_from_robot })
        .collect();
    let truth = join_truth(&odometry, &truth);
    let range = log.scans.len() * part / num_parts..log.scans.len() * (part + 1) / num_parts;
    Ok(Part {
        building: name.trim_end_matches(|c: char| c.is_ascii_digit()).to_owned(),
        geometry: log.geometry.clone(),
        scans: log.scans[range.clone()].to_vec(),
        truth: truth[range].to_vec(),
    })
}

fn read_text(name: &str, ending: &str) -> Result<String, Failure> {
    let datasets = std::env::var_os("LOCUTION_DATASETS").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/datasets"),
        PathBuf::from,
    );
    Ok(locution_lab::recordings::read_text(&datasets.join("laser").join(format!("{name}.{ending}.gz")))?)
}

/// Maps a part and prepares it for questions.
fn index_of(part: &Part, config: &EngineConfig) -> Result<(PlaceIndex, Vec<(Pose2, Pose2)>), Failure> {
    let mut translator = Translator::new(&config.translator, part.geometry.clone())?;
    let mut observations: Vec<Observation> = Vec::new();
    let mut keyframes: Vec<Keyframe> = Vec::new();
    for scan in &part.scans {
        let read = translator.push(scan);
        observations.extend(read.observations);
        keyframes.extend(read.keyframe.map(|pose| Keyframe {
            scan_seq: pose.scan_seq,
            timestamp_ns: pose.timestamp_ns,
            odom_from_robot: pose.odom_from_robot,
            run_from_robot: pose.run_from_robot,
            motion_covariance: pose.motion_covariance,
            ranges_m: scan.ranges_m.clone(),
        }));
    }
    observations.extend(translator.finish().observations);
    let record = RunRecord {
        geometry: &part.geometry,
        observations: &observations,
        words: &[],
        keyframes: &keyframes,
        area: None,
    };
    let map = map_site(&config.mapping, &[record], &[], &mut RegistrationMemo::default())?;
    let mapped = &map.runs[0];
    let mut builder = PlaceIndexBuilder::new(&config.recall);
    let map_from_observations = place_observations(&record, mapped);
    builder.add_run(&observations, PlacedDrive { component: 0, map_from_observations });
    let mut pairs = Vec::new();
    for (keyframe, pose) in keyframes.iter().zip(&mapped.map_from_keyframes) {
        builder.add_scan(0, &part.geometry, pose, &keyframe.ranges_m);
        pairs.extend(part.truth[keyframe.scan_seq as usize].map(|truth| (truth, *pose)));
    }
    Ok((builder.finish(), pairs))
}

/// First and last scans of pieces of a length, evenly spread.
fn pieces(part: &Part, length_m: f64, count: usize) -> Vec<(usize, usize)> {
    let mut travel_m = vec![0.0];
    for two in part.scans.windows(2) {
        travel_m
            .push(travel_m.last().unwrap_or(&0.0) + two[0].odom_from_robot.distance(&two[1].odom_from_robot));
    }
    let all_m = travel_m.last().copied().unwrap_or(0.0);
    (0..count)
        .map(|k| length_m + (all_m - length_m) * (k as f64 + 0.5) / count as f64)
        .map(|end_m| {
            let last = travel_m.partition_point(|&at| at < end_m).min(travel_m.len() - 1);
            (travel_m.partition_point(|&at| at < travel_m[last] - length_m), last)
        })
        .collect()
}

/// Where a piece ends in the map, by the nearest mapped place; the outer none when nobody can say.
fn expected(pair: &Pair, is_own: bool, truth: Option<Pose2>) -> Option<Option<Pose2>> {
    if !is_own {
        return Some(None);
    }
    let truth = truth?;
    let (known, map_pose) =
        pair.mapped.iter().min_by(|a, b| a.0.distance(&truth).total_cmp(&b.0.distance(&truth)))?;
    match known.distance(&truth) {
        near if near < MAPPED_M => Some(Some(map_pose.compose(&known.between(&truth)))),
        far if far > 2.0 * MAPPED_M => Some(None),
        _ => None,
    }
}

/// Processor time of all threads so far, where the system tells it; it does not depend on what else the machine does.
fn cpu_s() -> f64 {
    let Ok(threads) = std::fs::read_dir("/proc/self/task") else { return 0.0 };
    let time_ns = |thread: std::fs::DirEntry| {
        let text = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        text.split(' ').next()?.parse::<f64>().ok()
    };
    threads.flatten().filter_map(time_ns).sum::<f64>() * 1e-9
}

fn ask(
    pair: &Pair,
    geometry: &ScanGeometry,
    scans: &[Scan],
    expected: Option<Pose2>,
    config: &EngineConfig,
) -> Result<Asked, Failure> {
    let example = Example::read(&config.translator, geometry, scans, &config.recall)?;
    let found = example.map_or(Vec::new(), |example| pair.index.find(&example, &config.recall));
    let is_right = |pose: &Pose2| {
        expected.is_some_and(|expected| {
            pose.distance(&expected) < 0.5 && angle_between(pose.theta, expected.theta) < 10f64.to_radians()
        })
    };
    let places = found.iter().map(|place| (place.evidence.features(), is_right(&place.map_from_robot)));
    let asked = Asked { is_here: expected.is_some(), places: places.collect() };
    if std::env::var_os("VERBOSE").is_some() {
        let best = found.first();
        println!(
            "  here {} right {:?} best {:?} expected {:?}",
            asked.is_here,
            asked.places.iter().position(|place| place.1),
            best.map(|best| (best.map_from_robot, best.evidence, best.log_odds)),
            expected
        );
    }
    Ok(asked)
}

fn probabilities(asked: &Asked, weights: &[f64; NUM_FEATURES]) -> Vec<f64> {
    let log_odds: Vec<f64> = asked
        .places
        .iter()
        .map(|(features, _)| features.iter().zip(weights).map(|(feature, weight)| feature * weight).sum())
        .collect();
    Calibration::probabilities(&log_odds)
}

fn report(asked: &[Asked], calibration: &Calibration) {
    let num_here = asked.iter().filter(|asked| asked.is_here).count();
    let among = asked.iter().filter(|asked| asked.places.iter().any(|place| place.1)).count();
    let (mut found, mut wrong, mut first) = (0, 0, 0);
    let mut bins = [(0usize, 0usize, 0.0f64); 10];
    for asked in asked {
        let probabilities = probabilities(asked, &calibration.weights);
        for (probability, place) in probabilities.iter().zip(&asked.places).filter(|(p, _)| **p >= 0.01) {
            let bin = &mut bins[((probability * 10.0) as usize).min(9)];
            *bin = (bin.0 + 1, bin.1 + usize::from(place.1), bin.2 + probability);
        }
        let best = probabilities.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
        let Some((best, probability)) = best else { continue };
        let is_right = asked.places[best].1;
        first += usize::from(is_right);
        if *probability > 0.9 {
            found += usize::from(is_right);
            wrong += usize::from(!is_right);
        }
    }
    println!(
        "  {num_here} here of {}: {among} among the places, {first} first; above 0.9: {found} right, {wrong} wrong",
        asked.len()
    );
    let shown = bins.iter().filter(|bin| bin.0 > 0).map(|(count, right, sum)| {
        format!("{:.2}: {:.2} of {count}", sum / *count as f64, *right as f64 / *count as f64)
    });
    println!("  said: true — {}", shown.collect::<Vec<_>>().join(", "));
}

/// Weights of highest likelihood with a weak prior at 0, by plain gradient ascent with momentum.
fn fit(asked: &[Asked]) -> [f64; NUM_FEATURES] {
    let mut weights = [0.0; NUM_FEATURES];
    let mut momentum = [0.0; NUM_FEATURES];
    for _ in 0..20_000 {
        let mut gradient = weights.map(|weight| -0.01 * weight);
        for asked in asked {
            let probabilities = probabilities(asked, &weights);
            for (probability, (features, is_right)) in probabilities.iter().zip(&asked.places) {
                let error = f64::from(u8::from(*is_right)) - probability;
                for (gradient, feature) in gradient.iter_mut().zip(features) {
                    *gradient += error * feature;
                }
            }
        }
        for ((weight, momentum), gradient) in weights.iter_mut().zip(&mut momentum).zip(gradient) {
            *momentum = 0.9 * *momentum + 0.1 * gradient / asked.len().max(1) as f64;
            *weight += 0.3 * *momentum;
        }
    }
    weights
}
