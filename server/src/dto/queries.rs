//! Questions by word pattern on the wire.

use locution_engine::index::WordPattern;
use locution_engine::mapping::Direction;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::common::PoseDto;
use crate::app::ask::WordAnswer;
use crate::error::ApiError;

/// Most words of a question.
const NUM_WORDS_MAX: usize = 64;

/// One word of a question; what is left out may be anything.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct WordPatternDto {
    /// d: density class.
    #[schema(example = 3)]
    pub class: Option<u8>,
    /// s: number of observations.
    #[schema(example = 24)]
    pub size: Option<u32>,
    /// How far the size may be off, as a share of the larger; 0.25 unless said.
    pub size_tolerance: Option<f64>,
    /// a: turn, radians.
    #[schema(example = 1.57)]
    pub turn_rad: Option<f64>,
    /// How far the turn may be off, radians; 30 degrees unless said.
    pub turn_tolerance_rad: Option<f64>,
}

/// A sequence of words to look for, driven either way.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct WordQueryDto {
    /// In the order of driving.
    pub words: Vec<WordPatternDto>,
    /// Most places to answer; 20 unless said.
    pub limit: Option<usize>,
}

impl WordQueryDto {
    /// The checked question.
    ///
    /// # Errors
    /// 422 for tolerances that cannot be, and for too many or too few words.
    pub fn check(&self) -> Result<(Vec<WordPattern>, usize), ApiError> {
        if self.words.is_empty() || self.words.len() > NUM_WORDS_MAX {
            return Err(ApiError::invalid("words", format!("a question has 1 to {NUM_WORDS_MAX} words")));
        }
        let limit = self.limit.unwrap_or(20);
        if !(1..=1000).contains(&limit) {
            return Err(ApiError::invalid("limit", "1 to 1000 places"));
        }
        let patterns = self.words.iter().enumerate().map(|(idx, word)| {
            let size_tolerance = word.size_tolerance.unwrap_or(0.25);
            if !(0.0..=1.0).contains(&size_tolerance) {
                return Err(ApiError::invalid(format!("words[{idx}].size_tolerance"), "a share from 0 to 1"));
            }
            let turn_tolerance_rad = word.turn_tolerance_rad.unwrap_or(30f64.to_radians());
            if !(0.0..=std::f64::consts::PI).contains(&turn_tolerance_rad) {
                return Err(ApiError::invalid(format!("words[{idx}].turn_tolerance_rad"), "from 0 to π"));
            }
            Ok(WordPattern {
                class: word.class,
                size: word.size,
                size_tolerance,
                turn_rad: word.turn_rad,
                turn_tolerance_rad,
            })
        });
        Ok((patterns.collect::<Result<_, ApiError>>()?, limit))
    }
}

/// Where a question fits.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct WordAnswerDto {
    /// The site.
    pub site: String,
    /// The run.
    pub run: String,
    /// `same`: read forwards; `opposite`: backwards.
    pub direction: String,
    /// First and last word of level 0; alternative words make them more than the question has.
    pub words: [u32; 2],
    /// First and last observation.
    pub observations: [u32; 2],
    /// Mean fit of the words, from 0 (just within the tolerances) to 1 (exact).
    pub fit: f64,
    /// Component of the map; null when the run is not in it.
    pub component: Option<u32>,
    /// The middle of the place in that component's frame.
    pub map_from_middle: Option<PoseDto>,
}

impl WordAnswerDto {
    /// An answer of a site as it is sent.
    pub fn new(site: &str, answer: WordAnswer) -> Self {
        let direction = match answer.direction {
            Direction::Same => "same",
            Direction::Opposite => "opposite",
        };
        Self {
            site: site.to_owned(),
            run: answer.run,
            direction: direction.into(),
            words: [answer.words.0, answer.words.1],
            observations: [answer.observations.0, answer.observations.1],
            fit: answer.fit,
            component: answer.in_map.map(|(component, _)| component),
            map_from_middle: answer.in_map.map(|(_, pose)| pose.into()),
        }
    }
}
