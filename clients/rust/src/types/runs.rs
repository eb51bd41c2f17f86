//! Runs and their scans.

use serde::{Deserialize, Serialize};

use super::values::Pose;

/// What all scans of a run share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Geometry {
    /// Readings per scan, at most the server's limit.
    pub num_ranges: usize,
    /// Fewest readings of a scan, of a laser whose number varies; those missing at the end say nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub num_ranges_min: Option<usize>,
    /// Direction of the first beam in the laser's frame.
    pub angle_min_rad: f64,
    /// From one beam to the next; negative when the sweep runs clockwise.
    pub angle_increment_rad: f64,
    /// A reading at or above this means "no return".
    pub range_max_m: f64,
    /// A reading below this means "too near to tell" and says nothing.
    #[serde(default)]
    pub range_min_m: f64,
    /// Where the laser sits on the robot; at its centre looking ahead unless said.
    #[serde(default)]
    pub robot_from_laser: Pose,
}

/// Whether a run takes more scans.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunState {
    /// It does.
    Open,
    /// It does not.
    Finished,
}

/// Why a piece of a run does not go on from the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CutReason {
    /// Odometry stepped farther than a robot can, and the scans do not fit what was seen before.
    Jump,
    /// Nothing was recorded for a while, and what was seen then does not fit what was seen before.
    Gap,
    /// The laser saw nothing for a while, and what it saw then does not fit what it saw before.
    NoReturns,
    /// By its odometry the robot hardly moved, but it saw through what had been there: it was carried.
    Carried,
    /// There is no odometry to be believed, and the scans changed faster than they could be followed.
    Unfollowed,
}

/// A piece of a run: nothing tells how it lies to the piece before but the map, if that joined them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunPiece {
    /// Sequence number of its first scan.
    pub from_scan: u64,
    /// Sequence number of its last scan.
    pub to_scan: u64,
    /// Why it does not go on from the piece before; none of the first.
    pub reason: Option<CutReason>,
    /// The component of the map that it lies in; none when it is in no map.
    pub component: Option<u32>,
    /// Metres driven in the map; none when it is in no map.
    pub length_m: Option<f64>,
}

/// A run and how far it has come.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Its name.
    pub run: String,
    /// The robot.
    pub robot: Option<String>,
    /// Where it belongs, when somebody said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub area: Option<String>,
    /// The laser.
    pub geometry: Geometry,
    /// Whether it takes more scans.
    pub state: RunState,
    /// The sequence number to send next.
    pub next_sequence: u64,
    /// Scans stored.
    pub num_scans: u64,
    /// Observations so far.
    pub num_observations: u64,
    /// Words of all levels so far.
    pub num_words: u64,
}

/// The answer to an accepted batch, also when it is repeated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Receipt {
    /// The sequence number to send next.
    pub next_sequence: u64,
    /// Observations of the run after this batch.
    pub num_observations: u64,
    /// Words of all levels of the run after this batch.
    pub num_words: u64,
}

/// A stored scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredScan {
    /// Sequence number.
    pub scan_seq: u64,
    /// As sent.
    pub timestamp_ns: i64,
    /// As sent; all zero for a robot without odometry.
    pub odom_from_robot: Pose,
    /// As sent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angular_velocity_rad_per_s: Option<f64>,
    /// As sent; readings without a return are null, those too near or missing at the end are 0.
    #[serde(with = "ranges")]
    pub ranges_m: Vec<f32>,
}

/// One sweep of the laser with the odometry at its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// As the robot's clock said, nanoseconds.
    pub timestamp_ns: i64,
    /// Raw odometry of the robot; a robot without odometry has none in all scans of a run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub odom_from_robot: Option<Pose>,
    /// How fast the robot turned then by a gyroscope, counter-clockwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angular_velocity_rad_per_s: Option<f64>,
    /// Readings in metres; minus infinity is "too near"; what is not finite is "no return".
    #[serde(with = "ranges")]
    pub ranges_m: Vec<f32>,
}

/// What a run is made with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NewRun {
    /// Name of the robot.
    pub robot: Option<String>,
    /// Its laser.
    pub geometry: Geometry,
    /// Where the run belongs, for instance a floor: it is never joined to runs of another area.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub area: Option<String>,
}

/// JSON has neither NaN nor infinity: "no return" is `null` there, and infinity here; "too near" is 0 there.
mod ranges {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(ranges_m: &[f32], serializer: S) -> Result<S::Ok, S::Error> {
        if !serializer.is_human_readable() {
            return ranges_m.serialize(serializer);
        }
        let reading = |&range_m: &f32| match range_m {
            // Zero says nothing, as does a reading that was too near.
            f32::NEG_INFINITY => Some(0.0),
            range_m => range_m.is_finite().then_some(range_m),
        };
        serializer.collect_seq(ranges_m.iter().map(reading))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f32>, D::Error> {
        let ranges_m = Vec::<Option<f32>>::deserialize(deserializer)?;
        Ok(ranges_m.into_iter().map(|range_m| range_m.unwrap_or(f32::INFINITY)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_return_is_null_in_json_and_infinite_in_cbor() {
        let ranges_m = vec![1.25, f32::INFINITY, 81.83];
        let scan =
            Scan { timestamp_ns: 5, odom_from_robot: None, angular_velocity_rad_per_s: None, ranges_m };
        let json = serde_json::to_string(&scan).unwrap();
        assert!(json.ends_with(r#""ranges_m":[1.25,null,81.83]}"#), "{json}");
        assert_eq!(serde_json::from_str::<Scan>(&json).unwrap(), scan);
        let mut bytes = Vec::new();
        ciborium::into_writer(&scan, &mut bytes).unwrap();
        let value: ciborium::Value = ciborium::from_reader(bytes.as_slice()).unwrap();
        let ranges = value.as_map().unwrap()[1].1.as_array().unwrap();
        assert_eq!(ranges[1].as_float(), Some(f64::INFINITY));
    }
}
