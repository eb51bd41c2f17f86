//! Matches in formats that do not describe themselves: there the state cannot be told by the names of its fields.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::place_match::{Channel, Evidence, MatchState, PlaceMatch, RejectionReason};
use crate::text::{Direction, Interval};

#[derive(Serialize, Deserialize)]
#[serde(remote = "MatchState")]
enum StoredState {
    Candidate,
    Verified,
    Rejected(RejectionReason),
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "PlaceMatch")]
struct StoredFields {
    earlier: Interval,
    later: Interval,
    direction: Direction,
    channel: Channel,
    evidence: Evidence,
    probability: f64,
    #[serde(with = "StoredState")]
    state: MatchState,
}

#[derive(Serialize, Deserialize)]
struct StoredMatch(#[serde(with = "StoredFields")] PlaceMatch);

/// Writes matches.
pub(crate) fn serialize<S: Serializer>(matches: &[PlaceMatch], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(matches.iter().cloned().map(StoredMatch))
}

/// Reads matches.
pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<PlaceMatch>, D::Error> {
    let stored = Vec::<StoredMatch>::deserialize(deserializer)?;
    Ok(stored.into_iter().map(|StoredMatch(found)| found).collect())
}
