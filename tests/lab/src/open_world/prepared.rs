//! Recordings cut into parts, and maps made of them that sessions and questions by example can look in.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, ensure};
use locution_engine::config::EngineConfig;
use locution_engine::formats::CarmenOptions;
use locution_engine::geometry::{Pose2, angle_between};
use locution_engine::locate::{ServedMap, SessionMap};
use locution_engine::mapping::{
    Keyframe, MappedRun, RegistrationMemo, RunRecord, map_site, place_observations,
};
use locution_engine::occupancy::{GridMap, OccupancyConfig, TiledOccupancy};
use locution_engine::recall::{PlaceIndexBuilder, PlacedDrive};
use locution_engine::scan::{Scan, ScanGeometry};
use locution_engine::text::Observation;
use locution_engine::translator::Translator;

use crate::evaluation::{OdometryPose, join_truth};
use crate::recordings::{read_recording, read_truth};

/// Nearer than this to where the map has been a robot is on it, metres; farther than twice this it is not; between the
/// two nobody can say.
const ON_MAP_M: f64 = 2.0;
/// Nearer than this is right where the map has been, metres …
const RIGHT_M: f64 = 0.5;
/// … and so much more for each metre off it: headings of maps and truths err by some degrees.
const RIGHT_SLOPE: f64 = 0.05;
/// A heading closer than this is right.
const RIGHT_DEG: f64 = 10.0;

/// A part of a recording.
pub struct Part {
    /// As it was asked for: `NAME` or `NAME@FROM,TO`.
    pub name: String,
    /// Recordings of one building share their name up to the digits at its end.
    pub building: String,
    /// The laser.
    pub geometry: ScanGeometry,
    /// In order of driving.
    pub scans: Vec<Scan>,
    /// A true pose for each scan that has one.
    pub truth: Vec<Option<Pose2>>,
    /// Metres driven at each scan, by odometry.
    pub travel_m: Vec<f64>,
}

impl Part {
    /// Reads `NAME` or `NAME@FROM,TO`, shares of its scans, from a folder of `NAME.log.gz` and `NAME.truth.gz`; without
    /// a truth all that is known is the building.
    ///
    /// # Errors
    /// A name or file that cannot be read.
    pub fn read(folder: &Path, name: &str) -> Result<Self> {
        let (base, range) = name.split_once('@').unwrap_or((name, "0,1"));
        let (from, to) = range.split_once(',').context("a part is NAME@FROM,TO")?;
        let (from, to): (f64, f64) = (from.parse()?, to.parse()?);
        ensure!(
            (0.0..=1.0).contains(&from) && from < to && to <= 1.0,
            "a part is two rising shares of 0 to 1"
        );
        let log = read_recording(&folder.join(format!("{base}.log.gz")), CarmenOptions::default())?.log;
        let truth_file = folder.join(format!("{base}.truth.gz"));
        let truth = if truth_file.exists() { read_truth(&truth_file)? } else { Vec::new() };
        let odometry: Vec<OdometryPose> = log
            .scans
            .iter()
            .map(|scan| OdometryPose {
                timestamp_ns: scan.timestamp_ns,
                odom_from_robot: scan.odom_from_robot,
            })
            .collect();
        let truth = join_truth(&odometry, &truth);
        let at = |share: f64| (share * log.scans.len() as f64).round() as usize;
        let scans = log.scans[at(from)..at(to)].to_vec();
        ensure!(scans.len() > 1, "{name} holds no scans");
        let mut travel_m = vec![0.0];
        for two in scans.windows(2) {
            let driven_m = travel_m.last().copied().unwrap_or(0.0);
            travel_m.push(driven_m + two[0].odom_from_robot.distance(&two[1].odom_from_robot));
        }
        let building = base.trim_end_matches(|c: char| c.is_ascii_digit()).to_owned();
        let truth = truth[at(from)..at(to)].to_vec();
        Ok(Self { name: name.to_owned(), building, geometry: log.geometry, scans, truth, travel_m })
    }

    /// Metres driven in all.
    pub fn length_m(&self) -> f64 {
        self.travel_m.last().copied().unwrap_or(0.0)
    }
}

/// A part as a map.
pub struct PreparedMap {
    /// Whose map it is.
    pub building: String,
    /// What sessions look in.
    pub session_map: SessionMap,
    /// True and mapped poses along it.
    pairs: Vec<(Pose2, Pose2)>,
}

impl PreparedMap {
    /// Maps a part; its poses are kept in the cache, when there is one, and read from there the next time.
    ///
    /// # Errors
    /// A laser or map that cannot be worked with; a cache that cannot be read or written.
    pub fn of(part: &Part, config: &EngineConfig, cache: Option<&PathBuf>) -> Result<Self> {
        let (observations, keyframes) = translated(part, config)?;
        let record = RunRecord {
            geometry: &part.geometry,
            observations: &observations,
            words: &[],
            keyframes: &keyframes,
            area: None,
        };
        let kept = cache.map(|folder| folder.join(format!("{}.json", part.name)));
        let map_from_keyframes = match &kept {
            Some(file) if file.exists() => serde_json::from_slice(&std::fs::read(file)?)?,
            _ => {
                map_site(&config.mapping, &[record], &[], &mut RegistrationMemo::default())?
                    .runs
                    .swap_remove(0)
                    .map_from_keyframes
            }
        };
        if let Some(file) = kept {
            std::fs::write(file, serde_json::to_vec(&map_from_keyframes)?)?;
        }
        let mapped = MappedRun { component: 0, map_from_keyframes };
        let record = RunRecord {
            geometry: &part.geometry,
            observations: &observations,
            words: &[],
            keyframes: &keyframes,
            area: None,
        };
        let mut builder = PlaceIndexBuilder::new(&config.recall);
        let map_from_observations = place_observations(&record, &mapped);
        builder.add_run(&observations, PlacedDrive { component: 0, map_from_observations });
        let occupancy = OccupancyConfig {
            resolution_m: 0.05,
            range_limit_m: 20.0,
            no_return_clear_m: 0.0,
            ..OccupancyConfig::default()
        };
        let mut drawn = TiledOccupancy::new(occupancy)?;
        let mut pairs = Vec::new();
        for (keyframe, pose) in keyframes.iter().zip(&mapped.map_from_keyframes) {
            builder.add_scan(0, &part.geometry, pose, &keyframe.ranges_m);
            drawn.add_scan(&part.geometry, &keyframe.ranges_m, pose);
            pairs.extend(part.truth[keyframe.scan_seq as usize].map(|truth| (truth, *pose)));
        }
        let grid = GridMap::of_occupancy(&drawn).context("a map of nothing")?;
        let served = ServedMap::build(grid.halved(), &config.localization.likelihood_field);
        let session_map =
            SessionMap { components: vec![(0, Arc::new(served))], index: Arc::new(builder.finish()) };
        Ok(Self { building: part.building.clone(), session_map, pairs })
    }

    /// Where in the map a scan of a part was made. The nearest mapped place says so, so that a map that is bent far away
    /// is right here.
    pub fn whereabouts(&self, part: &Part, scan: usize) -> Whereabouts {
        let elsewhere = Whereabouts { is_on_map: Some(false), map_from_robot: None, right_within_m: 0.0 };
        if part.building != self.building {
            return elsewhere;
        }
        let Some(truth) = part.truth[scan] else { return Whereabouts { is_on_map: None, ..elsewhere } };
        let nearest = self.pairs.iter().min_by(|a, b| a.0.distance(&truth).total_cmp(&b.0.distance(&truth)));
        let Some((known, map_pose)) = nearest else { return elsewhere };
        let off_m = known.distance(&truth);
        Whereabouts {
            is_on_map: match off_m {
                near if near < ON_MAP_M => Some(true),
                far if far > 2.0 * ON_MAP_M => Some(false),
                _ => None,
            },
            map_from_robot: Some(map_pose.compose(&known.between(&truth))),
            right_within_m: RIGHT_M + RIGHT_SLOPE * (off_m - ON_MAP_M).max(0.0),
        }
    }
}

/// Where a robot truly is, as far as a map is concerned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Whereabouts {
    /// Whether the map has been there; none where nobody can say.
    pub is_on_map: Option<bool>,
    /// Its true pose in the map's frame; none in another building, or when it is not known. A laser sees farther than its
    /// robot drives, so a robot can be right where the map has not been.
    pub map_from_robot: Option<Pose2>,
    /// A pose within this of it is right, metres: more, the farther the next mapped place is.
    pub right_within_m: f64,
}

impl Whereabouts {
    /// Whether an answer is right.
    pub fn is_right(&self, map_from_robot: &Pose2) -> bool {
        self.map_from_robot.is_some_and(|truth| {
            map_from_robot.distance(&truth) < self.right_within_m
                && angle_between(map_from_robot.theta, truth.theta) < RIGHT_DEG.to_radians()
        })
    }
}

fn translated(part: &Part, config: &EngineConfig) -> Result<(Vec<Observation>, Vec<Keyframe>)> {
    let mut translator = Translator::new(&config.translator, part.geometry.clone())?;
    let (mut observations, mut keyframes) = (Vec::new(), Vec::new());
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
    Ok((observations, keyframes))
}
