//! From scans to text: the first lines of SPEC section 2, one pure state machine per run.

use serde::{Deserialize, Serialize};

use crate::config_error::ConfigError;
use crate::density::DensityEstimator;
use crate::geometry::Pose2;
use crate::grid::{Cell, LocalMap};
use crate::registration::{CutReason, OdometryRefiner};
use crate::sampling::{KeyframePose, Place, PlaceSampler};
use crate::scan::{Scan, ScanGeometry};
use crate::text::{Observation, Quantizer, TextBuilder, Word};

mod config;
mod raw_odometry;

pub use config::{OdometrySource, TranslatorConfig};
use raw_odometry::RawOdometry;

/// A place where a run falls in two: nothing tells how what was driven from there on lies to what was driven before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cut {
    /// Sequence number of the first scan behind it.
    pub scan_seq: u64,
    /// What could not be bridged.
    pub reason: CutReason,
}

/// What one scan, or the end of a run, added.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Translation {
    /// Pose of the scan in the run's frame; behind a cut that is another one.
    pub run_from_robot: Pose2,
    /// Set when the scan is the first behind a cut; what was held back of the piece before stands first then.
    pub cut: Option<Cut>,
    /// Set when the scan is a keyframe.
    pub keyframe: Option<KeyframePose>,
    /// New observations, in order of travel.
    pub observations: Vec<Observation>,
    /// New words of all levels, predecessors before successors.
    pub words: Vec<Word>,
}

/// Translates the scans of one run, in the order of their sequence numbers.
///
/// Serialising and deserialising it at any moment does not change what it says afterwards.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "SavedTranslator", into = "SavedTranslator")]
pub struct Translator {
    config: TranslatorConfig,
    next_scan_seq: u64,
    run_from_robot: Pose2,
    local_map: LocalMap,
    density: DensityEstimator,
    places: PlaceSampler,
    geometry: ScanGeometry,
    odometry: Odometry,
    text: TextBuilder,
}

/// What turns odometry into poses and chooses the keyframes.
#[derive(Clone, Debug, Serialize, Deserialize)]
enum Odometry {
    /// As sent.
    Raw(Box<RawOdometry>),
    /// Registered against the recent scans.
    Refined(Box<OdometryRefiner>),
}

impl Odometry {
    fn new(config: &TranslatorConfig) -> Self {
        match config.odometry {
            OdometrySource::Raw => Self::Raw(Box::new(RawOdometry::new(config))),
            OdometrySource::Refined => Self::Refined(Box::new(OdometryRefiner::new(&config.refiner))),
        }
    }

    /// Moves on to the next scan.
    fn pose(&mut self, geometry: &ScanGeometry, scan: &Scan) -> ScanPose {
        match self {
            Self::Raw(odometry) => odometry.pose(scan),
            Self::Refined(refiner) => {
                let refined = refiner.refine(geometry, scan);
                ScanPose {
                    run_from_robot: refined.run_from_robot,
                    keyframe_covariance: refined.keyframe.map(|motion| motion.motion_covariance),
                    cut: refined.cut,
                    is_doubtful: refined.is_doubtful,
                }
            }
        }
    }
}

/// Where a scan was taken.
struct ScanPose {
    run_from_robot: Pose2,
    /// If it is a keyframe, the covariance of the motion since the last.
    keyframe_covariance: Option<[[f64; 3]; 3]>,
    cut: Option<CutReason>,
    /// True when the pose is a guess.
    is_doubtful: bool,
}

impl Translator {
    /// A translator at the start of a run, with the partition that the config begins with.
    ///
    /// # Errors
    /// The first field of the config, or of the geometry, that cannot work.
    pub fn new(config: &TranslatorConfig, geometry: ScanGeometry) -> Result<Self, ConfigError> {
        Self::with_quantizer(config, geometry, config.quantizer.initial())
    }

    /// A translator at the start of a run that writes with a given partition of densities.
    ///
    /// # Errors
    /// The first field of the config, or of the geometry, that cannot work.
    pub fn with_quantizer(
        config: &TranslatorConfig,
        geometry: ScanGeometry,
        quantizer: Quantizer,
    ) -> Result<Self, ConfigError> {
        config.validate("translator")?;
        validate_geometry(&geometry, config.local_map.radius_m)?;
        Ok(Self {
            next_scan_seq: 0,
            run_from_robot: Pose2::identity(),
            local_map: LocalMap::new(&config.local_map, &geometry),
            density: DensityEstimator::new(&config.density, config.local_map.resolution_m),
            places: PlaceSampler::new(&config.sampling),
            odometry: Odometry::new(config),
            text: TextBuilder::new(quantizer, &config.text),
            geometry,
            config: config.clone(),
        })
    }

    /// Reads the next scan of the run.
    pub fn push(&mut self, scan: &Scan) -> Translation {
        let scan_seq = self.next_scan_seq;
        self.next_scan_seq += 1;
        // Pose: odometry as sent, or refined against the recent scans.
        let pose = self.odometry.pose(&self.geometry, scan);
        let cut = pose.cut.map(|reason| Cut { scan_seq, reason });
        let (mut observations, mut words) = if cut.is_some() { self.end_piece() } else { Default::default() };
        self.run_from_robot = pose.run_from_robot;
        let keyframe = pose.keyframe_covariance.map(|motion_covariance| KeyframePose {
            scan_seq,
            timestamp_ns: scan.timestamp_ns,
            odom_from_robot: scan.odom_from_robot,
            run_from_robot: pose.run_from_robot,
            motion_covariance,
        });
        if !pose.is_doubtful {
            // Local map.
            self.local_map.integrate_scan(&scan.ranges_m, &self.run_from_robot);
            // Density and frontiers make an observation, of the places that lie the delay behind.
            self.places.drive(Place {
                scan_seq,
                timestamp_ns: scan.timestamp_ns,
                travel_m: 0.0,
                odom_from_robot: scan.odom_from_robot,
                run_from_robot: self.run_from_robot,
            });
        }
        while let Some(place) = self.places.next_ready() {
            // Observations make regions, regions make words of all levels.
            let observation = self.observe(place);
            words.extend(self.text.push(&observation));
            observations.push(observation);
        }
        Translation { run_from_robot: self.run_from_robot, cut, keyframe, observations, words }
    }

    /// Brings out what was held back, and begins anew.
    fn end_piece(&mut self) -> (Vec<Observation>, Vec<Word>) {
        let (observations, mut words) = self.observe_waiting();
        words.extend(self.text.cut());
        self.places.restart();
        self.local_map = LocalMap::new(&self.config.local_map, &self.geometry);
        (observations, words)
    }

    /// The places still within the delay, as far as they are known, and the words that they complete.
    fn observe_waiting(&mut self) -> (Vec<Observation>, Vec<Word>) {
        let mut observations = Vec::new();
        while let Some(place) = self.places.next_waiting() {
            observations.push(self.observe(place));
        }
        let words = observations.iter().flat_map(|observation| self.text.push(observation)).collect();
        (observations, words)
    }

    /// Ends the run: observes the places still within the delay as far as they are known, and writes the last word.
    pub fn finish(&mut self) -> Translation {
        let (observations, mut words) = self.observe_waiting();
        words.extend(self.text.finish());
        Translation { run_from_robot: self.run_from_robot, cut: None, keyframe: None, observations, words }
    }

    /// The partition that the text is written with.
    pub fn quantizer(&self) -> &Quantizer {
        self.text.quantizer()
    }

    /// Scans read so far; the sequence number of the next one.
    pub fn num_scans(&self) -> u64 {
        self.next_scan_seq
    }

    /// The local map as of the last scan.
    pub fn local_map(&self) -> &LocalMap {
        &self.local_map
    }

    fn observe(&self, place: Place) -> Observation {
        let cell = Cell::containing(&place.run_from_robot.position(), self.config.local_map.resolution_m);
        let density = self.density.estimate(&self.local_map, cell);
        Observation {
            scan_seq: place.scan_seq,
            timestamp_ns: place.timestamp_ns,
            travel_m: place.travel_m,
            odom_from_robot: place.odom_from_robot,
            run_from_robot: place.run_from_robot,
            densities: density.soft,
            is_hard: density.is_hard,
            num_frontiers: density.num_frontiers,
        }
    }
}

/// A laser that the local map can work with.
fn validate_geometry(geometry: &ScanGeometry, radius_m: f64) -> Result<(), ConfigError> {
    let error = |field: &str, problem: &str| Err(ConfigError::new(format!("geometry.{field}"), problem));
    let increment = geometry.angle_increment_rad.abs();
    if geometry.num_ranges == 0 || geometry.num_ranges > 20_000 {
        return error("num_ranges", "must lie in 1..=20000");
    }
    if !geometry.angle_min_rad.is_finite() || geometry.angle_min_rad.abs() > 100.0 {
        return error("angle_min_rad", "must be an angle in radians");
    }
    if !(1e-4..=std::f64::consts::TAU).contains(&increment) {
        return error("angle_increment_rad", "must be at least 0.0001 and at most a turn, in radians");
    }
    if increment * (geometry.num_ranges - 1) as f64 > std::f64::consts::TAU + 1e-3 {
        return error("angle_increment_rad", "times the number of ranges must not exceed a turn");
    }
    if !(geometry.range_max_m > 0.0 && geometry.range_max_m.is_finite()) {
        return error("range_max_m", "must be positive, in metres");
    }
    let mount = &geometry.robot_from_laser;
    if !mount.is_finite() || mount.x.hypot(mount.y) > radius_m / 4.0 {
        return error("robot_from_laser", "must be finite and within a quarter of the local map's radius");
    }
    Ok(())
}

/// A translator as it is stored: what cannot be computed from the config.
#[derive(Clone, Serialize, Deserialize)]
struct SavedTranslator {
    config: TranslatorConfig,
    next_scan_seq: u64,
    run_from_robot: Pose2,
    local_map: LocalMap,
    places: PlaceSampler,
    geometry: ScanGeometry,
    odometry: Odometry,
    text: TextBuilder,
}

impl From<Translator> for SavedTranslator {
    fn from(translator: Translator) -> Self {
        let Translator {
            config,
            next_scan_seq,
            run_from_robot,
            local_map,
            density: _,
            places,
            geometry,
            odometry,
            text,
        } = translator;
        Self { config, next_scan_seq, run_from_robot, local_map, places, geometry, odometry, text }
    }
}

impl TryFrom<SavedTranslator> for Translator {
    type Error = ConfigError;

    fn try_from(saved: SavedTranslator) -> Result<Self, ConfigError> {
        let SavedTranslator {
            config,
            next_scan_seq,
            run_from_robot,
            local_map,
            places,
            geometry,
            odometry,
            text,
        } = saved;
        config.validate("translator")?;
        let density = DensityEstimator::new(&config.density, config.local_map.resolution_m);
        Ok(Self {
            config,
            next_scan_seq,
            run_from_robot,
            local_map,
            density,
            places,
            geometry,
            odometry,
            text,
        })
    }
}
