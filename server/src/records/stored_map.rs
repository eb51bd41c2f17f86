//! Plain data of a map version; postcard keeps the order of fields.

use bytes::Bytes;
use locution_engine::geometry::Pose2;
use locution_engine::semantics::PlaceLabel;
use serde::{Deserialize, Serialize};

use super::codec;
use super::keys::{MapVersion, RunIdx};
use crate::storage::StorageError;

/// The layout of [`MapRecord`]; 1 had no digests, 2 no runs in pieces.
const MAP_LAYOUT: u8 = 3;

/// SHA-256 of something; zeros for what was stored before there were digests.
pub type Digest = [u8; 32];

/// `Key::Map`: what a version is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MapRecord {
    pub version: MapVersion,
    /// Parts of the map that nothing connects.
    pub num_components: u32,
    /// Runs, in the order of the site; one that was cut is several, piece after piece.
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
    runs: Vec<MapRun2>,
    num_matches: u64,
    num_verified: u64,
    duration_s: f64,
}

/// [`MapRecord`] as it was stored before runs could be in pieces.
#[derive(Serialize, Deserialize)]
struct MapRecord2 {
    version: MapVersion,
    num_components: u32,
    runs: Vec<MapRun2>,
    num_matches: u64,
    num_verified: u64,
    duration_s: f64,
    has_match_places: bool,
    content: Digest,
    made_of: Digest,
}

/// [`MapRun`] of a run that was whole.
#[derive(Serialize, Deserialize)]
struct MapRun2 {
    run: RunIdx,
    name: String,
    component: u32,
    first_pose: u64,
    num_poses: u64,
    first_label: u64,
    num_labels: u64,
    num_scans: u64,
    length_m: f64,
}

impl From<MapRun2> for MapRun {
    fn from(old: MapRun2) -> Self {
        Self {
            run: old.run,
            name: old.name,
            component: old.component,
            first_pose: old.first_pose,
            num_poses: old.num_poses,
            first_label: old.first_label,
            num_labels: old.num_labels,
            num_scans: old.num_scans,
            length_m: old.length_m,
            first_scan: 0,
            first_observation: 0,
            first_keyframe: 0,
        }
    }
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
        let old = match codec::version_of(bytes) {
            Some(1) => {
                let MapRecord1 { version, num_components, runs, num_matches, num_verified, duration_s } =
                    codec::decode_as(1, bytes, what)?;
                MapRecord2 {
                    version,
                    num_components,
                    runs,
                    num_matches,
                    num_verified,
                    duration_s,
                    has_match_places: false,
                    content: Digest::default(),
                    made_of: Digest::default(),
                }
            }
            Some(2) => codec::decode_as(2, bytes, what)?,
            _ => return codec::decode_as(MAP_LAYOUT, bytes, what),
        };
        Ok(Self {
            version: old.version,
            num_components: old.num_components,
            runs: old.runs.into_iter().map(MapRun::from).collect(),
            num_matches: old.num_matches,
            num_verified: old.num_verified,
            duration_s: old.duration_s,
            has_match_places: old.has_match_places,
            content: old.content,
            made_of: old.made_of,
        })
    }

    /// The pieces of a run that have poses in the map, in order; the run itself when it was not cut.
    pub fn pieces_of(&self, run: RunIdx) -> impl Iterator<Item = &MapRun> {
        self.runs.iter().filter(move |piece| piece.run == run && piece.num_poses > 0)
    }

    /// The name of a run; empty when the version does not know it.
    pub fn name_of(&self, run: RunIdx) -> String {
        self.runs.iter().find(|piece| piece.run == run).map(|piece| piece.name.clone()).unwrap_or_default()
    }
}

/// A run in a map version, or a piece of one that was cut.
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
    /// Sequence number of its first scan.
    pub first_scan: u64,
    /// Number of its first observation among those of the run.
    pub first_observation: u64,
    /// Number of its first keyframe among those of the run.
    pub first_keyframe: u64,
}

impl MapRun {
    /// The sequence numbers of its scans.
    pub const fn scans(&self) -> std::ops::Range<u64> {
        self.first_scan..self.first_scan + self.num_scans
    }

    /// The numbers of its keyframes that are in the map, among those of the run.
    pub const fn keyframes(&self) -> std::ops::Range<u64> {
        self.first_keyframe..self.first_keyframe + self.num_poses
    }
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

    fn old_run() -> MapRun2 {
        MapRun2 {
            run: 4,
            name: "r4".into(),
            component: 2,
            first_pose: 10,
            num_poses: 7,
            first_label: 20,
            num_labels: 30,
            num_scans: 50,
            length_m: 1.5,
        }
    }

    #[test]
    fn a_version_of_the_second_layout_is_read() {
        let old = MapRecord2 {
            version: 3,
            num_components: 1,
            runs: vec![old_run()],
            num_matches: 7,
            num_verified: 5,
            duration_s: 1.5,
            has_match_places: true,
            content: [1; 32],
            made_of: [2; 32],
        };
        let record = MapRecord::decode(&codec::encode_as(2, &old)).unwrap();
        assert_eq!((record.has_match_places, record.content, record.made_of), (true, [1; 32], [2; 32]));
        let run = &record.runs[0];
        assert_eq!((run.scans(), run.keyframes(), run.first_observation), (0..50, 0..7, 0));
        assert_eq!((run.name.as_str(), run.component, run.first_label, run.num_labels), ("r4", 2, 20, 30));
        assert_eq!(MapRecord::decode(&record.encode()).unwrap(), record);
    }

    #[test]
    fn a_version_of_the_first_layout_is_read() {
        let old = MapRecord1 {
            version: 3,
            num_components: 1,
            runs: vec![old_run()],
            num_matches: 7,
            num_verified: 5,
            duration_s: 1.5,
        };
        let record = MapRecord::decode(&codec::encode_as(1, &old)).unwrap();
        assert_eq!((record.version, record.num_matches, record.content), (3, 7, [0; 32]));
        assert_eq!(MapRecord::decode(&record.encode()).unwrap(), record);
    }
}
