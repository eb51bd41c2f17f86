//! Learned place labels: labelled drives, training, and what the labels are worth in a building left out.

mod boosting;
mod drives;
mod plan_labels;
mod trials;

pub use boosting::{BoostingConfig, Examples, boost};
pub use drives::{Drive, Sources};
pub use plan_labels::PlanLabels;
pub use trials::{BuildingTrial, Learned, TrainingConfig, leave_buildings_out, pooled, read_numbers, train};
