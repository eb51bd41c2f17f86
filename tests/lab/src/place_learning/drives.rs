//! Drives through labelled buildings, recorded and simulated, each at its true poses.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use locution_engine::formats::{CarmenOptions, LabeledPlaces};
use locution_engine::geometry::{Point2, Pose2};
use locution_engine::scan::ScanGeometry;
use locution_engine::semantics::{DrivenRun, PlaceLabel};
use rayon::prelude::*;

use super::plan_labels::PlanLabels;
use crate::evaluation::{OdometryPose, join_truth};
use crate::recordings::{read_recording, read_text, read_truth};
use crate::simulation::{LaserConfig, SimulatedRun, SimulationConfig, Task, World, simulate_run};
use crate::thesis::scenarios::Plan;
use crate::worlds::{decode_picture, read_world};

/// Travel between two observations, metres.
const OBSERVATION_M: f64 = 0.1;
/// Travel and turn between two scans that are looked at: a keyframe's.
const SCAN_M: f64 = 0.2;
const SCAN_RAD: f64 = 0.17;
/// Share of the doors of a plan that are shut.
const DOOR_SHUT_SHARE: f64 = 0.4;
/// Driven in a simulated building, metres.
const WANDER_M: f64 = 250.0;
/// Time from one scan to the next, seconds: no more scans than are looked at.
const SCAN_PERIOD_S: f64 = 0.25;

/// A drive at its true poses.
pub struct Drive {
    /// What is left out together.
    pub building: String,
    /// Tells it from others in the building.
    pub name: String,
    /// Whether a real robot drove.
    pub is_real: bool,
    geometry: ScanGeometry,
    scans: Vec<(Pose2, Vec<f32>)>,
    /// True pose of each observation.
    pub truth: Vec<Pose2>,
    /// What its place is; `None` where nobody says.
    pub labels: Vec<Option<PlaceLabel>>,
}

impl Drive {
    /// The drive as the engine labels it.
    pub fn as_run(&self) -> DrivenRun<'_> {
        DrivenRun {
            geometry: &self.geometry,
            scans: self.scans.iter().map(|(pose, ranges)| (*pose, ranges.as_slice())).collect(),
            map_from_observations: self.truth.clone(),
        }
    }

    fn new(
        (building, name, is_real): (&str, &str, bool),
        geometry: &ScanGeometry,
        posed: &[(Pose2, &[f32])],
        mut label_at: impl FnMut(&Point2) -> Option<PlaceLabel>,
    ) -> Self {
        let mut scans: Vec<(Pose2, Vec<f32>)> = Vec::new();
        let mut truth: Vec<Pose2> = Vec::new();
        for (pose, ranges) in posed {
            let is_scan = scans.last().is_none_or(|(last, _)| {
                let step = last.between(pose);
                step.x.hypot(step.y) >= SCAN_M || step.theta.abs() >= SCAN_RAD
            });
            if is_scan {
                scans.push((*pose, ranges.to_vec()));
            }
            // Recordings that keep a scan only now and then still have an observation every so often.
            let from = truth.last().copied().unwrap_or(*pose);
            let steps = (from.distance(pose) / OBSERVATION_M) as usize;
            if truth.is_empty() {
                truth.push(*pose);
            }
            for step in 1..=steps {
                let share = step as f64 / steps as f64;
                let at = |a: f64, b: f64| a + share * (b - a);
                truth.push(Pose2::new(at(from.x, pose.x), at(from.y, pose.y), pose.theta));
            }
        }
        let labels = truth.iter().map(|pose| label_at(&pose.position())).collect();
        Self {
            building: building.into(),
            name: name.into(),
            is_real,
            geometry: geometry.clone(),
            scans,
            truth,
            labels,
        }
    }
}

/// Where the data sets are, and the labels of ours.
pub struct Sources {
    /// The folder of the data sets.
    pub datasets: PathBuf,
    /// The folder of labels that are not among them.
    pub own_labels: PathBuf,
}

impl Sources {
    /// All recordings of which labels are known.
    ///
    /// # Errors
    /// Files that cannot be read.
    pub fn recorded(&self) -> Result<Vec<Drive>> {
        let mut drives = Vec::new();
        for name in ["aces", "intel", "mit-killian"] {
            let labels = self.datasets.join(format!("labels/{name}.json"));
            drives.push(self.with_truth(name, name, &labels)?);
        }
        for name in ["wean1", "wean3", "wean4"] {
            drives.push(self.with_truth("wean", name, &self.own_labels.join("wean.json"))?);
        }
        for name in ["acapulco", "edmonton"] {
            let labels = read_places(&self.own_labels.join(format!("{name}.json")))?;
            let path = self.datasets.join(format!("laser_corrected/{name}.log.gz"));
            let log = read_recording(&path, CarmenOptions::default())?.log;
            let posed: Vec<(Pose2, &[f32])> =
                log.scans.iter().map(|scan| (scan.odom_from_robot, scan.ranges_m.as_slice())).collect();
            drives.push(Drive::new((name, name, true), &log.geometry, &posed, |at| label_of(&labels, at)));
        }
        Ok(drives)
    }

    fn with_truth(&self, building: &str, name: &str, labels: &Path) -> Result<Drive> {
        let file = |ending: &str| self.datasets.join(format!("laser/{name}.{ending}.gz"));
        let labels = read_places(labels)?;
        let log = read_recording(&file("log"), CarmenOptions::default())?.log;
        let odometry: Vec<OdometryPose> = log
            .scans
            .iter()
            .map(|scan| OdometryPose {
                timestamp_ns: scan.timestamp_ns,
                odom_from_robot: scan.odom_from_robot,
            })
            .collect();
        let truth = join_truth(&odometry, &read_truth(&file("truth"))?);
        let posed: Vec<(Pose2, &[f32])> = log
            .scans
            .iter()
            .zip(&truth)
            .filter_map(|(scan, pose)| Some(((*pose)?, scan.ranges_m.as_slice())))
            .collect();
        Ok(Drive::new((building, name, true), &log.geometry, &posed, |at| label_of(&labels, at)))
    }

    /// Simulated drives through the plans whose rooms are drawn, bare and furnished, and through the floors of chapter 4.
    ///
    /// # Errors
    /// Files that cannot be read.
    pub fn simulated(&self, seed: u64) -> Result<Vec<Drive>> {
        let plans = PLANS.into_par_iter().enumerate().map(|(idx, name)| {
            let rooms = self.rooms(name)?;
            let mut drives = Vec::new();
            for (kind, suffix) in ["", "-furniture"].into_iter().enumerate() {
                let world = read_world(&self.datasets.join(format!("worlds/{name}{suffix}.yaml")))?;
                let mut labels =
                    PlanLabels::new(name, &rooms, world.size().0, world.resolution_m(), world.origin())
                        .context("every plan has its rooms in the table")?;
                let variant = 2 * idx as u64 + kind as u64 + seed;
                let world = labels.shut_doors(&world, DOOR_SHUT_SHARE, variant)?;
                let run = simulated(&world, labels.widest_in(&world), variant)?;
                drives.push(drive_of((name, suffix), &run, |at| labels.label_at(at)));
            }
            Ok(drives)
        });
        let drives: Vec<Vec<Drive>> = plans.collect::<Result<_>>()?;
        let mut drives: Vec<Drive> = drives.into_iter().flatten().collect();
        for (idx, plan) in [Plan::Adjacent, Plan::Nested, Plan::Pair].into_iter().enumerate() {
            let (world, places) = plan.draw()?;
            let run = simulated(&world, None, 100 + idx as u64 + seed)?;
            let name = ["four-loops", "nested-loops", "two-loops"][idx];
            drives.push(drive_of((name, ""), &run, |at| label_of(&places, at)));
        }
        Ok(drives)
    }

    /// Numbers of the rooms of a plan, row by row from the lower left.
    pub fn rooms(&self, name: &str) -> Result<Vec<u32>> {
        let path = self.datasets.join(format!("rooms/{name}.rooms.png"));
        let bytes = std::fs::read(&path).with_context(|| path.display().to_string())?;
        let image = decode_picture(&bytes).with_context(|| path.display().to_string())?.gray;
        let rows = image.pixels.chunks(image.width.max(1)).rev();
        Ok(rows.flatten().map(|&number| u32::from(number)).collect())
    }
}

/// Plans whose rooms are drawn.
const PLANS: [&str; 11] = [
    "ipa-freiburg101",
    "ipa-freiburg52",
    "ipa-lab-a",
    "ipa-lab-b",
    "ipa-lab-f",
    "ipa-lab-ipa",
    "ipa-nlb",
    "ipa-office-a",
    "ipa-office-b",
    "ipa-office-c",
    "ipa-office-d",
];

/// Lasers by turns, people by halves; what drives is never twice the same.
fn simulated(world: &World, start: Option<Point2>, variant: u64) -> Result<SimulatedRun> {
    let mut config = SimulationConfig::default();
    let laser = |field_of_view_deg, num_ranges, range_max_m, range_noise_std_m| LaserConfig {
        field_of_view_deg,
        num_ranges,
        range_max_m,
        range_noise_std_m,
        ..LaserConfig::default()
    };
    config.laser = match variant % 4 {
        0 => laser(180.0, 181, 30.0, 0.02),
        1 => laser(270.0, 541, 20.0, 0.03),
        2 => laser(180.0, 361, 50.0, 0.01),
        _ => laser(240.0, 341, 8.0, 0.03),
    };
    config.drive.scan_period_s = SCAN_PERIOD_S;
    config.people.num_people = if variant.is_multiple_of(3) { 6 } else { 0 };
    Ok(simulate_run(world, &Task::Wander { length_m: WANDER_M, start }, &config, variant)?)
}

fn drive_of(
    (building, suffix): (&str, &str),
    run: &SimulatedRun,
    label_at: impl FnMut(&Point2) -> Option<PlaceLabel>,
) -> Drive {
    let posed: Vec<(Pose2, &[f32])> = run
        .truth
        .iter()
        .zip(&run.scans)
        .map(|(truth, scan)| (truth.truth_from_robot, scan.ranges_m.as_slice()))
        .collect();
    Drive::new((building, &format!("{building}{suffix}"), false), &run.geometry, &posed, label_at)
}

fn read_places(path: &Path) -> Result<LabeledPlaces> {
    serde_json::from_str(&read_text(path)?).with_context(|| path.display().to_string())
}

fn label_of(places: &LabeledPlaces, at: &Point2) -> Option<PlaceLabel> {
    PlaceLabel::from_name(places.label_at(at)?)
}
