//! Recording: runs are made, take batches of scans, end, say where the robot was, and are forgotten.

mod delete;
mod ingest;
mod make;
mod open_runs;
mod part;
mod pieces;
mod trajectory;

pub(in crate::app) use delete::{end_deletions, pending_deletions};
pub use ingest::NewBatch;
pub use make::NewRun;
pub use open_runs::OpenRuns;
pub use part::{FrameOf, observations_in, scans_in};
pub use pieces::{RunPiece, pieces};
pub use trajectory::{Frame, StampedPose, Trajectory, trajectory, trajectory_of};
