//! Matches of the map, and what people say of them.
//!
//! Matches belong to a map version and are numbered within it. A decision belongs to the pair of places: it holds for
//! every match, of this version and of those to come, whose two stretches of driving overlap the two it was made on.

use std::collections::BTreeMap;

use locution_engine::mapping::{Channel, Decision, Direction, MatchState, PlaceMatch};

use crate::app::site::Site;
use crate::app::{AppError, Window};
use crate::records::{Key, Map, MatchPlace, RunIdx, Visit, codec};

/// A match with its number.
#[derive(Clone, Debug)]
pub struct NumberedMatch {
    /// Its number in the map version.
    pub id: u64,
    pub found: PlaceMatch,
    /// Where and when its stretches were driven; not known of versions of earlier programs.
    pub place: Option<MatchPlace>,
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

/// In which order matches are listed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MatchOrder {
    /// As the version numbers them.
    #[default]
    Number,
    /// The most probable first.
    Probability,
    /// The latest revisit first.
    Time,
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
    /// Component of the map in which one of its stretches lies.
    pub component: Option<u32>,
    /// What a person said of it: nothing, that it is the same place, or that it is not.
    pub decision: Option<Option<bool>>,
    /// Least and greatest probability.
    pub probability: Option<(f64, f64)>,
    /// One of its stretches was driven then, and lies there.
    pub window: Window,
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

    /// Whether a match passes, with what is known beside it.
    fn accepts_all_of(&self, numbered: &NumberedMatch) -> bool {
        let probability = numbered.found.probability;
        self.accepts(&numbered.found)
            && self.decision.is_none_or(|decision| decision == numbered.decision)
            && self.probability.is_none_or(|(min, max)| (min..=max).contains(&probability))
            && (self.component.is_none() && self.window.is_everything()
                || numbered.place.is_some_and(|place| self.is_there(&place)))
    }

    /// Whether one of the two stretches was driven in the window.
    fn is_there(&self, place: &MatchPlace) -> bool {
        [place.earlier, place.later].iter().any(|stretch| {
            self.component.is_none_or(|component| component == stretch.component)
                && self.window.holds_time(stretch.timestamps_ns)
                && self.window.holds_place(&stretch.map_from_middle.position())
        })
    }
}

/// Up to `limit` matches that pass a filter, and the number to go on with. `from` is what the page before gave: a number
/// of the version in the order of numbers, a count of matches in another.
///
/// # Errors
/// Those of the storage.
pub async fn matches(
    map: &Map,
    filter: &MatchFilter,
    order: MatchOrder,
    from: u64,
    limit: usize,
) -> Result<(Vec<NumberedMatch>, Option<u64>), AppError> {
    let decisions = decisions(map).await?;
    let places = map.match_places().await?;
    let numbered = |id: u64, found: PlaceMatch| {
        let place = usize::try_from(id).ok().and_then(|idx| places.get(idx).copied().flatten());
        let decision = decision_on(&decisions, &found);
        NumberedMatch { id, found, place, decision }
    };
    if order == MatchOrder::Number {
        return page_of_numbers(map, filter, numbered, from, limit).await;
    }
    // First only what they are ordered by: all matches at once would take much memory.
    let mut keys = Vec::new();
    map.visit_matches(0, |id, found| {
        let numbered = numbered(id, found);
        if filter.accepts_all_of(&numbered) {
            keys.push((order_key(&numbered, order), id));
        }
        Visit::GoOn
    })
    .await?;
    keys.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let first = usize::try_from(from).unwrap_or(usize::MAX).min(keys.len());
    let end = first.saturating_add(limit).min(keys.len());
    let ranks: BTreeMap<u64, usize> =
        keys[first..end].iter().enumerate().map(|(rank, (_, id))| (*id, rank)).collect();
    let mut page = Vec::new();
    map.visit_matches(ranks.keys().next().copied().unwrap_or(u64::MAX), |id, found| {
        if let Some(rank) = ranks.get(&id) {
            page.push((*rank, numbered(id, found)));
        }
        if page.len() == ranks.len() { Visit::Enough } else { Visit::GoOn }
    })
    .await?;
    page.sort_by_key(|(rank, _)| *rank);
    let next = (end < keys.len()).then_some(end as u64);
    Ok((page.into_iter().map(|(_, numbered)| numbered).collect(), next))
}

async fn page_of_numbers(
    map: &Map,
    filter: &MatchFilter,
    numbered: impl Fn(u64, PlaceMatch) -> NumberedMatch + Send,
    from: u64,
    limit: usize,
) -> Result<(Vec<NumberedMatch>, Option<u64>), AppError> {
    let mut page = Vec::new();
    let mut next = None;
    map.visit_matches(from, |id, found| {
        let numbered = numbered(id, found);
        if !filter.accepts_all_of(&numbered) {
            return Visit::GoOn;
        }
        if page.len() == limit {
            next = Some(id);
            return Visit::Enough;
        }
        page.push(numbered);
        Visit::GoOn
    })
    .await?;
    Ok((page, next))
}

/// What matches are ordered by, the greatest first.
fn order_key(numbered: &NumberedMatch, order: MatchOrder) -> f64 {
    match order {
        MatchOrder::Number => -(numbered.id as f64),
        MatchOrder::Probability => numbered.found.probability,
        MatchOrder::Time => {
            numbered.place.map_or(f64::NEG_INFINITY, |place| place.later.timestamps_ns.0 as f64)
        }
    }
}

/// One match of a version.
///
/// # Errors
/// [`AppError::NotFound`].
pub async fn a_match(map: &Map, id: u64) -> Result<NumberedMatch, AppError> {
    let found = map.a_match(id).await?.ok_or_else(|| AppError::not_found("match", id))?;
    let places = map.match_places().await?;
    let decision = decision_on(&decisions(map).await?, &found);
    let place = usize::try_from(id).ok().and_then(|idx| places.get(idx).copied().flatten());
    Ok(NumberedMatch { id, found, place, decision })
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
