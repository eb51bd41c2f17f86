//! Labels on the wire.

use locution_engine::semantics::{LabelPattern, PlaceLabel};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::common::PoseDto;
use crate::app::maps::{DrivenStretch, LabelAnswer};
use crate::error::ApiError;

/// Most parts of a question.
const NUM_PARTS_MAX: usize = 16;

/// Which labels to list.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct LabelParams {
    /// Version of the map; the serving one unless said.
    pub version: Option<u64>,
    /// Most items to answer; 100 unless said, at most 10000.
    pub limit: Option<usize>,
    /// `next_cursor` of the page before.
    pub cursor: Option<String>,
}

/// A stretch of driving through places of one label.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct LabelDto {
    /// The run that drove it.
    pub run: String,
    /// Component of the map.
    pub component: u32,
    /// `bifurcation`, `corner`, `corridor`, `dead-end` or `hall`.
    #[schema(example = "corridor")]
    pub label: String,
    /// First observation, inclusive.
    pub first: u64,
    /// Last observation, inclusive.
    pub last: u64,
    /// Timestamp of the first, nanoseconds.
    pub first_timestamp_ns: i64,
    /// Timestamp of the last, nanoseconds.
    pub last_timestamp_ns: i64,
    /// Metres along it.
    pub length_m: f64,
    /// Radians turned in it, left positive.
    pub turn_rad: f64,
    /// Share of what was seen that agrees with the label, from 0 to 1.
    pub confidence: f64,
    /// Its middle in the component's frame.
    pub map_from_middle: PoseDto,
}

impl From<DrivenStretch> for LabelDto {
    fn from(driven: DrivenStretch) -> Self {
        let stretch = driven.stretch;
        Self {
            run: driven.run,
            component: driven.component,
            label: stretch.label.name().into(),
            first: stretch.first,
            last: stretch.last,
            first_timestamp_ns: stretch.timestamps_ns.0,
            last_timestamp_ns: stretch.timestamps_ns.1,
            length_m: stretch.length_m,
            turn_rad: stretch.turn_rad,
            confidence: stretch.confidence,
            map_from_middle: stretch.map_from_middle.into(),
        }
    }
}

/// Which way a place turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum TurnDto {
    /// Counter-clockwise.
    Left,
    /// Clockwise.
    Right,
}

/// One part of a question.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct LabelPatternDto {
    /// `bifurcation`, `corner`, `corridor`, `dead-end` or `hall`.
    #[schema(example = "corridor")]
    pub label: String,
    /// Metres along it, at least.
    #[serde(default)]
    #[schema(example = 10.0)]
    pub length_min_m: f64,
    /// Metres along it, at most.
    pub length_max_m: Option<f64>,
    /// Which way it turns; either unless said.
    pub turn: Option<TurnDto>,
}

/// A sequence of labels to look for.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct LabelQueryDto {
    /// In the order of driving.
    pub labels: Vec<LabelPatternDto>,
    /// Most places to answer; 20 unless said.
    pub limit: Option<usize>,
}

impl LabelQueryDto {
    /// The checked question.
    ///
    /// # Errors
    /// 422 for a label that does not exist, and for too many or too few parts.
    pub fn check(&self) -> Result<(Vec<LabelPattern>, usize), ApiError> {
        if self.labels.is_empty() || self.labels.len() > NUM_PARTS_MAX {
            return Err(ApiError::invalid("labels", format!("a question has 1 to {NUM_PARTS_MAX} labels")));
        }
        let limit = self.limit.unwrap_or(20);
        if !(1..=1000).contains(&limit) {
            return Err(ApiError::invalid("limit", "1 to 1000 places"));
        }
        let patterns = self.labels.iter().enumerate().map(|(idx, part)| {
            let label = PlaceLabel::from_name(&part.label).ok_or_else(|| {
                let names = PlaceLabel::ALL.map(PlaceLabel::name).join(", ");
                ApiError::invalid(format!("labels[{idx}].label"), format!("one of {names}"))
            })?;
            Ok(LabelPattern {
                label,
                length_min_m: part.length_min_m,
                length_max_m: part.length_max_m.unwrap_or(f64::INFINITY),
                is_left: part.turn.map(|turn| turn == TurnDto::Left),
            })
        });
        Ok((patterns.collect::<Result<_, ApiError>>()?, limit))
    }
}

/// Where a question fits.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct LabelAnswerDto {
    /// The stretches, in the order of the question.
    pub places: Vec<LabelDto>,
    /// Whether the run drove them the other way round.
    pub is_reversed: bool,
    /// The least sure of its labels.
    pub confidence: f64,
}

impl From<LabelAnswer> for LabelAnswerDto {
    fn from(answer: LabelAnswer) -> Self {
        Self {
            places: answer.stretches.into_iter().map(LabelDto::from).collect(),
            is_reversed: answer.is_reversed,
            confidence: answer.confidence,
        }
    }
}
