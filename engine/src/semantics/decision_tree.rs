//! The decision tree of the thesis (Figure 6.8 with Table 6.4): a label for each segment of one run.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::label::PlaceLabel;
use super::segmentation::{Segment, SegmentationConfig, segments};
use crate::config_error::ConfigError;
use crate::text::Observation;

/// Thresholds of Table 6.4.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DecisionTreeConfig {
    /// How a run is cut into segments.
    pub segmentation: SegmentationConfig,
    /// Density varies little up to this.
    pub density_variation_high: f64,
    /// Density is high above this.
    pub density_high: f64,
    /// Few frontiers below this.
    pub frontiers_low: f64,
    /// Many frontiers above this.
    pub frontiers_high: f64,
    /// A very large turn is above this, radians.
    pub turn_very_high_rad: f64,
    /// A small turn is below this, radians.
    pub turn_low_rad: f64,
    /// A segment of more observations is very long.
    pub length_very_long: usize,
}

impl Default for DecisionTreeConfig {
    fn default() -> Self {
        Self {
            segmentation: SegmentationConfig::default(),
            density_variation_high: 0.1,
            density_high: 0.8,
            frontiers_low: 1.5,
            frontiers_high: 2.3,
            turn_very_high_rad: 120.0 / 180.0 * PI,
            turn_low_rad: 20.0 / 180.0 * PI,
            length_very_long: 100,
        }
    }
}

impl DecisionTreeConfig {
    /// Checks every value; `path` is the name of this part in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        self.segmentation.validate(&format!("{path}.segmentation"))?;
        for (field, value, highest) in [
            ("density_variation_high", self.density_variation_high, 1.0),
            ("density_high", self.density_high, 1.0),
            ("frontiers_low", self.frontiers_low, 100.0),
            ("frontiers_high", self.frontiers_high, 100.0),
            ("turn_very_high_rad", self.turn_very_high_rad, PI),
            ("turn_low_rad", self.turn_low_rad, PI),
        ] {
            if !(0.0..=highest).contains(&value) {
                return Err(ConfigError::new(
                    format!("{path}.{field}"),
                    format!("must lie in 0..={highest}"),
                ));
            }
        }
        Ok(())
    }

    /// The label of a segment (Figure 6.8).
    pub fn classify(&self, segment: &Segment) -> PlaceLabel {
        if segment.len() > self.length_very_long || segment.density_variation <= self.density_variation_high {
            PlaceLabel::Corridor
        } else if segment.mean_frontiers < self.frontiers_low {
            if segment.density_max > self.density_high { PlaceLabel::Hall } else { PlaceLabel::Corridor }
        } else if segment.mean_frontiers > self.frontiers_high {
            PlaceLabel::Bifurcation
        } else if segment.turn_rad > self.turn_very_high_rad {
            PlaceLabel::DeadEnd
        } else if segment.turn_rad < self.turn_low_rad {
            PlaceLabel::Corridor
        } else {
            PlaceLabel::Corner
        }
    }
}

/// Labels every observation of one run as the thesis does: cut, then classify.
pub fn label_by_tree(config: &DecisionTreeConfig, observations: &[Observation]) -> Vec<PlaceLabel> {
    segments(&config.segmentation, observations)
        .iter()
        .flat_map(|segment| std::iter::repeat_n(config.classify(segment), segment.len()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn segment(len: usize, variation: f64, max: f64, frontiers: f64, turn_deg: f64) -> Segment {
        Segment {
            observations: (0, len - 1),
            density_variation: variation,
            density_max: max,
            mean_frontiers: frontiers,
            turn_rad: turn_deg / 180.0 * PI,
        }
    }

    #[test]
    fn every_leaf_of_the_tree_is_reached() {
        let tree = DecisionTreeConfig::default();
        let label = |segment: Segment| tree.classify(&segment);
        assert_eq!(label(segment(101, 0.5, 0.9, 3.0, 90.0)), PlaceLabel::Corridor);
        assert_eq!(label(segment(50, 0.1, 0.9, 3.0, 90.0)), PlaceLabel::Corridor);
        assert_eq!(label(segment(50, 0.3, 0.9, 1.2, 90.0)), PlaceLabel::Hall);
        assert_eq!(label(segment(50, 0.3, 0.7, 1.2, 90.0)), PlaceLabel::Corridor);
        assert_eq!(label(segment(50, 0.3, 0.7, 2.5, 90.0)), PlaceLabel::Bifurcation);
        assert_eq!(label(segment(50, 0.3, 0.7, 2.0, 130.0)), PlaceLabel::DeadEnd);
        assert_eq!(label(segment(50, 0.3, 0.7, 2.0, 10.0)), PlaceLabel::Corridor);
        assert_eq!(label(segment(50, 0.3, 0.7, 2.0, 90.0)), PlaceLabel::Corner);
    }
}
