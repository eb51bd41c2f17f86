//! What the evaluation reports measure (SPEC section 9), as pure functions.
//!
//! ```text
//! truth at key frames ─► truth_join ─► a true pose per observation ─► Revisits ─┐
//! matches ─► claims: pairs of observations said to be one place ────────────────┴► precision, recall, curve
//! ```
//! Beside it: map error against hand-verified relations, trajectory error against the truth, label confusion and the
//! outcome of localisations and of questions by example. Nothing here knows how the answers were made.

mod examples;
mod labels;
mod localization;
mod map_error;
mod open_world;
mod recognition;
mod revisits;
mod spoiled_graphs;
mod summary;
mod trajectory_error;
mod truth_join;

pub use examples::{ExampleReport, ExampleTrial, LatencyMs, ReliabilityBin, judge_examples};
pub use labels::{LabelReport, LabelScore, LabeledObservation, judge_labels};
pub use localization::{
    LocalizationReport, LocalizationTrial, MetersToConverge, TrialOutcome, judge_localization,
};
pub use map_error::{EstimatedPose, MapErrorReport, judge_map};
pub use open_world::{OpenWorldReport, OpenWorldStep, OpenWorldTrial, judge_open_world};
pub use recognition::{
    CurvePoint, JudgedMatch, RecallAtPrecision, RecognitionReport, RevisitCounts, VerifiedReport,
    judge_recognition,
};
pub use revisits::{JudgedRun, Revisits, Visit, find_revisits};
pub use spoiled_graphs::{Generator, OutlierDraw, rms_error_m, spoil};
pub use summary::MeanSd;
pub use trajectory_error::{TrajectoryError, judge_trajectory};
pub use truth_join::{OdometryPose, join_truth};
