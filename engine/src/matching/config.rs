//! Configuration of this room.

use serde::{Deserialize, Serialize};

use crate::config_error::ConfigError;
use crate::index::WordTolerance;

/// When stretches of text match.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MatchingConfig {
    /// When two words match.
    pub tolerance: WordTolerance,
    /// Words a chain needs, by the highest level of words it may use: entry l is for levels 0 to l, and the number of
    /// entries is the number of levels searched (7, 10, 13 by SPEC 3.10).
    pub min_chain_words: Vec<u16>,
    /// Fewest words of a chain that the automatic threshold looks at.
    pub min_surprising_words: u16,
    /// Largest E-value of an automatically accepted chain: as many false ones are expected per run and direction.
    pub max_chance_matches: f64,
    /// Observations that must lie between two matched words of one run (SPEC 3.10); 100 are 10 m of travel.
    pub min_gap_observations: u32,
    /// δ_max: farthest shift tried when matched words are aligned by density, in observations (Eq 5.3).
    pub alignment_reach_observations: u32,
    /// Distance of the pairs of observations that a match is turned into, in observations (thesis 5.2.4).
    pub node_spacing_observations: u32,
}

impl Default for MatchingConfig {
    fn default() -> Self {
        Self {
            tolerance: WordTolerance::default(),
            min_chain_words: vec![7, 10, 13],
            min_surprising_words: 3,
            max_chance_matches: 0.1,
            min_gap_observations: 100,
            alignment_reach_observations: 15,
            node_spacing_observations: 5,
        }
    }
}

impl MatchingConfig {
    /// Checks every value.
    ///
    /// # Errors
    /// The first field that cannot work, by its path.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        self.tolerance.validate(&format!("{path}.tolerance"))?;
        if self.min_chain_words.is_empty() || self.min_chain_words.len() > 8 {
            return Err(ConfigError::new(format!("{path}.min_chain_words"), "needs one to eight entries"));
        }
        if self.min_surprising_words == 0 {
            return Err(ConfigError::new(format!("{path}.min_surprising_words"), "must be at least 1"));
        }
        if !(self.max_chance_matches > 0.0 && self.max_chance_matches.is_finite()) {
            return Err(ConfigError::new(format!("{path}.max_chance_matches"), "must be positive"));
        }
        if self.min_chain_words.contains(&0) {
            return Err(ConfigError::new(format!("{path}.min_chain_words"), "a chain has at least one word"));
        }
        if self.node_spacing_observations == 0 {
            return Err(ConfigError::new(format!("{path}.node_spacing_observations"), "must be at least 1"));
        }
        if self.alignment_reach_observations > 10_000 {
            return Err(ConfigError::new(
                format!("{path}.alignment_reach_observations"),
                "must be at most 10000",
            ));
        }
        Ok(())
    }
}
