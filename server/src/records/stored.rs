//! Plain data of a site, its runs and its jobs, stored by [`super::codec`]; postcard keeps the order of fields.

use bytes::Bytes;
use locution_engine::geometry::Pose2;
use locution_engine::scan::ScanGeometry;
use serde::{Deserialize, Serialize};

use super::codec;
use super::keys::{Generation, MapVersion, RunIdx};
use crate::storage::StorageError;

/// The layout of [`SiteRecord`]; 1 had no birth, 2 nothing of deleted runs and retention.
const SITE_LAYOUT: u8 = 3;

/// `Key::Site`: what the site is and what of it serves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SiteRecord {
    /// The engine's configuration, as JSON so that a later version with more fields can still read it.
    pub config_json: String,
    /// Number of runs, deleted ones among them, and the index of the next one.
    pub num_runs: RunIdx,
    /// The text generation that serves.
    pub generation: Generation,
    /// The partition of densities of that generation, as JSON, when it is not the configured one.
    pub quantizer_json: Option<String>,
    /// The map version that serves; 0 before the first build.
    pub map_version: MapVersion,
    /// The number of the next job.
    pub next_job: u64,
    /// The number of the next thing that a person says: a decision, or an annotation that is made, changed or deleted.
    pub next_decision: u64,
    /// Drawn at random when the site was made: a site that is deleted and made again under the same name is another
    /// one, and nothing that was kept of the first may be served for the second.
    pub birth: u64,
    /// Number of runs that were deleted.
    pub num_deleted_runs: u32,
    /// How much of it is kept.
    pub retention: Retention,
}

/// How much of a site is kept; what is not said is kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Retention {
    /// Map versions, the serving one included; as the server is configured unless said.
    pub num_versions: Option<u32>,
    /// Runs: finished ones beyond are deleted, the oldest first.
    pub num_runs: Option<u32>,
    /// Scans of all runs together: finished runs are deleted, the oldest first, until no more are left.
    pub num_scans: Option<u64>,
}

/// [`SiteRecord`] as sites stored it before runs could be deleted.
#[derive(Serialize, Deserialize)]
struct SiteRecord2 {
    config_json: String,
    num_runs: RunIdx,
    generation: Generation,
    quantizer_json: Option<String>,
    map_version: MapVersion,
    next_job: u64,
    next_decision: u64,
    birth: u64,
}

/// [`SiteRecord`] as sites stored it before they had a birth.
#[derive(Serialize, Deserialize)]
struct SiteRecord1 {
    config_json: String,
    num_runs: RunIdx,
    generation: Generation,
    quantizer_json: Option<String>,
    map_version: MapVersion,
    next_job: u64,
    next_decision: u64,
}

impl SiteRecord2 {
    fn of_first(old: SiteRecord1, birth: u64) -> Self {
        Self {
            config_json: old.config_json,
            num_runs: old.num_runs,
            generation: old.generation,
            quantizer_json: old.quantizer_json,
            map_version: old.map_version,
            next_job: old.next_job,
            next_decision: old.next_decision,
            birth,
        }
    }
}

impl SiteRecord {
    /// The stored form.
    pub fn encode(&self) -> Bytes {
        codec::encode_as(SITE_LAYOUT, self)
    }

    /// The record behind its stored form; a site of the first layout, which has no birth yet, is given one.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`].
    pub fn decode(bytes: &[u8], birth_if_none: u64) -> Result<Self, StorageError> {
        let what = "the record of the site";
        let old = match codec::version_of(bytes) {
            Some(1) => SiteRecord2::of_first(codec::decode_as(1, bytes, what)?, birth_if_none),
            Some(2) => codec::decode_as(2, bytes, what)?,
            _ => return codec::decode_as(SITE_LAYOUT, bytes, what),
        };
        Ok(Self {
            config_json: old.config_json,
            num_runs: old.num_runs,
            generation: old.generation,
            quantizer_json: old.quantizer_json,
            map_version: old.map_version,
            next_job: old.next_job,
            next_decision: old.next_decision,
            birth: old.birth,
            num_deleted_runs: 0,
            retention: Retention::default(),
        })
    }

    /// Whether a stored form has no birth and should be written again, so that the one just given stays.
    pub fn is_outdated(bytes: &[u8]) -> bool {
        codec::version_of(bytes) == Some(1)
    }
}

/// The layout of [`RunRecord`]; 1 said nothing of the readings, 2 nothing of the area.
const RUN_LAYOUT: u8 = 3;

/// `Key::Run`: what a run is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// The client's name for it.
    pub name: String,
    /// The robot, when the client said.
    pub robot: Option<String>,
    pub geometry: ScanGeometry,
    pub readings: ReadingRules,
    /// Where the run belongs, when the client said.
    pub area: Option<String>,
}

/// What the client said of the readings that the laser sends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReadingRules {
    /// What is nearer is no reading, metres.
    pub range_min_m: f64,
    /// Fewest readings of a scan; those missing at the end say nothing.
    pub num_ranges_min: usize,
}

impl ReadingRules {
    /// All readings of this laser are there and to be believed.
    pub const fn of(geometry: &ScanGeometry) -> Self {
        Self { range_min_m: 0.0, num_ranges_min: geometry.num_ranges }
    }
}

/// [`RunRecord`] as runs stored it first.
#[derive(Serialize, Deserialize)]
struct RunRecord1 {
    name: String,
    robot: Option<String>,
    geometry: ScanGeometry,
}

/// [`RunRecord`] before runs had an area.
#[derive(Serialize, Deserialize)]
struct RunRecord2 {
    name: String,
    robot: Option<String>,
    geometry: ScanGeometry,
    readings: ReadingRules,
}

impl RunRecord {
    /// The stored form.
    pub fn encode(&self) -> Bytes {
        codec::encode_as(RUN_LAYOUT, self)
    }

    /// The record behind its stored form, of any layout.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`].
    pub fn decode(bytes: &[u8]) -> Result<Self, StorageError> {
        let old = match codec::version_of(bytes) {
            Some(1) => {
                let RunRecord1 { name, robot, geometry } = codec::decode_as(1, bytes, "a run")?;
                RunRecord2 { name, robot, readings: ReadingRules::of(&geometry), geometry }
            }
            Some(2) => codec::decode_as(2, bytes, "a run")?,
            _ => return codec::decode_as(RUN_LAYOUT, bytes, "a run"),
        };
        let RunRecord2 { name, robot, geometry, readings } = old;
        Ok(Self { name, robot, geometry, readings, area: None })
    }

    /// What stands in the place of a run that was deleted: numbers of runs are never used again. No run has such a name.
    pub fn deleted() -> Self {
        let geometry = ScanGeometry {
            num_ranges: 1,
            angle_min_rad: 0.0,
            angle_increment_rad: 0.0,
            range_max_m: 1.0,
            robot_from_laser: Pose2::identity(),
        };
        Self { name: String::new(), robot: None, readings: ReadingRules::of(&geometry), geometry, area: None }
    }

    /// Whether the run was deleted.
    pub fn is_deleted(&self) -> bool {
        self.name.is_empty()
    }
}

/// `Key::RunHead`: how far the recording has come.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RunHead {
    /// Number of scans, and the sequence number of the next one.
    pub next_sequence: u64,
    /// Whether the run takes no more scans.
    pub is_finished: bool,
    /// Odometry of the last scan.
    pub last_odom_from_robot: Option<Pose2>,
}

/// `Key::TextHead`: how far the text of a run has come.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TextHead {
    /// Scans translated so far.
    pub num_scans: u64,
    /// Whether the pending tail was flushed because the run is finished.
    pub is_finished: bool,
    pub num_observations: u64,
    /// Words stored, by level.
    pub num_words: Vec<u64>,
    pub num_keyframes: u64,
    /// Scans that the stored translator had seen; 0: none is stored.
    pub checkpoint_scans: u64,
    /// Parts of the stored translator.
    pub num_checkpoint_parts: u32,
}

impl TextHead {
    /// Words of all levels.
    pub fn num_words_all_levels(&self) -> u64 {
        self.num_words.iter().sum()
    }
}

/// The layout of [`ScanChunk`] when some scan tells an angular velocity; those without are written as layout 1, which
/// ends before it.
const TURNING_SCANS_LAYOUT: u8 = 2;

/// `Key::Scans`: consecutive scans.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ScanChunk {
    /// Timestamp and odometry of each scan.
    pub stamps: Vec<(i64, Pose2)>,
    /// Readings of all scans, packed by [`super::packed_ranges`].
    pub packed_ranges: Vec<u8>,
    /// Set on the last chunk of a batch: the first sequence number of that batch and what it was answered.
    pub receipt: Option<(u64, Receipt)>,
    /// How fast the robot turned at each scan by its own gyroscope; empty when no scan tells.
    #[serde(skip)]
    pub angular_velocities_rad_per_s: Vec<Option<f64>>,
}

impl ScanChunk {
    /// The stored form.
    pub fn encode(&self) -> Bytes {
        let velocities = &self.angular_velocities_rad_per_s;
        if velocities.iter().all(Option::is_none) {
            return codec::encode(self);
        }
        codec::encode_as(TURNING_SCANS_LAYOUT, &(self, velocities))
    }

    /// The chunk behind its stored form, of either layout.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`].
    pub fn decode(bytes: &[u8]) -> Result<Self, StorageError> {
        let what = "a chunk of scans";
        if codec::version_of(bytes) != Some(TURNING_SCANS_LAYOUT) {
            return codec::decode(bytes, what);
        }
        let (chunk, angular_velocities_rad_per_s) = codec::decode_as(TURNING_SCANS_LAYOUT, bytes, what)?;
        Ok(Self { angular_velocities_rad_per_s, ..chunk })
    }
}

/// What an accepted batch is answered, then and whenever it is repeated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Receipt {
    /// The sequence number to send next.
    pub next_sequence: u64,
    /// Observations of the run after this batch.
    pub num_observations: u64,
    /// Words of all levels of the run after this batch.
    pub num_words: u64,
}

/// `Key::Keyframes`: a keyframe without its readings, which stand with the scans.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredKeyframe {
    /// Sequence number of its scan.
    pub scan_seq: u64,
    /// Pose in the run's frame.
    pub run_from_robot: Pose2,
    /// Covariance of the motion since the keyframe before, row by row.
    pub motion_covariance: [[f64; 3]; 3],
}

/// What a job does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum JobKind {
    /// Builds the map of everything stored, after writing the texts anew when their partition is outdated.
    Build,
}

/// How far a job is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum JobState {
    /// It waits for its turn.
    Queued,
    /// It is at work.
    Running,
    /// It did what it should.
    Done,
    Failed,
    /// Somebody ended it before it was done.
    Cancelled,
}

/// `Key::Job`: a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JobRecord {
    /// Its number in the site.
    pub id: u64,
    pub kind: JobKind,
    /// How far it is.
    pub state: JobState,
    /// How often it was begun.
    pub num_attempts: u32,
    /// What it is at, or what came of it.
    pub detail: String,
    pub error: Option<String>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_of_the_first_layout_is_read_and_believes_all_its_readings() {
        let geometry = ScanGeometry {
            num_ranges: 3,
            angle_min_rad: -1.0,
            angle_increment_rad: 1.0,
            range_max_m: 10.0,
            robot_from_laser: Pose2::identity(),
        };
        let old = RunRecord1 { name: "r".into(), robot: Some("porter".into()), geometry };
        let record = RunRecord::decode(&codec::encode(&old)).unwrap();
        assert_eq!(record.readings, ReadingRules { range_min_m: 0.0, num_ranges_min: 3 });
        assert_eq!(RunRecord::decode(&record.encode()).unwrap(), record);
    }

    #[test]
    fn chunks_keep_angular_velocities_and_those_without_keep_their_layout() {
        let chunk = ScanChunk { stamps: vec![(1, Pose2::identity()); 2], ..ScanChunk::default() };
        assert_eq!(codec::version_of(&chunk.encode()), Some(1));
        assert_eq!(ScanChunk::decode(&chunk.encode()).unwrap(), chunk);
        let turning = ScanChunk { angular_velocities_rad_per_s: vec![Some(0.25), None], ..chunk };
        assert_eq!(ScanChunk::decode(&turning.encode()).unwrap(), turning);
    }

    #[test]
    fn a_site_of_the_first_layout_is_read_and_given_a_birth() {
        let old = SiteRecord1 {
            config_json: "{}".into(),
            num_runs: 3,
            generation: 1,
            quantizer_json: None,
            map_version: 2,
            next_job: 5,
            next_decision: 7,
        };
        let bytes = codec::encode_as(1, &old);
        assert!(SiteRecord::is_outdated(&bytes));
        let record = SiteRecord::decode(&bytes, 42).unwrap();
        assert_eq!((record.num_runs, record.map_version, record.birth), (3, 2, 42));
        let again = record.encode();
        assert!(!SiteRecord::is_outdated(&again));
        assert_eq!(SiteRecord::decode(&again, 43).unwrap(), record);
    }

    #[test]
    fn a_site_from_before_runs_could_be_deleted_is_read() {
        let old = SiteRecord2 {
            config_json: "{}".into(),
            num_runs: 3,
            generation: 1,
            quantizer_json: None,
            map_version: 2,
            next_job: 5,
            next_decision: 7,
            birth: 9,
        };
        let record = SiteRecord::decode(&codec::encode_as(2, &old), 42).unwrap();
        assert_eq!((record.num_runs, record.birth, record.num_deleted_runs), (3, 9, 0));
        assert_eq!(record.retention, Retention::default());
    }
}
