//! Simulated robots, driven once and kept on disk: simulating and translating costs more than mapping.

use std::path::PathBuf;

use locution_engine::config::EngineConfig;
use locution_engine::formats::CarmenOptions;
use locution_engine::geometry::Pose2;
use locution_engine::mapping::{Keyframe, RunRecord};
use locution_engine::scan::{Scan, ScanGeometry};
use locution_engine::text::{Observation, Word};
use locution_engine::translator::{Translation, Translator};
use locution_lab::recordings::read_recording;
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

    /// A recording of the data sets.
    pub fn recorded(name: &str) -> Result<Self, Failure> {
        kept(name, || {
            let path = datasets().join("laser").join(format!("{name}.log.gz"));
            let log = read_recording(&path, CarmenOptions::default())?.log;
            Self::translated(name, log.geometry.clone(), &log.scans)
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
        }
    }
}

/// A drive that was kept, or made now and kept for the next trial.
fn kept(name: &str, make: impl FnOnce() -> Result<Driven, Failure>) -> Result<Driven, Failure> {
    let Some(folder) = std::env::var_os("LOCUTION_DRIVES").map(PathBuf::from) else { return make() };
    let path = folder.join(format!("{name}.json"));
    if let Ok(bytes) = std::fs::read(&path) {
        return Ok(serde_json::from_slice(&bytes)?);
    }
    let run = make()?;
    std::fs::create_dir_all(&folder)?;
    std::fs::write(&path, serde_json::to_vec(&run)?)?;
    Ok(run)
}

/// Where the data sets are.
fn datasets() -> PathBuf {
    std::env::var_os("LOCUTION_DATASETS").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/datasets"),
        PathBuf::from,
    )
}
