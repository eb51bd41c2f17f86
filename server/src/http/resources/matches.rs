//! Matches as objects, and what people say of them.

use axum::Json;
use axum::http::StatusCode;
use locution_engine::mapping::{
    Channel, Direction, Evidence, MatchState, PlaceMatch, Registration, RejectionReason,
};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::maps::VersionParams;
use crate::app::Name;
use crate::app::maps::{
    MatchFilter, MatchOrder, MatchStateKind, NumberedMatch, a_match, decide, matches, undecide,
};
use crate::error::ApiError;
use crate::extract::{Body, IdOf, Paged, Params, SiteOf};
use crate::http::values::{ChannelDto, DirectionDto, Page, PageParams, PoseDto, one_of, window};
use crate::records::{MapRecord, StretchPlace};

/// Which matches to list.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct MatchParams {
    /// What became of it.
    #[param(value_type = Option<MatchStateDto>, inline)]
    pub state: Option<String>,
    /// What found it.
    #[param(value_type = Option<ChannelDto>, inline)]
    pub channel: Option<String>,
    /// Which way the later stretch was driven.
    #[param(value_type = Option<DirectionDto>, inline)]
    pub direction: Option<String>,
    /// Name of a run that takes part.
    #[param(pattern = "^[A-Za-z0-9_-][A-Za-z0-9._-]*$", max_length = 64)]
    pub run: Option<String>,
    /// Component of the map in which one of its stretches lies.
    pub component: Option<u32>,
    /// What a person said of the pair of places.
    #[param(value_type = Option<DecisionFilterDto>, inline)]
    pub decision: Option<String>,
    /// Least probability.
    #[param(minimum = 0, maximum = 1)]
    pub probability_min: Option<f64>,
    /// Greatest probability.
    #[param(minimum = 0, maximum = 1)]
    pub probability_max: Option<f64>,
    /// Not before, nanoseconds.
    pub from_ns: Option<i64>,
    /// Before, nanoseconds.
    pub to_ns: Option<i64>,
    /// Within this rectangle: `x,y,x,y` of two opposite corners, metres, in the map; either stretch counts, at its middle.
    #[param(pattern = "^-?[0-9.eE+-]+(,-?[0-9.eE+-]+){3}$", max_length = 200, example = "0,0,12.5,8")]
    pub area: Option<String>,
    /// In which order; as the version numbers them unless said.
    #[param(value_type = Option<MatchOrderDto>, inline)]
    pub sort: Option<String>,
    /// Version of the map; the serving one unless said.
    #[serde(default, deserialize_with = "crate::http::values::in_query")]
    pub version: Option<u64>,
}

/// What a person said of a pair of places, or nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum DecisionFilterDto {
    /// It is not the same place.
    Veto,
    /// It is the same place.
    Confirm,
    /// Nothing was said.
    None,
}

/// In which order matches are listed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MatchOrderDto {
    /// As the version numbers them.
    Id,
    /// The most probable first.
    Probability,
    /// The latest revisit first.
    Time,
}

impl MatchParams {
    /// The order, as numbered unless said.
    ///
    /// # Errors
    /// 422 for a word that is none of the choices.
    pub fn order(&self) -> Result<MatchOrder, ApiError> {
        Ok(match one_of("sort", self.sort.as_deref())?.unwrap_or(MatchOrderDto::Id) {
            MatchOrderDto::Id => MatchOrder::Number,
            MatchOrderDto::Probability => MatchOrder::Probability,
            MatchOrderDto::Time => MatchOrder::Time,
        })
    }

    /// The filter, with the run's number already looked up.
    ///
    /// # Errors
    /// 422 for a word that is none of the choices.
    pub fn filter(&self, run: Option<u32>) -> Result<MatchFilter, ApiError> {
        let state = one_of("state", self.state.as_deref())?.map(|state| match state {
            MatchStateDto::Candidate => MatchStateKind::Candidate,
            MatchStateDto::Verified => MatchStateKind::Verified,
            MatchStateDto::Rejected => MatchStateKind::Rejected,
        });
        let channel = one_of("channel", self.channel.as_deref())?.map(|channel| match channel {
            ChannelDto::Words => Channel::Words,
            ChannelDto::Profile => Channel::Profile,
            ChannelDto::Spatial => Channel::Spatial,
        });
        let direction = one_of("direction", self.direction.as_deref())?.map(|direction| match direction {
            DirectionDto::Same => Direction::Same,
            DirectionDto::Opposite => Direction::Opposite,
        });
        let decision = one_of("decision", self.decision.as_deref())?.map(|decision| match decision {
            DecisionFilterDto::Veto => Some(false),
            DecisionFilterDto::Confirm => Some(true),
            DecisionFilterDto::None => None,
        });
        for (name, bound) in
            [("probability_min", self.probability_min), ("probability_max", self.probability_max)]
        {
            if bound.is_some_and(|bound| !(0.0..=1.0).contains(&bound)) {
                return Err(ApiError::invalid(name, "a probability lies between 0 and 1"));
            }
        }
        let probability = (self.probability_min.is_some() || self.probability_max.is_some())
            .then(|| (self.probability_min.unwrap_or(0.0), self.probability_max.unwrap_or(1.0)));
        let window = window(self.from_ns, self.to_ns, self.area.as_deref())?;
        let component = self.component;
        Ok(MatchFilter { state, channel, direction, run, component, decision, probability, window })
    }
}

/// What became of a match.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum MatchStateDto {
    /// Found, not decided.
    Candidate,
    /// It holds the map together.
    Verified,
    /// Seen and refused.
    Rejected,
}

/// Why a match does not constrain the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RejectionReasonDto {
    /// Too few bits.
    WeakText,
    /// The driven shapes differ.
    Shape,
    /// The density profiles differ.
    Density,
    /// The submaps do not fit.
    Registration,
    /// Another place fits as well.
    Ambiguous,
    /// It contradicts the other matches.
    Inconsistent,
    /// A person said no.
    Vetoed,
}

impl From<RejectionReason> for RejectionReasonDto {
    fn from(reason: RejectionReason) -> Self {
        match reason {
            RejectionReason::WeakText => Self::WeakText,
            RejectionReason::Shape => Self::Shape,
            RejectionReason::Density => Self::Density,
            RejectionReason::Registration => Self::Registration,
            RejectionReason::Ambiguous => Self::Ambiguous,
            RejectionReason::Inconsistent => Self::Inconsistent,
            RejectionReason::Vetoed => Self::Vetoed,
        }
    }
}

/// What speaks for and against a match.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct EvidenceDto {
    /// Surprise of the most surprising chain of words through both stretches; null when none was weighed.
    pub bits: Option<f64>,
    /// Number of chains this surprising that chance would bring in this site; null when too many to count.
    pub expected_chance_matches: Option<f64>,
    /// RMS distance of the two driven shapes after rigid alignment, metres.
    pub shape_residual_m: Option<f64>,
    /// Correlation of the aligned density profiles, from -1 to 1.
    pub density_correlation: Option<f64>,
    /// Evidence of the best candidate at a different place, relative to this one's: 1 is fully ambiguous.
    pub ambiguity: Option<f64>,
    /// Registration of the local submaps.
    pub registration: Option<RegistrationDto>,
}

/// How one submap lies on the other.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct RegistrationDto {
    /// Number of the keyframe of the earlier run.
    pub earlier_keyframe: u32,
    /// Number of the keyframe of the later run.
    pub later_keyframe: u32,
    /// Pose of the later keyframe in the frame of the earlier.
    pub earlier_from_later: PoseDto,
    /// Covariance of (x, y, θ), row by row.
    pub covariance: [[f64; 3]; 3],
    /// Share of what both saw that agrees, from 0 to 1.
    pub agreement: f64,
}

impl From<&Registration> for RegistrationDto {
    fn from(registration: &Registration) -> Self {
        Self {
            earlier_keyframe: registration.earlier_keyframe,
            later_keyframe: registration.later_keyframe,
            earlier_from_later: registration.earlier_from_later.into(),
            covariance: registration.covariance,
            agreement: registration.agreement,
        }
    }
}

impl From<&Evidence> for EvidenceDto {
    fn from(evidence: &Evidence) -> Self {
        let finite = |value: f64| Some(value).filter(|value| value.is_finite());
        Self {
            bits: finite(evidence.bits),
            expected_chance_matches: finite(evidence.expected_chance_matches),
            shape_residual_m: evidence.shape_residual_m.and_then(finite),
            density_correlation: evidence.density_correlation.and_then(finite),
            ambiguity: evidence.ambiguity.and_then(finite),
            registration: evidence.registration.as_ref().map(RegistrationDto::from),
        }
    }
}

/// A stretch of driving.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct IntervalDto {
    /// Name of the run.
    pub run: String,
    /// First observation, inclusive.
    pub first: u32,
    /// Last observation, inclusive.
    pub last: u32,
    /// Timestamp of the first, nanoseconds; null in map versions of earlier programs, as what follows.
    pub first_timestamp_ns: Option<i64>,
    /// Timestamp of the last, nanoseconds.
    pub last_timestamp_ns: Option<i64>,
    /// Component of the map.
    pub component: Option<u32>,
    /// Where it was half way, in the component's frame.
    pub map_from_middle: Option<PoseDto>,
}

/// What a person said of a pair of places.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum DecisionKindDto {
    /// It is not the same place.
    Veto,
    /// It is the same place, whatever the evidence.
    Confirm,
}

/// Says of a match whether it is right.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct DecisionDto {
    /// `veto` or `confirm`.
    pub decision: DecisionKindDto,
}

/// The claim that two stretches of driving went through the same place.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct MatchDto {
    /// Its name in this version of the map.
    pub id: String,
    /// The stretch driven first.
    pub earlier: IntervalDto,
    /// The stretch that revisits it.
    pub later: IntervalDto,
    /// Which way the later stretch was driven.
    pub direction: DirectionDto,
    /// What found it.
    pub channel: ChannelDto,
    /// What speaks for and against it.
    pub evidence: EvidenceDto,
    /// Probability that it is right, from 0 to 1.
    #[schema(minimum = 0, maximum = 1)]
    pub probability: f64,
    /// What became of it.
    pub state: MatchStateDto,
    /// Why it was rejected.
    pub reason: Option<RejectionReasonDto>,
    /// What a person said of this pair of places; it counts at the next build.
    pub decision: Option<DecisionKindDto>,
}

impl MatchDto {
    /// A match, with the runs by name.
    pub fn new(numbered: NumberedMatch, map: &MapRecord) -> Self {
        let found: &PlaceMatch = &numbered.found;
        let interval =
            |interval: &locution_engine::mapping::Interval, place: Option<StretchPlace>| IntervalDto {
                run: map.name_of(interval.run_idx),
                first: interval.first,
                last: interval.last,
                first_timestamp_ns: place.map(|place| place.timestamps_ns.0),
                last_timestamp_ns: place.map(|place| place.timestamps_ns.1),
                component: place.map(|place| place.component),
                map_from_middle: place.map(|place| place.map_from_middle.into()),
            };
        let (state, reason) = match found.state {
            MatchState::Candidate => (MatchStateDto::Candidate, None),
            MatchState::Verified => (MatchStateDto::Verified, None),
            MatchState::Rejected(reason) => (MatchStateDto::Rejected, Some(reason.into())),
        };
        let channel = match found.channel {
            Channel::Words => ChannelDto::Words,
            Channel::Profile => ChannelDto::Profile,
            Channel::Spatial => ChannelDto::Spatial,
        };
        Self {
            id: numbered.id.to_string(),
            earlier: interval(&found.earlier, numbered.place.map(|place| place.earlier)),
            later: interval(&found.later, numbered.place.map(|place| place.later)),
            direction: found.direction.into(),
            channel,
            evidence: (&found.evidence).into(),
            probability: found.probability,
            state,
            reason,
            decision: numbered.decision.map(|is_same_place| match is_same_place {
                true => DecisionKindDto::Confirm,
                false => DecisionKindDto::Veto,
            }),
        }
    }
}

/// Matches of the serving map, or of a version.
#[utoipa::path(get, path = "/v1/sites/{site}/matches", operation_id = "list_matches", tag = "maps",
    params(MatchParams, PageParams),
    responses((status = 200, description = "A page of matches", body = Page<MatchDto>),
        (status = 409, description = "No map has been built yet")))]
pub async fn list_matches(
    SiteOf(site): SiteOf,
    Paged(params, page): Paged<MatchParams>,
) -> Result<Json<Page<MatchDto>>, ApiError> {
    let map = site.map(params.version).await?;
    let run = match &params.run {
        Some(run) => Some(site.run(&Name::new(run, "run")?).await?.idx),
        None => None,
    };
    let filter = params.filter(run)?;
    let (matches, next) = matches(&map, &filter, params.order()?, page.first, page.limit).await?;
    let items = matches.into_iter().map(|found| MatchDto::new(found, &map.record)).collect();
    Ok(Json(Page { items, next_cursor: next.map(|next| next.to_string()) }))
}

/// One match with its evidence.
#[utoipa::path(get, path = "/v1/sites/{site}/matches/{id}", operation_id = "get_match", tag = "maps",
    params(VersionParams),
    responses((status = 200, description = "The match", body = MatchDto),
        (status = 409, description = "No map has been built yet")))]
pub async fn get_match(
    SiteOf(site): SiteOf,
    IdOf(id): IdOf,
    Params(params): Params<VersionParams>,
) -> Result<Json<MatchDto>, ApiError> {
    let map = site.map(params.version).await?;
    Ok(Json(MatchDto::new(a_match(&map, id).await?, &map.record)))
}

/// Veto or confirm a match. It sticks to the pair of places, also in maps to come, and counts at the next build.
#[utoipa::path(put, path = "/v1/sites/{site}/matches/{id}/decision", operation_id = "decide_match", tag = "maps",
    params(VersionParams), request_body = DecisionDto,
    responses((status = 200, description = "The match with the decision", body = MatchDto),
        (status = 409, description = "No map has been built yet")))]
pub async fn decide_match(
    SiteOf(site): SiteOf,
    IdOf(id): IdOf,
    Params(params): Params<VersionParams>,
    Body(decision): Body<DecisionDto>,
) -> Result<Json<MatchDto>, ApiError> {
    let map = site.map(params.version).await?;
    let found = a_match(&map, id).await?.found;
    decide(&site, &found, decision.decision == DecisionKindDto::Confirm).await?;
    Ok(Json(MatchDto::new(a_match(&map, id).await?, &map.record)))
}

/// Take back what was said of a match.
#[utoipa::path(delete, path = "/v1/sites/{site}/matches/{id}/decision", operation_id = "undecide_match", tag = "maps",
    params(VersionParams),
    responses((status = 204, description = "No decision holds for the pair of places"),
        (status = 409, description = "No map has been built yet")))]
pub async fn undecide_match(
    SiteOf(site): SiteOf,
    IdOf(id): IdOf,
    Params(params): Params<VersionParams>,
) -> Result<StatusCode, ApiError> {
    let map = site.map(params.version).await?;
    let found = a_match(&map, id).await?.found;
    undecide(&site, &found).await?;
    Ok(StatusCode::NO_CONTENT)
}
