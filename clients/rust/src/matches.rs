//! Matches, and what people say of them.

use serde::Serialize;

use crate::client::{Body, Client};
use crate::error::ClientError;
use crate::routes::{self, Query};
use crate::types::{Channel, DecisionKind, Direction, Match, MatchState, Point};

/// Which matches to list; what is `None` may be anything.
#[derive(Clone, Debug, Default)]
pub struct MatchFilter {
    /// What became of it.
    pub state: Option<MatchState>,
    /// What found it.
    pub channel: Option<Channel>,
    /// Which way the later stretch was driven.
    pub direction: Option<Direction>,
    /// Name of a run that takes part.
    pub run: Option<String>,
    /// Component of the map in which one of its stretches lies.
    pub component: Option<u32>,
    /// What a person said of it.
    pub decision: Option<DecisionKind>,
    /// Least probability.
    pub probability_min: Option<f64>,
    /// Greatest probability.
    pub probability_max: Option<f64>,
    /// Driven not before, nanoseconds.
    pub from_ns: Option<i64>,
    /// Driven before, nanoseconds.
    pub to_ns: Option<i64>,
    /// Two opposite corners of a rectangle in the map, metres.
    pub area: Option<(Point, Point)>,
    /// In which order; as the version numbers them unless said.
    pub order: MatchOrder,
    /// Version of the map; the serving one unless said.
    pub version: Option<u64>,
}

/// In which order matches are listed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum MatchOrder {
    /// As the version numbers them.
    #[default]
    Number,
    /// The most probable first.
    Probability,
    /// The latest revisit first.
    Time,
}

impl MatchOrder {
    const fn as_str(self) -> &'static str {
        match self {
            Self::Number => "id",
            Self::Probability => "probability",
            Self::Time => "time",
        }
    }
}

#[derive(Serialize)]
struct Decision {
    decision: DecisionKind,
}

impl Client {
    /// All matches of a site that pass a filter.
    ///
    /// # Errors
    /// See [`ClientError`]; 409 before the first build.
    pub async fn matches(&self, site: &str, filter: &MatchFilter) -> Result<Vec<Match>, ClientError> {
        let query = Query::default()
            .and("state", filter.state.map(MatchState::as_str))
            .and("channel", filter.channel.map(Channel::as_str))
            .and("direction", filter.direction.map(Direction::as_str))
            .and("run", filter.run.as_ref())
            .and("component", filter.component)
            .and("decision", filter.decision.map(DecisionKind::as_str))
            .and("probability_min", filter.probability_min)
            .and("probability_max", filter.probability_max)
            .and("from_ns", filter.from_ns)
            .and("to_ns", filter.to_ns)
            .and("area", filter.area.map(|(a, b)| format!("{},{},{},{}", a.x, a.y, b.x, b.y)))
            .and("sort", Some(filter.order.as_str()))
            .and("version", filter.version);
        self.all(&routes::LIST_MATCHES, &[site], query).await
    }

    /// One match of the serving map.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn a_match(&self, site: &str, id: &str) -> Result<Match, ClientError> {
        self.get(&routes::GET_MATCH, &[site, id], &Query::default()).await
    }

    /// Vetoes or confirms a match; it counts at the next build and sticks to the pair of places.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn decide(&self, site: &str, id: &str, decision: DecisionKind) -> Result<Match, ClientError> {
        let body = Body::json(&Decision { decision })?;
        self.answer(&routes::DECIDE_MATCH, &[site, id], &Query::default(), body).await
    }

    /// Takes back what was said of a match.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn undecide(&self, site: &str, id: &str) -> Result<(), ClientError> {
        self.done(&routes::UNDECIDE_MATCH, &[site, id], Body::Empty).await
    }
}
