//! Place labels: corridor, corner, bifurcation, dead-end, hall (thesis chapter 6).

mod block;
mod config;
mod flood;
mod label;
mod label_map;
mod rules;
mod signature;

pub use config::SemanticsConfig;
pub use label::PlaceLabel;
pub use label_map::{DrivenRun, LabelledRun, label_runs};
pub use rules::label_of;
pub use signature::PlaceSignature;
