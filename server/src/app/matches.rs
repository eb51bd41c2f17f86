//! Matches of the map, and what people say of them.
//!
//! Matches belong to a map version and are numbered within it. A decision belongs to the pair of places: it holds for
//! every match, of this version and of those to come, whose two stretches of driving overlap the two it was made on.

use bytes::Bytes;
use locution_engine::mapping::{Decision, Interval, MatchState, PlaceMatch};

use super::AppError;
use super::maps::MapRecord;
use super::series;
use super::site::Site;
use crate::storage::keys::Key;
use crate::storage::{StorageError, codec};

/// A match with its number.
#[derive(Clone, Debug)]
pub struct NumberedMatch {
    /// Its number in the map version.
    pub id: u64,
    /// The match.
    pub found: PlaceMatch,
    /// What a person said of this pair of places: true, it is the same; false, it is not.
    pub decision: Option<bool>,
}

/// Which matches to list.
#[derive(Clone, Debug, Default)]
pub struct MatchFilter {
    /// `candidate`, `verified` or `rejected`.
    pub state: Option<String>,
    /// `words`, `profile` or `spatial`.
    pub channel: Option<String>,
    /// `same` or `opposite`.
    pub direction: Option<String>,
    /// Number of a run that takes part.
    pub run: Option<u32>,
}

impl MatchFilter {
    fn accepts(&self, found: &PlaceMatch) -> bool {
        let is = |wanted: &Option<String>, name: &str| wanted.as_deref().is_none_or(|wanted| wanted == name);
        is(&self.state, state_name(&found.state))
            && is(&self.channel, channel_name(found))
            && is(&self.direction, direction_name(found))
            && self.run.is_none_or(|run| found.earlier.run_idx == run || found.later.run_idx == run)
    }
}

/// The state as the API spells it.
pub fn state_name(state: &MatchState) -> &'static str {
    match state {
        MatchState::Candidate => "candidate",
        MatchState::Verified => "verified",
        MatchState::Rejected(_) => "rejected",
    }
}

/// The channel as the API spells it.
pub fn channel_name(found: &PlaceMatch) -> &'static str {
    use locution_engine::mapping::Channel;
    match found.channel {
        Channel::Words => "words",
        Channel::Profile => "profile",
        Channel::Spatial => "spatial",
    }
}

/// The direction as the API spells it.
pub fn direction_name(found: &PlaceMatch) -> &'static str {
    use locution_engine::mapping::Direction;
    match found.direction {
        Direction::Same => "same",
        Direction::Opposite => "opposite",
    }
}

/// Chunks of matches, as JSON inside: their evidence grows with the engine.
pub(super) struct StoredMatches {
    pub first: u64,
    pub bytes: Bytes,
}

impl StoredMatches {
    pub(super) fn chunks(matches: &[PlaceMatch]) -> Result<Vec<Self>, AppError> {
        let size = series::NUM_ITEMS_PER_CHUNK_MAX;
        let chunk = |(idx, chunk): (usize, &[PlaceMatch])| {
            let json: Result<Vec<String>, _> = chunk.iter().map(serde_json::to_string).collect();
            let bytes = codec::encode(&json.map_err(AppError::internal)?);
            Ok(Self { first: (idx * size) as u64, bytes })
        };
        matches.chunks(size).enumerate().map(chunk).collect()
    }
}

impl Site {
    /// Up to `limit` matches that pass a filter, from number `from` on, and the number to go on with.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn matches(
        &self,
        map: &MapRecord,
        filter: &MatchFilter,
        from: u64,
        limit: usize,
    ) -> Result<(Vec<NumberedMatch>, Option<u64>), AppError> {
        let decisions = self.decisions().await?;
        let mut page = Vec::new();
        let mut next = None;
        let prefix = Key::all_matches(map.version);
        let key = |first| Key::Match(map.version, first);
        series::for_each_chunk(&**self.store(), &prefix, key, from..map.num_matches, |first, bytes| {
            let chunk: Vec<String> = codec::decode(bytes, "matches")?;
            let num_items = chunk.len() as u64;
            for (id, json) in (first..).zip(&chunk).filter(|(id, _)| *id >= from) {
                if next.is_some() {
                    break;
                }
                let found = parse(json)?;
                if !filter.accepts(&found) {
                    continue;
                }
                if page.len() == limit {
                    next = Some(id);
                    break;
                }
                let decision = decision_on(&decisions, &found);
                page.push(NumberedMatch { id, found, decision });
            }
            Ok(num_items)
        })
        .await?;
        Ok((page, next))
    }

    /// One match of a version.
    ///
    /// # Errors
    /// [`AppError::NotFound`].
    pub async fn a_match(&self, map: &MapRecord, id: u64) -> Result<NumberedMatch, AppError> {
        let missing = || AppError::not_found("match", id);
        if id >= map.num_matches {
            return Err(missing());
        }
        let prefix = Key::all_matches(map.version);
        let key = |first| Key::Match(map.version, first);
        let json: Vec<String> = series::read(&**self.store(), &prefix, key, id..id + 1, 1).await?;
        let found = parse(json.first().ok_or_else(missing)?)?;
        let decision = decision_on(&self.decisions().await?, &found);
        Ok(NumberedMatch { id, found, decision })
    }

    /// All decisions, in the order they were made.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn decisions(&self) -> Result<Vec<Decision>, AppError> {
        let entries = self.store().scan(&Key::all_decisions(), &[], usize::MAX).await?;
        let decisions = entries.iter().map(|(_, bytes)| codec::decode(bytes, "a decision"));
        Ok(decisions.collect::<Result<_, StorageError>>()?)
    }

    /// Says of a pair of places whether it is the same; what was said of it before no longer holds.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn decide(&self, found: &PlaceMatch, is_same_place: bool) -> Result<(), AppError> {
        let stale = self.decision_keys_on(found).await?;
        let decision = Decision {
            earlier: found.earlier,
            later: found.later,
            direction: found.direction,
            is_same_place,
        };
        self.change(|record, batch| {
            stale.into_iter().for_each(|key| batch.delete(key));
            batch.put(Key::Decision(record.next_decision).encode(), codec::encode(&decision));
            record.next_decision += 1;
            Ok(())
        })
        .await
    }

    /// Takes back what was said of a pair of places.
    ///
    /// # Errors
    /// Those of the storage.
    pub async fn undecide(&self, found: &PlaceMatch) -> Result<(), AppError> {
        let stale = self.decision_keys_on(found).await?;
        self.change(|_, batch| {
            stale.into_iter().for_each(|key| batch.delete(key));
            Ok(())
        })
        .await
    }

    async fn decision_keys_on(&self, found: &PlaceMatch) -> Result<Vec<Vec<u8>>, AppError> {
        let entries = self.store().scan(&Key::all_decisions(), &[], usize::MAX).await?;
        let mut keys = Vec::new();
        for (key, bytes) in entries {
            if holds_for(&codec::decode(&bytes, "a decision")?, found) {
                keys.push(key.to_vec());
            }
        }
        Ok(keys)
    }
}

fn parse(json: &str) -> Result<PlaceMatch, StorageError> {
    serde_json::from_str(json).map_err(|error| StorageError::Corrupt { what: format!("a match: {error}") })
}

fn decision_on(decisions: &[Decision], found: &PlaceMatch) -> Option<bool> {
    decisions.iter().rev().find(|decision| holds_for(decision, found)).map(|decision| decision.is_same_place)
}

/// Whether a decision was made on the pair of places of a match.
pub(super) fn holds_for(decision: &Decision, found: &PlaceMatch) -> bool {
    decision.direction == found.direction
        && overlap(&decision.earlier, &found.earlier)
        && overlap(&decision.later, &found.later)
}

fn overlap(a: &Interval, b: &Interval) -> bool {
    a.run_idx == b.run_idx && a.first <= b.last && b.first <= a.last
}
