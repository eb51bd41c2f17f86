//! Place labels: corridor, corner, bifurcation, dead-end, hall (thesis chapter 6).

mod block;
mod config;
mod decision_tree;
mod flood;
mod label;
mod label_map;
mod rules;
mod segmentation;
mod signature;

pub use config::SemanticsConfig;
pub use decision_tree::{DecisionTreeConfig, label_by_tree};
pub use label::PlaceLabel;
pub use label_map::{DrivenRun, LabelledRun, label_runs};
pub use rules::label_of;
pub use segmentation::{Segment, SegmentationConfig, segments};
pub use signature::PlaceSignature;
