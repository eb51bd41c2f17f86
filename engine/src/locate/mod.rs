//! "Where am I" in a known map: the session that is served (SPEC section 6).
//!
//! ```text
//!   GridMap ─► ServedMap: likelihood field, bounds for the search            (once per map version)
//!   scans   ─► SiteSession: search ─► follow ─► lay into the map ─► lost, ambiguous or converged
//! ```
//!
//! A [`SiteSession`] searches every component of a map for the robot's surroundings, follows what it finds, and lays
//! what was seen on the last metres into the map there, as a question by example is.

mod component_tracks;
mod config;
mod global_search;
mod likelihood_field;
mod localizer_config;
mod prior;
mod served_map;
mod session_answer;
mod site_session;
mod spread;
mod surroundings;
mod sweep;
mod track;

pub use config::LocalizationConfig;
pub use global_search::{GlobalSearchConfig, ScoredPose, SearchPyramid};
pub use likelihood_field::{LikelihoodField, LikelihoodFieldConfig};
pub use localizer_config::LocalizerConfig;
pub use prior::PosePrior;
pub use served_map::ServedMap;
pub use session_answer::{Hypothesis, LocalizationEstimate, LocalizationState, Missing};
pub use site_session::{JudgedPlace, SessionConfig, SessionMap, SiteSession};
