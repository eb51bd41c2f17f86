//! Bodies of requests and answers, as the API writes them.
//!
//! Answers may grow new fields; what is not known here is passed over.

use serde::{Deserialize, Serialize, Serializer};

/// A pose in metres and radians.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
    /// Radians, counter-clockwise.
    pub theta: f64,
}

/// What all scans of a run share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Geometry {
    /// Readings per scan.
    pub num_ranges: usize,
    /// Direction of the first beam in the laser's frame.
    pub angle_min_rad: f64,
    /// From one beam to the next.
    pub angle_increment_rad: f64,
    /// Readings at or above this are "no return".
    pub range_max_m: f64,
    /// Where the laser sits on the robot.
    pub robot_from_laser: Pose,
}

/// One sweep of the laser with the odometry at its time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scan {
    /// The robot's clock.
    pub timestamp_ns: i64,
    /// Raw odometry.
    pub odom_from_robot: Pose,
    /// Readings in metres; what is not finite is "no return".
    #[serde(serialize_with = "ranges")]
    pub ranges_m: Vec<f32>,
}

/// JSON has neither NaN nor infinity: "no return" is `null` there.
fn ranges<S: Serializer>(ranges_m: &[f32], serializer: S) -> Result<S::Ok, S::Error> {
    if !serializer.is_human_readable() {
        return ranges_m.serialize(serializer);
    }
    serializer.collect_seq(ranges_m.iter().map(|&range_m| range_m.is_finite().then_some(range_m)))
}

/// What a run is created with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NewRun {
    /// Name of the robot.
    pub robot: String,
    /// Its laser.
    pub geometry: Geometry,
}

/// A site as it stands.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct SiteStatus {
    /// Its name.
    pub site: String,
    /// The configuration in force.
    pub config: serde_json::Value,
    /// Runs, open and finished.
    pub num_runs: u64,
    /// Scans of all runs.
    pub num_scans: u64,
    /// Observations of all runs.
    pub num_observations: u64,
    /// Words of all runs, all levels.
    pub num_words: u64,
    /// What the site takes up on disk.
    pub bytes_on_disk: u64,
}

/// A run as it stands.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct RunStatus {
    /// Its name.
    pub run: String,
    /// The robot that recorded it.
    pub robot: Option<String>,
    /// `open` or `finished`.
    pub state: String,
    /// Sequence number that the next scan must have.
    pub next_sequence: u64,
    /// Scans stored.
    pub num_scans: u64,
    /// Density samples.
    pub num_observations: u64,
    /// Words of all levels.
    pub num_words: u64,
}

/// Answer to a batch: it is on disk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(default)]
pub struct BatchAnswer {
    /// Sequence number that the next scan must have.
    pub next_sequence: u64,
    /// Observations of the run so far.
    pub num_observations: u64,
    /// Words of the run so far.
    pub num_words: u64,
}

/// One density sample.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Observation {
    /// Its number within the run.
    pub observation: u64,
    /// The scan it was taken at.
    pub scan_seq: u64,
    /// Timestamp of that scan.
    pub timestamp_ns: i64,
    /// Metres driven since the run began.
    pub travel_m: f64,
    /// Raw odometry.
    pub odom_from_robot: Pose,
    /// Pose in the run's own frame.
    pub run_from_robot: Pose,
    /// Soft density of each kernel.
    #[serde(default)]
    pub densities: Vec<f32>,
}

/// Names a word within its run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct WordId {
    /// 0: as observed; higher: fused from several.
    pub level: u8,
    /// Position within its level.
    pub index: u32,
}

/// A word of a run's text.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Word {
    /// Its name.
    pub id: WordId,
    /// Density class.
    pub class: u8,
    /// Number of observations.
    pub size: u32,
    /// Turn from its first to its last observation.
    pub turn_rad: f32,
    /// First and last observation, both inclusive.
    pub observations: (u32, u32),
    /// Words that may stand before it.
    #[serde(default)]
    pub predecessors: Vec<WordId>,
}

/// A stretch of driving.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MatchInterval {
    /// Name of the run.
    pub run: String,
    /// First observation, inclusive.
    pub first: u64,
    /// Last observation, inclusive.
    pub last: u64,
}

/// The claim that two stretches of driving went through one place.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct PlaceMatch {
    /// Its name within the site.
    pub id: String,
    /// The stretch that was driven first.
    pub earlier: MatchInterval,
    /// The stretch that revisits it.
    pub later: MatchInterval,
    /// `same` or `opposite`.
    pub direction: String,
    /// What found it: `words`, `profile` or `spatial`.
    pub channel: String,
    /// What speaks for and against it.
    #[serde(default)]
    pub evidence: serde_json::Value,
    /// Probability that it is right.
    pub probability: f64,
    /// `candidate`, `verified` or `rejected`.
    pub state: String,
    /// Why it was rejected.
    #[serde(default)]
    pub reason: Option<String>,
}

/// A stretch of driving through places of one label.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct LabeledStretch {
    /// The run that drove it.
    pub run: String,
    /// `corridor`, `corner`, `bifurcation`, `dead-end` or `hall`.
    pub label: String,
    /// First observation, inclusive.
    pub first: u64,
    /// Last observation, inclusive.
    pub last: u64,
    /// Share of what was seen that agrees with the label.
    pub confidence: f64,
}

/// A pose at the time of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct StampedPose {
    /// The scan.
    pub scan_seq: u64,
    /// Its timestamp.
    pub timestamp_ns: i64,
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
    /// Radians.
    pub theta: f64,
}

/// Poses of all scans of a run in one frame.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Trajectory {
    /// Connected part of the map that the run belongs to; `None` for frames of the run's own.
    #[serde(default)]
    pub component: Option<u64>,
    /// One pose per scan.
    pub poses: Vec<StampedPose>,
}

/// A long piece of work.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct Job {
    /// Its name within the site.
    pub id: serde_json::Value,
    /// What it does.
    pub kind: String,
    /// `queued`, `running`, `done` or `failed`.
    pub state: String,
    /// 0 to 1.
    pub progress: f64,
    /// What it is at, or what came of it.
    pub detail: Option<String>,
    /// Why it failed.
    pub error: Option<String>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_return_is_null_in_json_and_infinite_in_cbor() {
        let ranges_m = vec![1.25, f32::INFINITY, 81.83];
        let scan = Scan { timestamp_ns: 5, odom_from_robot: Pose::default(), ranges_m };
        let json = serde_json::to_string(&scan).unwrap();
        assert!(json.ends_with(r#""ranges_m":[1.25,null,81.83]}"#), "{json}");
        let mut bytes = Vec::new();
        ciborium::into_writer(&scan, &mut bytes).unwrap();
        let value: ciborium::Value = ciborium::from_reader(bytes.as_slice()).unwrap();
        let ranges = value.as_map().unwrap()[2].1.as_array().unwrap();
        assert_eq!(ranges[1].as_float(), Some(f64::INFINITY));
    }
}
