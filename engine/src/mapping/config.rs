//! Settings of the map builder.

use serde::{Deserialize, Serialize};

use super::changes::ChangesConfig;
use crate::config_error::ConfigError;
use crate::pose_graph::{ConsistencyConfig, PoseGraphConfig, RobustConfig};
use crate::registration::SubmapConfig;
use crate::retrieval::RetrievalConfig;

/// Everything that decides how runs become a map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MappingConfig {
    /// Profile candidates.
    pub retrieval: RetrievalConfig,
    /// Submap against submap.
    pub submap: SubmapConfig,
    /// Least squares.
    pub pose_graph: PoseGraphConfig,
    /// How constraints that may be wrong are weighed.
    pub robust: RobustConfig,
    /// Which registrations between two runs hold together.
    pub consistency: ConsistencyConfig,
    /// What counts as changed between two sessions.
    pub changes: ChangesConfig,
    /// Travel between the anchors of submaps, metres.
    pub anchor_spacing_m: f64,
    /// Travel before and behind an anchor whose scans make its submap, metres.
    pub submap_half_length_m: f64,
    /// At most this many scans make a submap.
    pub max_submap_scans: usize,
    /// Standard deviation of the refined odometry's place per metre, metres.
    pub drift_per_m: f64,
    /// Standard deviation of its heading after one metre; grows with the square root of the distance, radians.
    pub drift_turn_rad: f64,
    /// Standard deviation of its heading after one radian of turning.
    pub drift_turn_per_rad: f64,
    /// Standard deviation that every registration has at least, metres.
    pub fit_floor_m: f64,
    /// … and radians.
    pub fit_floor_rad: f64,
    /// Share of opinions that must agree for submaps to fit.
    pub min_agreement: f64,
    /// Between two runs submaps also fit when this share of the opinions about one of them agrees.
    pub min_one_way_agreement: f64,
    /// Share of the returns about which the other submap must have an opinion.
    pub min_overlap: f64,
    /// Travel that must lie between two places of one run, metres.
    pub min_gap_m: f64,
    /// Drives that run this close beside each other in the map are matched, metres.
    pub beside_m: f64,
    /// Neighbours within this distance in the map are registered, metres.
    #[serde(alias = "neighbour_distance_m")]
    pub neighbor_distance_m: f64,
    /// Widest search around the predicted place, metres.
    pub max_search_m: f64,
    /// Widest search around the predicted heading, radians.
    pub max_search_turn_rad: f64,
    /// Of all passes of one run beside a place of it the nearest so many are registered with it …
    pub max_passes: usize,
    /// … and of all passes of other runs so many.
    pub max_other_passes: usize,
    /// Passes of each direction beside a place with which a visit to it is matched, those first that were registered.
    pub max_matched_passes: usize,
    /// Rounds of guided matching at most.
    pub max_rounds: usize,
    /// A registration is refused when its squared deviations from the prediction exceed this.
    pub max_chi2: f64,
    /// Fits that must support a fit when the place was uncertain.
    pub min_support: usize,
    /// Anchors of one run that must fit another before the two share a map.
    pub min_joining_anchors: usize,
    /// Share of the tried anchors that must fit for that.
    pub min_joining_share: f64,
    /// Largest standard deviation of the place of one run in the other, metres.
    pub max_joining_sd_m: f64,
    /// Another way to join the same two maps counts when it fits at this share of the anchors or more.
    pub max_ambiguity: f64,
    /// Runs of a generation: when it is full its poses stay, and what follows is laid over them.
    pub generation_runs: usize,
    /// Profile candidates of two runs that are registered, the best first.
    pub max_candidates_per_pair: usize,
    /// Anchors whose registrations must agree before a joined map is tried.
    pub min_seeds: usize,
    /// Groups of candidates that agree, of every two maps, of which some are registered.
    pub max_ways: usize,
    /// Candidates of a group that are registered.
    pub max_probes: usize,
    /// Ways to join two maps that are tried.
    pub max_hypotheses: usize,
    /// Share of the returns of one map that another may contradict where they overlap, in the direction in which it is
    /// less: furniture that came or went shows in one direction only, another building in both.
    pub max_contradiction: f64,
    /// … or this many times the share in which the one of the two that contradicts itself less does so.
    pub max_contradiction_over_own: f64,
    /// A wrong way to lay a run over itself forbids a join when it reaches at least this share of the join's length …
    pub min_reach_over_null: f64,
    /// … and is contradicted at most this many times as much; so does another way to join the same two.
    pub null_slack: f64,
}

impl Default for MappingConfig {
    fn default() -> Self {
        Self {
            retrieval: RetrievalConfig { query_step_m: 2.0, ..RetrievalConfig::default() },
            submap: SubmapConfig::default(),
            pose_graph: PoseGraphConfig::default(),
            robust: RobustConfig {
                inlier_chi2_max: 16.0,
                max_reweightings: 100,
                // Guided matching has already asked for support.
                support_steps_max: 0,
                ..RobustConfig::default()
            },
            consistency: ConsistencyConfig::default(),
            changes: ChangesConfig::default(),
            anchor_spacing_m: 2.0,
            submap_half_length_m: 4.0,
            max_submap_scans: 50,
            drift_per_m: 0.012,
            drift_turn_rad: 0.004,
            drift_turn_per_rad: 0.01,
            fit_floor_m: 0.02,
            fit_floor_rad: 0.003,
            min_agreement: 0.8,
            min_one_way_agreement: 0.9,
            min_overlap: 0.25,
            min_gap_m: 10.0,
            beside_m: 1.1,
            neighbor_distance_m: 5.0,
            max_search_m: 5.0,
            max_search_turn_rad: 0.4,
            max_passes: 8,
            max_other_passes: 3,
            max_matched_passes: 2,
            max_rounds: 8,
            max_chi2: 16.0,
            min_support: 2,
            min_joining_anchors: 12,
            min_joining_share: 0.7,
            max_joining_sd_m: 0.2,
            max_ambiguity: 0.7,
            generation_runs: 10,
            max_candidates_per_pair: 600,
            min_seeds: 2,
            max_ways: 12,
            max_probes: 12,
            max_hypotheses: 5,
            max_contradiction: 0.045,
            max_contradiction_over_own: 1.4,
            min_reach_over_null: 0.7,
            null_slack: 1.25,
        }
    }
}

impl MappingConfig {
    /// Checks every value; `path` is this struct's own path.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        self.retrieval.validate(&format!("{path}.retrieval"))?;
        self.submap.validate(&format!("{path}.submap"))?;
        self.pose_graph.validate(&format!("{path}.pose_graph"))?;
        self.robust.validate(&format!("{path}.robust"))?;
        self.consistency.validate(&format!("{path}.consistency"))?;
        self.changes.validate(&format!("{path}.changes"))?;
        if self.generation_runs == 0 {
            return Err(ConfigError::new(format!("{path}.generation_runs"), "must be at least 1"));
        }
        let positive = [
            ("anchor_spacing_m", self.anchor_spacing_m),
            ("submap_half_length_m", self.submap_half_length_m),
            ("drift_per_m", self.drift_per_m),
            ("drift_turn_rad", self.drift_turn_rad),
            ("fit_floor_m", self.fit_floor_m),
            ("fit_floor_rad", self.fit_floor_rad),
            ("beside_m", self.beside_m),
            ("neighbour_distance_m", self.neighbor_distance_m),
            ("max_search_m", self.max_search_m),
            ("max_search_turn_rad", self.max_search_turn_rad),
            ("max_chi2", self.max_chi2),
        ];
        for (field, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(ConfigError::new(format!("{path}.{field}"), "must be a positive number"));
            }
        }
        Ok(())
    }
}
