//! Recording: runs are made, take batches of scans, end, and say where the robot was.

mod ingest;
mod make;
mod open_runs;
mod trajectory;

pub use ingest::NewBatch;
pub use make::NewRun;
pub use open_runs::OpenRuns;
pub use trajectory::{Frame, StampedPose, Trajectory, trajectory};
