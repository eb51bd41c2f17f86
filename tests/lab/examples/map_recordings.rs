//! Maps recordings without a server and judges the map, the quick way to try a change of the map builder.
//!
//! `LOCUTION_DATASETS=… cargo run --release --example map_recordings -- aces intel/4 wean1 wean3` builds one site of
//! all recordings named. `intel/4` is cut into four robots that do not know where they start. Recordings of one
//! building share their name up to the digits at its end. Truth and relations are used where they are there. An argument
//! that begins with a brace is the configuration: `'{"mapping":{"max_rounds":3}}'`.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

use locution_engine::config::EngineConfig;
use locution_engine::formats::{
    CarmenLog, CarmenOptions, Relation, TruthPose, parse_relations, parse_truth, read_carmen_log,
};
use locution_engine::geometry::{Pose2, wrap_angle};
use locution_engine::mapping::{Keyframe, MatchState, RegistrationMemo, RunRecord, SiteMap, map_site};
use locution_engine::scan::{Scan, ScanGeometry};
use locution_engine::text::{Observation, Word};
use locution_engine::translator::{Translation, Translator};
use locution_lab::evaluation::{
    EstimatedPose, JudgedMatch, JudgedRun, OdometryPose, Visit, join_truth, judge_map, judge_recognition,
};
use rayon::prelude::*;

type Failure = Box<dyn std::error::Error + Send + Sync>;

/// One robot's part of a recording, translated.
struct Driven {
    name: String,
    building: String,
    geometry: ScanGeometry,
    scans: Vec<Scan>,
    observations: Vec<Observation>,
    words: Vec<Word>,
    keyframes: Vec<Keyframe>,
    truth: Vec<Option<Pose2>>,
}

fn main() -> Result<(), Failure> {
    let began = Instant::now();
    let mut config = EngineConfig::default();
    let (mut runs, mut relations) = (Vec::new(), Vec::new());
    for argument in std::env::args().skip(1) {
        if argument.starts_with('{') {
            config = serde_json::from_str(&argument)?;
            continue;
        }
        let (name, num_parts) = match argument.split_once('/') {
            Some((name, parts)) => (name, parts.parse()?),
            None => (argument.as_str(), 1),
        };
        relations.extend(
            read_text("relations", name, "relations")
                .map_or(Ok(Vec::new()), |text| parse_relations(&text))?,
        );
        runs.extend(read_recording(name, num_parts)?);
    }
    let runs: Vec<Driven> =
        runs.into_par_iter().map(|run| translate(run, &config)).collect::<Result<_, Failure>>()?;
    println!("{} runs translated after {:.1} s", runs.len(), began.elapsed().as_secs_f64());
    let records: Vec<RunRecord<'_>> = runs.iter().map(Driven::record).collect();
    let mapping = Instant::now();
    let map = map_site(&config.mapping, &records, &[], &mut RegistrationMemo::default())?;
    println!("mapped in {:.1} s", mapping.elapsed().as_secs_f64());
    report_components(&runs, &map);
    report_map_error(&runs, &map, &relations);
    report_recognition(&runs, &map);
    Ok(())
}

/// A data set's file, gzipped; none when it is absent.
fn read_text(folder: &str, name: &str, ending: &str) -> Option<String> {
    let datasets = std::env::var_os("LOCUTION_DATASETS").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/datasets"),
        PathBuf::from,
    );
    locution_lab::recordings::read_text(&datasets.join(folder).join(format!("{name}.{ending}.gz"))).ok()
}

/// A recording cut into consecutive robots, each with an odometry frame of its own.
fn read_recording(name: &str, num_parts: usize) -> Result<Vec<Driven>, Failure> {
    let text = read_text("laser", name, "log").ok_or_else(|| format!("no recording {name}"))?;
    let log: CarmenLog = read_carmen_log(text.lines(), &CarmenOptions::default())?;
    let truth: Vec<TruthPose> =
        read_text("laser", name, "truth").map_or(Ok(Vec::new()), |text| parse_truth(&text))?;
    let odometry: Vec<OdometryPose> = log
        .scans
        .iter()
        .map(|scan| OdometryPose { timestamp_ns: scan.timestamp_ns, odom_from_robot: scan.odom_from_robot })
        .collect();
    let truth = join_truth(&odometry, &truth);
    let building = name.trim_end_matches(|c: char| c.is_ascii_digit()).to_owned();
    let bound = |part: usize| log.scans.len() * part / num_parts;
    let part = |part: usize| {
        let range = bound(part)..bound(part + 1);
        let start = log.scans[range.start].odom_from_robot;
        let restarted =
            |scan: &Scan| Scan { odom_from_robot: start.between(&scan.odom_from_robot), ..scan.clone() };
        Driven {
            name: if num_parts == 1 { name.to_owned() } else { format!("{name}-{}", part + 1) },
            building: building.clone(),
            geometry: log.geometry.clone(),
            scans: log.scans[range.clone()].iter().map(restarted).collect(),
            observations: Vec::new(),
            words: Vec::new(),
            keyframes: Vec::new(),
            truth: truth[range].to_vec(),
        }
    };
    Ok((0..num_parts).map(part).collect())
}

fn translate(mut run: Driven, config: &EngineConfig) -> Result<Driven, Failure> {
    let mut translator = Translator::new(&config.translator, run.geometry.clone())?;
    for index in 0..run.scans.len() {
        let translation = translator.push(&run.scans[index]);
        run.take(translation);
    }
    run.take(translator.finish());
    Ok(run)
}

impl Driven {
    fn take(&mut self, translation: Translation) {
        self.observations.extend(translation.observations);
        self.words.extend(translation.words);
        if let Some(pose) = translation.keyframe {
            self.keyframes.push(Keyframe {
                scan_seq: pose.scan_seq,
                timestamp_ns: pose.timestamp_ns,
                odom_from_robot: pose.odom_from_robot,
                run_from_robot: pose.run_from_robot,
                motion_covariance: pose.motion_covariance,
                ranges_m: self.scans[pose.scan_seq as usize].ranges_m.clone(),
            });
        }
    }

    fn record(&self) -> RunRecord<'_> {
        RunRecord {
            geometry: &self.geometry,
            observations: &self.observations,
            words: &self.words,
            keyframes: &self.keyframes,
            area: None,
        }
    }
}

fn report_components(runs: &[Driven], map: &SiteMap) {
    let mut members: BTreeMap<u32, Vec<&str>> = BTreeMap::new();
    for (run, mapped) in runs.iter().zip(&map.runs) {
        members.entry(mapped.component).or_default().push(&run.name);
    }
    println!("{} registrations refused", map.refused.len());
    println!("{} components: {:?}", map.num_components, members.values().collect::<Vec<_>>());
}

fn report_map_error(runs: &[Driven], map: &SiteMap, relations: &[Relation]) {
    let mut poses = Vec::new();
    for (run, mapped) in runs.iter().zip(&map.runs) {
        for (scan_seq, scan) in run.scans.iter().enumerate() {
            let placed = placed(run, &mapped.map_from_keyframes, scan_seq);
            poses.extend(placed.map(|map_from_robot| EstimatedPose {
                timestamp_ns: scan.timestamp_ns,
                component: u64::from(mapped.component),
                map_from_robot,
            }));
        }
    }
    let report = judge_map(&poses, relations);
    println!(
        "map error {:.4} ± {:.4} m, {:.3} ± {:.3}° over {} relations, {} skipped",
        report.translation_m.mean,
        report.translation_m.sd,
        report.rotation_deg.mean,
        report.rotation_deg.sd,
        report.relations,
        report.skipped
    );
}

/// Between keyframes odometry, its error spread evenly, as the server does it.
fn placed(run: &Driven, map_from_keyframes: &[Pose2], scan_seq: usize) -> Option<Pose2> {
    let after = run.keyframes.partition_point(|keyframe| keyframe.scan_seq <= scan_seq as u64);
    let odom_from = |scan_seq: u64| run.scans[scan_seq as usize].odom_from_robot;
    let first = after.saturating_sub(1);
    let before = run.keyframes.get(first)?;
    let moved = |to: &Pose2| map_from_keyframes[first].compose(&odom_from(before.scan_seq).between(to));
    let here = moved(&run.scans[scan_seq].odom_from_robot);
    let Some(next) = run.keyframes.get(after).filter(|_| after > 0) else { return Some(here) };
    let (carried, known) = (moved(&odom_from(next.scan_seq)), map_from_keyframes[after]);
    let share = (scan_seq as u64 - before.scan_seq) as f64 / (next.scan_seq - before.scan_seq) as f64;
    Some(Pose2::new(
        here.x + share * (known.x - carried.x),
        here.y + share * (known.y - carried.y),
        here.theta + share * wrap_angle(known.theta - carried.theta),
    ))
}

fn report_recognition(runs: &[Driven], map: &SiteMap) {
    let mut buildings: Vec<&str> = runs.iter().map(|run| run.building.as_str()).collect();
    buildings.dedup();
    let judged_runs: Vec<JudgedRun> = runs
        .iter()
        .map(|run| JudgedRun {
            truth_frame: buildings.iter().position(|name| *name == run.building).unwrap_or_default() as u32,
            visits: run
                .observations
                .iter()
                .map(|observation| Visit {
                    travel_m: observation.travel_m,
                    truth_from_robot: run.truth.get(observation.scan_seq as usize).copied().flatten(),
                })
                .collect(),
        })
        .collect();
    let matches: Vec<JudgedMatch> = map
        .matches
        .iter()
        .map(|found| JudgedMatch {
            earlier: found.earlier,
            later: found.later,
            direction: found.direction,
            score: found.probability,
            is_verified: found.state == MatchState::Verified,
        })
        .collect();
    let between = map.matches.iter().filter(|found| {
        let building = |run_idx: u32| &runs[run_idx as usize].building;
        found.state == MatchState::Verified
            && building(found.earlier.run_idx) != building(found.later.run_idx)
    });
    let report = judge_recognition(&judged_runs, &matches);
    println!(
        "recall at precision 0.99: {:.3} of {} + {} revisits; verified: {} claims, precision {:.4}, recall {:.3}; \
         {} of {} matches verified, {} of them between buildings",
        report.recall_at_precision_99.all,
        report.revisits.same,
        report.revisits.opposite,
        report.verified.claims,
        report.verified.precision,
        report.verified.recall_all,
        matches.iter().filter(|judged| judged.is_verified).count(),
        matches.len(),
        between.count()
    );
}
