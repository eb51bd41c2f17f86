//! Maps and matches on the wire.

use locution_engine::mapping::{Channel, Direction, MatchState, PlaceMatch};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::common::PoseDto;
use crate::app::maps::{MatchFilter, MatchStateKind, NumberedMatch};
use crate::error::ApiError;
use crate::records::{MapRecord, MapRun};

/// Which map.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct MapParams {
    /// The version; the serving one unless said.
    pub version: Option<u64>,
    /// The component; for grids the first unless said, elsewhere all.
    pub component: Option<u32>,
}

/// A map version.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct MapDto {
    /// Its number.
    pub version: u64,
    /// Versions that can be asked for, oldest first.
    pub versions: Vec<u64>,
    /// Parts that nothing connects, each with a frame of its own.
    pub components: Vec<ComponentDto>,
    /// Runs with the poses of their keyframes.
    pub runs: Vec<MapRunDto>,
    /// Regions of equal density along the runs.
    pub regions: Vec<RegionDto>,
    /// Which regions are beside which, by position in `regions`.
    pub connections: Vec<ConnectionDto>,
    /// Figures.
    pub statistics: MapStatisticsDto,
}

/// A part of the map with a frame of its own.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct ComponentDto {
    /// Its number.
    pub component: u32,
    /// Runs in it.
    pub runs: Vec<String>,
}

/// A run in the map.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct MapRunDto {
    /// Its name.
    pub run: String,
    /// The component whose frame the poses are in.
    pub component: u32,
    /// Scans it had when the map was built.
    pub num_scans: u64,
    /// Metres driven.
    pub length_m: f64,
    /// Poses of its keyframes.
    pub poses: Vec<KeyframePoseDto>,
}

/// The pose of a keyframe in the map.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, ToSchema)]
pub struct KeyframePoseDto {
    /// Sequence number of its scan.
    pub scan_seq: u64,
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
    /// Radians.
    pub theta: f64,
}

/// A stretch of driving with one density class: a word, placed in the map.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct RegionDto {
    /// Component.
    pub component: u32,
    /// The run that drove it.
    pub run: String,
    /// Number of the word of level 0.
    pub word: u32,
    /// Density class.
    pub class: u8,
    /// Metres along it.
    pub length_m: f64,
    /// Radians turned in it.
    pub turn_rad: f64,
    /// Its middle, in the component's frame.
    pub map_from_middle: PoseDto,
}

/// Two regions beside one another.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, ToSchema)]
pub struct ConnectionDto {
    /// Position in `regions`.
    pub from: usize,
    /// Position in `regions`.
    pub to: usize,
    /// `driven`: one follows the other; `same_place`: a verified match joins them.
    #[schema(example = "driven")]
    pub kind: ConnectionKindDto,
}

/// Why two regions are connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ConnectionKindDto {
    /// The robot drove from one into the other.
    Driven,
    /// A verified match says that they are the same place.
    SamePlace,
}

/// Figures of a map.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct MapStatisticsDto {
    /// Matches, whatever became of them.
    pub num_matches: u64,
    /// Matches that hold the map together.
    pub num_verified: u64,
    /// Keyframes.
    pub num_keyframes: u64,
    /// Metres driven by all runs.
    pub length_m: f64,
    /// Seconds that building took.
    pub duration_s: f64,
}

impl MapStatisticsDto {
    /// Sums over the runs.
    pub fn of(map: &MapRecord) -> Self {
        Self {
            num_matches: map.num_matches,
            num_verified: map.num_verified,
            num_keyframes: map.runs.iter().map(|run| run.num_poses).sum(),
            length_m: map.runs.iter().map(|run| run.length_m).sum(),
            duration_s: map.duration_s,
        }
    }
}

/// Components with the names of their runs.
pub fn components_of(map: &MapRecord) -> Vec<ComponentDto> {
    let runs_of = |component: u32| {
        let is_in = move |run: &&MapRun| run.component == component && run.num_poses > 0;
        map.runs.iter().filter(is_in).map(|run| run.name.clone()).collect::<Vec<_>>()
    };
    (0..map.num_components)
        .map(|component| ComponentDto { component, runs: runs_of(component) })
        .filter(|component| !component.runs.is_empty())
        .collect()
}

/// Which matches to list.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct MatchParams {
    /// `candidate`, `verified` or `rejected`.
    pub state: Option<String>,
    /// `words`, `profile` or `spatial`.
    pub channel: Option<String>,
    /// `same` or `opposite`.
    pub direction: Option<String>,
    /// Name of a run that takes part.
    pub run: Option<String>,
    /// Version of the map; the serving one unless said.
    pub version: Option<u64>,
    /// Most items to answer; 100 unless said, at most 10000.
    pub limit: Option<usize>,
    /// `next_cursor` of the page before.
    pub cursor: Option<String>,
}

impl MatchParams {
    /// The filter, with the run's number already looked up.
    ///
    /// # Errors
    /// 422 for a word that is none of the choices.
    pub fn filter(&self, run: Option<u32>) -> Result<MatchFilter, ApiError> {
        Ok(MatchFilter {
            state: one_of("state", self.state.as_deref(), STATES)?,
            channel: one_of("channel", self.channel.as_deref(), CHANNELS)?,
            direction: one_of("direction", self.direction.as_deref(), DIRECTIONS)?,
            run,
        })
    }
}

/// Values with their spelling.
type Spelling<T> = &'static [(T, &'static str)];

const STATES: Spelling<MatchStateKind> = &[
    (MatchStateKind::Candidate, "candidate"),
    (MatchStateKind::Verified, "verified"),
    (MatchStateKind::Rejected, "rejected"),
];
const CHANNELS: Spelling<Channel> =
    &[(Channel::Words, "words"), (Channel::Profile, "profile"), (Channel::Spatial, "spatial")];
const DIRECTIONS: Spelling<Direction> = &[(Direction::Same, "same"), (Direction::Opposite, "opposite")];

fn one_of<T: Copy>(field: &str, word: Option<&str>, choices: Spelling<T>) -> Result<Option<T>, ApiError> {
    let Some(word) = word else { return Ok(None) };
    let chosen = choices.iter().find(|(_, spelled)| *spelled == word).map(|(value, _)| Some(*value));
    chosen.ok_or_else(|| {
        let words: Vec<&str> = choices.iter().map(|(_, spelled)| *spelled).collect();
        ApiError::invalid(field, format!("one of {}", words.join(", ")))
    })
}

fn spelled<T: PartialEq>(value: &T, choices: Spelling<T>) -> String {
    let known = choices.iter().find(|(choice, _)| choice == value);
    known.map(|(_, spelled)| (*spelled).to_owned()).expect("every value has its spelling in the table")
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
    /// `same` or `opposite`.
    pub direction: String,
    /// What found it: `words`, `profile` or `spatial`.
    pub channel: String,
    /// What speaks for and against it: bits, expected_chance_matches, shape_residual_m, density_correlation,
    /// ambiguity, registration.
    #[schema(value_type = Object)]
    pub evidence: serde_json::Value,
    /// Probability that it is right, from 0 to 1.
    pub probability: f64,
    /// `candidate`, `verified` or `rejected`.
    pub state: String,
    /// Why it was rejected.
    pub reason: Option<String>,
    /// What a person said of this pair of places; it counts at the next build.
    pub decision: Option<DecisionKindDto>,
}

impl MatchDto {
    /// A match, with the runs by name.
    pub fn new(numbered: NumberedMatch, map: &MapRecord) -> Self {
        let found: &PlaceMatch = &numbered.found;
        let interval = |interval: &locution_engine::mapping::Interval| IntervalDto {
            run: map.runs.get(interval.run_idx as usize).map(|run| run.name.clone()).unwrap_or_default(),
            first: interval.first,
            last: interval.last,
        };
        let reason = match &found.state {
            MatchState::Rejected(reason) => serde_json::to_value(reason).ok(),
            _ => None,
        };
        Self {
            id: numbered.id.to_string(),
            earlier: interval(&found.earlier),
            later: interval(&found.later),
            direction: spelled(&found.direction, DIRECTIONS),
            channel: spelled(&found.channel, CHANNELS),
            evidence: serde_json::to_value(&found.evidence).unwrap_or_default(),
            probability: found.probability,
            state: spelled(&MatchStateKind::from(&found.state), STATES),
            reason: reason.and_then(|reason| reason.as_str().map(str::to_owned)),
            decision: numbered.decision.map(|is_same_place| match is_same_place {
                true => DecisionKindDto::Confirm,
                false => DecisionKindDto::Veto,
            }),
        }
    }
}
