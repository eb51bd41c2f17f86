//! From runs to one map: matches, constraints, the robust pose graph and what is served of it (SPEC section 2).

mod candidates;
mod changes;
mod claims;
mod coarse_graph;
mod component;
mod condense;
mod config;
mod exemplar;
mod finish;
mod foundation;
mod guided;
mod indices;
mod join_evidence;
mod joining;
mod judgements;
mod mapper;
mod memo;
mod null;
mod overlap;
mod place_match;
mod placement;
mod refusals;
mod run;
mod site_anchors;
mod site_map;
mod site_pieces;
mod stored_matches;
mod stretches;
mod text_evidence;
mod told;
mod watch;
mod ways;

pub use changes::{Change, ChangeKind, ChangesConfig, PlacedRun, find_changes};
pub use config::MappingConfig;
pub use foundation::{Extended, Foundation, MapSettings};
pub use mapper::{map_site, map_site_watched};
pub use memo::RegistrationMemo;
pub use place_match::{Channel, Decision, Evidence, MatchState, PlaceMatch, Registration, RejectionReason};
pub use placement::place_observations;
pub use run::{Keyframe, RunRecord};
pub use site_map::{MappedRun, SiteMap};
pub use site_pieces::{Piece, SitePieces};
pub use text_evidence::weigh_texts;
pub use watch::{MapStage, MapStep, MappingError, Watch};

pub use crate::text::{Direction, Interval};
