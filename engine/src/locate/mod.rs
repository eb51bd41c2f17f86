//! "Where am I" in a known map: the session that is served (SPEC section 6).
//!
//! ```text
//!   GridMap ─► ServedMap: likelihood field, bounds for the search   (once per map version)
//!   scans   ─► Localizer: search ─► follow ─► judge ─► lost, ambiguous or converged
//! ```
//!
//! A [`Localizer`] searches the map for the robot's surroundings and judges every place by all the scans of the last
//! metres.

mod config;
mod global_search;
mod likelihood_field;
mod localizer;
mod served_map;
mod spread;
mod surroundings;
mod sweep;
mod track;

pub use config::LocalizationConfig;
pub use global_search::{GlobalSearchConfig, ScoredPose, SearchPyramid};
pub use likelihood_field::{LikelihoodField, LikelihoodFieldConfig};
pub use localizer::{Hypothesis, LocalizationEstimate, LocalizationState, Localizer, LocalizerConfig};
pub use served_map::ServedMap;
