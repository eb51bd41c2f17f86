//! Matches of the map, and what people say of them.
//!
//! Matches belong to a map version and are numbered within it. A decision belongs to the pair of places: it holds for
//! every match, of this version and of those to come, whose two stretches of driving overlap the two it was made on.

use locution_engine::mapping::{Channel, Decision, Direction, MatchState, PlaceMatch};

use crate::app::AppError;
use crate::app::site::Site;
use crate::records::{Key, Map, RunIdx, Visit, codec};

/// A match with its number.
#[derive(Clone, Debug)]
pub struct NumberedMatch {
    /// Its number in the map version.
    pub id: u64,
    pub found: PlaceMatch,
    /// What a person said of this pair of places: true, it is the same; false, it is not.
    pub decision: Option<bool>,
}

/// What became of a match, without the reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MatchStateKind {
    /// Nothing speaks for or against it but likeness.
    Candidate,
    /// It holds the map together.
    Verified,
    /// Something speaks against it.
    Rejected,
}

impl From<&MatchState> for MatchStateKind {
    fn from(state: &MatchState) -> Self {
        match state {
            MatchState::Candidate => Self::Candidate,
            MatchState::Verified => Self::Verified,
            MatchState::Rejected(_) => Self::Rejected,
        }
    }
}

/// Which matches to list; what is `None` may be anything.
#[derive(Clone, Copy, Debug, Default)]
pub struct MatchFilter {
    /// What became of it.
    pub state: Option<MatchStateKind>,
    /// What proposed it.
    pub channel: Option<Channel>,
    /// How the place was driven the second time.
    pub direction: Option<Direction>,
    /// Number of a run that takes part.
    pub run: Option<RunIdx>,
}

impl MatchFilter {
    /// Only matches that hold the map together.
    pub fn verified() -> Self {
        Self { state: Some(MatchStateKind::Verified), ..Self::default() }
    }

    /// Whether a match is one of them.
    pub fn accepts(&self, found: &PlaceMatch) -> bool {
        self.state.is_none_or(|state| state == MatchStateKind::from(&found.state))
            && self.channel.is_none_or(|channel| channel == found.channel)
            && self.direction.is_none_or(|direction| direction == found.direction)
            && self.run.is_none_or(|run| found.earlier.run_idx == run || found.later.run_idx == run)
    }
}

/// Up to `limit` matches that pass a filter, from number `from` on, and the number to go on with.
pub async fn matches(
    map: &Map,
    filter: &MatchFilter,
    from: u64,
    limit: usize,
) -> Result<(Vec<NumberedMatch>, Option<u64>), AppError> {
    let decisions = decisions(map).await?;
    let mut page = Vec::new();
    let mut next = None;
    map.visit_matches(from, |id, found| {
        if !filter.accepts(&found) {
            return Visit::GoOn;
        }
        if page.len() == limit {
            next = Some(id);
            return Visit::Enough;
        }
        let decision = decision_on(&decisions, &found);
        page.push(NumberedMatch { id, found, decision });
        Visit::GoOn
    })
    .await?;
    Ok((page, next))
}

/// One match of a version.
///
/// # Errors
/// [`AppError::NotFound`].
pub async fn a_match(map: &Map, id: u64) -> Result<NumberedMatch, AppError> {
    let found = map.a_match(id).await?.ok_or_else(|| AppError::not_found("match", id))?;
    let decision = decision_on(&decisions(map).await?, &found);
    Ok(NumberedMatch { id, found, decision })
}

/// Says of a pair of places whether it is the same; what was said of it before no longer holds.
pub async fn decide(site: &Site, found: &PlaceMatch, is_same_place: bool) -> Result<(), AppError> {
    let stale = decisions_on(site, found).await?;
    let decision =
        Decision { earlier: found.earlier, later: found.later, direction: found.direction, is_same_place };
    site.change(|record, batch| {
        stale.into_iter().for_each(|number| batch.delete(Key::Decision(number).encode()));
        batch.put(Key::Decision(record.next_decision).encode(), codec::encode(&decision));
        record.next_decision += 1;
        Ok(())
    })
    .await
}

/// Takes back what was said of a pair of places.
pub async fn undecide(site: &Site, found: &PlaceMatch) -> Result<(), AppError> {
    let stale = decisions_on(site, found).await?;
    site.change(|_, batch| {
        stale.into_iter().for_each(|number| batch.delete(Key::Decision(number).encode()));
        Ok(())
    })
    .await
}

/// Numbers of the decisions on a pair of places.
async fn decisions_on(site: &Site, found: &PlaceMatch) -> Result<Vec<u64>, AppError> {
    let decisions = site.reader().decisions().await?;
    let on_it = decisions.into_iter().filter(|(_, decision)| decision.is_about(found));
    Ok(on_it.map(|(number, _)| number).collect())
}

async fn decisions(map: &Map) -> Result<Vec<Decision>, AppError> {
    Ok(map.reader().decisions().await?.into_iter().map(|(_, decision)| decision).collect())
}

fn decision_on(decisions: &[Decision], found: &PlaceMatch) -> Option<bool> {
    decisions.iter().rev().find(|decision| decision.is_about(found)).map(|decision| decision.is_same_place)
}
