//! Plain data of a site, its runs and its jobs, stored by [`super::codec`]; postcard keeps the order of fields.

use locution_engine::geometry::Pose2;
use locution_engine::scan::ScanGeometry;
use serde::{Deserialize, Serialize};

use super::keys::{Generation, MapVersion, RunIdx};

/// `Key::Site`: what the site is and what of it serves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SiteRecord {
    /// The engine's configuration, as JSON so that a later version with more fields can still read it.
    pub config_json: String,
    /// Number of runs, and the index of the next one.
    pub num_runs: RunIdx,
    /// The text generation that serves.
    pub generation: Generation,
    /// The partition of densities of that generation, as JSON, when it is not the configured one.
    pub quantizer_json: Option<String>,
    /// The map version that serves; 0 before the first build.
    pub map_version: MapVersion,
    /// The number of the next job.
    pub next_job: u64,
    /// The number of the next decision.
    pub next_decision: u64,
}

/// `Key::Run`: what a run is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// The client's name for it.
    pub name: String,
    /// The robot, when the client said.
    pub robot: Option<String>,
    /// The laser.
    pub geometry: ScanGeometry,
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
    /// Observations stored.
    pub num_observations: u64,
    /// Words stored, by level.
    pub num_words: Vec<u64>,
    /// Keyframes stored.
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

/// `Key::Scans`: consecutive scans.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScanChunk {
    /// Timestamp and odometry of each scan.
    pub stamps: Vec<(i64, Pose2)>,
    /// Readings of all scans, packed by [`super::packed_ranges`].
    pub packed_ranges: Vec<u8>,
    /// Set on the last chunk of a batch: the first sequence number of that batch and what it was answered.
    pub receipt: Option<(u64, Receipt)>,
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
    /// It did not.
    Failed,
}

/// `Key::Job`: a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JobRecord {
    /// Its number in the site.
    pub id: u64,
    /// What it does.
    pub kind: JobKind,
    /// How far it is.
    pub state: JobState,
    /// How often it was begun.
    pub num_attempts: u32,
    /// What it is at, or what came of it.
    pub detail: String,
    /// Why it failed.
    pub error: Option<String>,
}
