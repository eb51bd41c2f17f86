//! Plain data of a map version; postcard keeps the order of fields.

use bytes::Bytes;
use locution_engine::geometry::Pose2;
use locution_engine::semantics::PlaceLabel;
use serde::{Deserialize, Serialize};

use super::codec;
use super::keys::{MapVersion, RunIdx};
use crate::storage::StorageError;

/// The layout of [`MapRecord`]; 1 had no digests.
const MAP_LAYOUT: u8 = 2;

/// SHA-256 of something; zeros for what was stored before there were digests.
pub type Digest = [u8; 32];

/// `Key::Map`: what a version is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MapRecord {
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
    /// Whether it says where and when the stretches of matches were driven.
    pub has_match_places: bool,
    /// Of everything that the version holds, and so the same as that of another version that holds the same.
    pub content: Digest,
    /// Of everything that the version was made of.
    pub made_of: Digest,
}

/// [`MapRecord`] as it was stored before versions had digests.
#[derive(Serialize, Deserialize)]
struct MapRecord1 {
    version: MapVersion,
    num_components: u32,
    runs: Vec<MapRun>,
    num_matches: u64,
    num_verified: u64,
    duration_s: f64,
}

impl MapRecord {
    /// The stored form.
    pub fn encode(&self) -> Bytes {
        codec::encode_as(MAP_LAYOUT, self)
    }

    /// The record behind its stored form.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`].
    pub fn decode(bytes: &[u8]) -> Result<Self, StorageError> {
        let what = "a map version";
        if codec::version_of(bytes) != Some(1) {
            return codec::decode_as(MAP_LAYOUT, bytes, what);
        }
        let old: MapRecord1 = codec::decode_as(1, bytes, what)?;
        Ok(Self {
            version: old.version,
            num_components: old.num_components,
            runs: old.runs,
            num_matches: old.num_matches,
            num_verified: old.num_verified,
            duration_s: old.duration_s,
            ..Self::default()
        })
    }

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

/// Where and when a stretch of driving that takes part in a match was driven.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StretchPlace {
    /// Timestamps of its first and last observation, nanoseconds.
    pub timestamps_ns: (i64, i64),
    /// The frame of its pose.
    pub component: u32,
    /// Where it was half way.
    pub map_from_middle: Pose2,
}

/// The two stretches of a match.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MatchPlace {
    pub earlier: StretchPlace,
    pub later: StretchPlace,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_version_of_the_first_layout_is_read() {
        let old = MapRecord1 {
            version: 3,
            num_components: 1,
            runs: Vec::new(),
            num_matches: 7,
            num_verified: 5,
            duration_s: 1.5,
        };
        let record = MapRecord::decode(&codec::encode_as(1, &old)).unwrap();
        assert_eq!((record.version, record.num_matches, record.content), (3, 7, [0; 32]));
        assert_eq!(MapRecord::decode(&record.encode()).unwrap(), record);
    }
}
