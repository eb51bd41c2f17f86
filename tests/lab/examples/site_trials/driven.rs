//! Simulated robots, driven once and kept on disk: simulating and translating costs more than mapping.

use std::path::PathBuf;

use locution_engine::config::EngineConfig;
use locution_engine::formats::CarmenOptions;
use locution_engine::geometry::Pose2;
use locution_engine::mapping::{Keyframe, RunRecord};
use locution_engine::scan::{Scan, ScanGeometry};
use locution_engine::text::{Observation, Word};
use locution_engine::translator::{Translation, Translator};
use locution_lab::evaluation::{OdometryPose, join_truth};
use locution_lab::recordings::{read_recording, read_truth};
use locution_lab::simulation::{PeopleConfig, SimulationConfig, Task, simulate_run};
use locution_lab::worlds::read_world;
use serde::{Deserialize, Serialize};

use crate::Failure;

/// A robot's drive, translated, with the true pose of every keyframe where it is known.
#[derive(Clone, Serialize, Deserialize)]
pub struct Driven {
    /// World or building.
    pub place: String,
    geometry: ScanGeometry,
    observations: Vec<Observation>,
    words: Vec<Word>,
    pub keyframes: Vec<Keyframe>,
    /// True poses of the keyframes; empty when nobody knows.
    pub truth: Vec<Pose2>,
}

impl Driven {
    /// A robot that wanders through a world of the data sets while people walk there.
    pub fn wandering(world: &str, length_m: f64, num_people: usize, seed: u64) -> Result<Self, Failure> {
        kept(&format!("{world}-{length_m}-{num_people}-{seed}"), || {
            let people = PeopleConfig { num_people, ..PeopleConfig::default() };
            let config = SimulationConfig { people, ..SimulationConfig::default() };
            let task = Task::Wander { length_m, start: None };
            let drawn = read_world(&datasets().join("worlds").join(format!("{world}.yaml")))?;
            let simulated = simulate_run(&drawn, &task, &config, seed)?;
            let mut run = Self::translated(world, simulated.geometry.clone(), &simulated.scans)?;
            let true_pose =
                |keyframe: &Keyframe| simulated.truth[keyframe.scan_seq as usize].truth_from_robot;
            run.truth = run.keyframes.iter().map(true_pose).collect();
            Ok(run)
        })
    }

    /// A recording of the data sets, or of several that are named `intel/2/4` the second of four parts. Recordings of
    /// one building share their name up to the digits at its end.
    pub fn recorded(name: &str) -> Result<Self, Failure> {
        kept(&name.replace('/', "-of-"), || {
            let parts: Vec<&str> = name.split('/').collect();
            let (name, part, num_parts) = match parts[..] {
                [name, part, num_parts] => (name, part.parse::<usize>()? - 1, num_parts.parse::<usize>()?),
                _ => (name, 0, 1),
            };
            let folder = datasets().join("laser");
            let log = read_recording(&folder.join(format!("{name}.log.gz")), CarmenOptions::default())?.log;
            let poses = read_truth(&folder.join(format!("{name}.truth.gz"))).unwrap_or_default();
            let odometry = log.scans.iter().map(|scan| OdometryPose {
                timestamp_ns: scan.timestamp_ns,
                odom_from_robot: scan.odom_from_robot,
            });
            let truth = join_truth(&odometry.collect::<Vec<_>>(), &poses);
            let bound = |part: usize| log.scans.len() * part / num_parts;
            let range = bound(part)..bound(part + 1);
            let building = name.trim_end_matches(|c: char| c.is_ascii_digit());
            let mut run = Self::translated(building, log.geometry.clone(), &log.scans[range.clone()])?;
            run.truth = carried(&run.keyframes, &truth[range]);
            Ok(run)
        })
    }

    /// A recording as a server would translate it.
    fn translated(place: &str, geometry: ScanGeometry, scans: &[Scan]) -> Result<Self, Failure> {
        let mut translator = Translator::new(&EngineConfig::default().translator, geometry.clone())?;
        let mut run = Self {
            place: place.to_owned(),
            geometry,
            observations: Vec::new(),
            words: Vec::new(),
            keyframes: Vec::new(),
            truth: Vec::new(),
        };
        for scan in scans {
            run.take(translator.push(scan), scans);
        }
        run.take(translator.finish(), scans);
        Ok(run)
    }

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

    pub fn record(&self) -> RunRecord<'_> {
        RunRecord {
            geometry: &self.geometry,
            observations: &self.observations,
            words: &self.words,
            keyframes: &self.keyframes,
            area: None,
        }
    }
}

/// A drive that was kept, or made now and kept for the next trial.
fn kept(name: &str, make: impl FnOnce() -> Result<Driven, Failure>) -> Result<Driven, Failure> {
    let Some(folder) = std::env::var_os("LOCUTION_DRIVES").map(PathBuf::from) else { return make() };
    let path = folder.join(format!("{name}.cbor"));
    if let Ok(bytes) = std::fs::read(&path) {
        return Ok(ciborium::from_reader(bytes.as_slice())?);
    }
    let run = make()?;
    std::fs::create_dir_all(&folder)?;
    // JSON has no word for a reading that is not a number.
    let mut bytes = Vec::new();
    ciborium::into_writer(&run, &mut bytes)?;
    std::fs::write(&path, bytes)?;
    Ok(run)
}

/// Where the data sets are.
fn datasets() -> PathBuf {
    std::env::var_os("LOCUTION_DATASETS").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/datasets"),
        PathBuf::from,
    )
}

/// True poses of keyframes; where nobody knows them, those known before, carried on along the refined odometry.
fn carried(keyframes: &[Keyframe], truth: &[Option<Pose2>]) -> Vec<Pose2> {
    let of = |keyframe: &Keyframe| truth.get(keyframe.scan_seq as usize).copied().flatten();
    let Some(mut known) = keyframes.iter().find_map(|keyframe| Some((keyframe, of(keyframe)?))) else {
        return Vec::new();
    };
    let mut poses = Vec::with_capacity(keyframes.len());
    for keyframe in keyframes {
        if let Some(pose) = of(keyframe) {
            known = (keyframe, pose);
        }
        poses.push(known.1.compose(&known.0.run_from_robot.between(&keyframe.run_from_robot)));
    }
    poses
}
