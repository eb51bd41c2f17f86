//! Plain data of a map version; postcard keeps the order of fields.

use locution_engine::geometry::Pose2;
use locution_engine::semantics::PlaceLabel;
use serde::{Deserialize, Serialize};

use super::keys::{MapVersion, RunIdx};

/// `Key::Map`: what a version is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapRecord {
    /// Its number.
    pub version: MapVersion,
    /// Parts of the map that nothing connects.
    pub num_components: u32,
    /// Runs, in the order of the site.
    pub runs: Vec<MapRun>,
    /// Matches, whatever became of them.
    pub num_matches: u64,
    /// Matches that hold the map together.
    pub num_verified: u64,
    /// Seconds that building took.
    pub duration_s: f64,
}

impl MapRecord {
    /// A run that has poses in the map.
    pub fn run(&self, idx: RunIdx) -> Option<&MapRun> {
        self.runs.iter().find(|run| run.run == idx && run.num_poses > 0)
    }
}

/// A run in a map version.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapRun {
    /// Its number in the site.
    pub run: RunIdx,
    /// Its name.
    pub name: String,
    /// The frame of its poses; runs of one component share it.
    pub component: u32,
    /// Number of its first keyframe among the version's poses.
    pub first_pose: u64,
    /// Number of its keyframes.
    pub num_poses: u64,
    /// Number of its first observation among the version's labels.
    pub first_label: u64,
    /// Number of its observations.
    pub num_labels: u64,
    /// Scans it had when the map was built.
    pub num_scans: u64,
    /// Metres driven, along the optimised keyframes.
    pub length_m: f64,
}

/// The pose of a keyframe in the map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapPose {
    /// Sequence number of its scan.
    pub scan_seq: u64,
    /// Where the robot was.
    pub map_from_robot: Pose2,
}

/// The label of one observation, by its position in `PlaceLabel::ALL`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredLabel {
    /// Position of the label.
    pub label_idx: u8,
    /// Share of what was seen that agrees with it.
    pub confidence: f32,
}

impl From<&(PlaceLabel, f32)> for StoredLabel {
    fn from((label, confidence): &(PlaceLabel, f32)) -> Self {
        Self { label_idx: label.index() as u8, confidence: *confidence }
    }
}
