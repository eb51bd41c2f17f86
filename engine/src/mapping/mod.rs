//! From runs to one map: matches, constraints, the robust pose graph and what is served of it (SPEC section 2).

mod place_match;
mod run;

pub use place_match::{Channel, Decision, Evidence, MatchState, PlaceMatch, Registration, RejectionReason};
pub use run::{Keyframe, RunRecord};

pub use crate::text::{Direction, Interval};
