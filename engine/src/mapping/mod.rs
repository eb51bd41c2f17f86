//! From runs to one map: matches, constraints, the robust pose graph and what is served of it (SPEC section 2).

mod anchors;
mod coarse_graph;
mod config;
mod guided;
mod mapper;
mod memo;
mod place_match;
mod run;
mod site_map;

pub use config::MappingConfig;
pub use mapper::map_site;
pub use memo::RegistrationMemo;
pub use place_match::{Channel, Decision, Evidence, MatchState, PlaceMatch, Registration, RejectionReason};
pub use run::{Keyframe, RunRecord};
pub use site_map::{MappedRun, SiteMap};

pub use crate::text::{Direction, Interval};
