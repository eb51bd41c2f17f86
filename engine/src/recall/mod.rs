//! Recall: where was this short recording made? Query by example (SPEC section 4).
//!
//! ```text
//! runs in their map ─► PlaceIndex: profiles of everything driven, areas to register in   (once per map version)
//! scans ─► Example: translated, refined, one submap
//!       ─► proposals by profiles, both ways ─► search ─► alignment ─► opinions ─► probabilities
//! ```
//!
//! Retrieval is cheap and often wrong, registration is dear and seldom wrong. What no place explains is not here: that
//! answer takes part in the probabilities like a place of its own.

mod answer;
mod calibration;
mod config;
mod example;
mod place_index;
mod proposals;
mod recent_scans;

#[cfg(test)]
mod tests;

pub use answer::{AnsweredPlace, ExampleAnswer, LocalizationState, settle, worst_sd_m};
pub use calibration::{Calibration, NUM_FEATURES, NUM_FIT_FEATURES, PlaceEvidence, fit_features};
pub use config::RecallConfig;
pub use example::Example;
pub use place_index::{FoundPlace, PlaceIndex, PlaceIndexBuilder, PlacedDrive};
pub use recent_scans::RecentScans;
