//! Segments of a run where the density starts or stops to vary (thesis section 6.4, first part).
//!
//! The density of the thesis is smoothed with a mean filter. It says neither how wide the filter is nor when density
//! "varies"; both are settings here. A density varies where it changes by more than a limit within a short window.

use serde::{Deserialize, Serialize};

use crate::config_error::ConfigError;
use crate::geometry::wrap_angle;
use crate::text::Observation;

/// How a run is cut into segments.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SegmentationConfig {
    /// Which of the observations' densities is looked at.
    pub kernel_idx: usize,
    /// The mean filter reaches over this many observations before and after.
    pub filter_reach: usize,
    /// Variation is looked for this many observations before and after.
    pub variation_reach: usize,
    /// The density varies where it changes by more than this within the window.
    pub variation_min: f64,
}

impl Default for SegmentationConfig {
    fn default() -> Self {
        Self { kernel_idx: 0, filter_reach: 5, variation_reach: 5, variation_min: 0.05 }
    }
}

impl SegmentationConfig {
    /// Checks every value; `path` is the name of this part in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        for (field, value, highest) in [
            ("kernel_idx", self.kernel_idx as f64, 7.0),
            ("filter_reach", self.filter_reach as f64, 1000.0),
            ("variation_reach", self.variation_reach as f64, 1000.0),
            ("variation_min", self.variation_min, 1.0),
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
}

/// A segment and the features that its label is decided by.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// First and last observation, both inclusive.
    pub observations: (usize, usize),
    /// Largest less smallest smoothed density.
    pub density_variation: f64,
    /// Largest smoothed density.
    pub density_max: f64,
    /// Mean number of free-space frontiers.
    pub mean_frontiers: f64,
    /// Size of the word's turn a (thesis Algorithm 4.3), radians.
    pub turn_rad: f64,
}

impl Segment {
    /// Number of observations.
    pub fn len(&self) -> usize {
        self.observations.1 - self.observations.0 + 1
    }

    /// Never: a segment has an observation.
    pub fn is_empty(&self) -> bool {
        false
    }
}

/// Cuts a run wherever its smoothed density starts or stops to vary. O(n).
pub fn segments(config: &SegmentationConfig, observations: &[Observation]) -> Vec<Segment> {
    let raw: Vec<f64> = observations
        .iter()
        .map(|observation| f64::from(observation.densities.get(config.kernel_idx).copied().unwrap_or(0.0)))
        .collect();
    let smooth: Vec<f64> =
        (0..raw.len()).map(|at| mean(window(&raw, at, config.filter_reach).iter().copied())).collect();
    let varies: Vec<bool> = (0..smooth.len())
        .map(|at| range(window(&smooth, at, config.variation_reach)).0 > config.variation_min)
        .collect();
    let mut segments = Vec::new();
    let mut first = 0;
    for at in 0..varies.len() {
        if at + 1 == varies.len() || varies[at + 1] != varies[at] {
            segments.push(describe(observations, &smooth, first, at));
            first = at + 1;
        }
    }
    segments
}

fn describe(observations: &[Observation], smooth: &[f64], first: usize, last: usize) -> Segment {
    let (density_variation, density_max) = range(&smooth[first..=last]);
    let frontiers = observations[first..=last].iter().map(|observation| f64::from(observation.num_frontiers));
    Segment {
        observations: (first, last),
        density_variation,
        density_max,
        mean_frontiers: mean(frontiers),
        turn_rad: turn(observations, first, last),
    }
}

/// Heading from the median to the last position less heading from the first to the median, as in a word.
fn turn(observations: &[Observation], first: usize, last: usize) -> f64 {
    let at = |idx: usize| observations[idx].run_from_robot.position();
    let (start, median, end) = (at(first), at((first + last) / 2), at(last));
    if start.distance(&median) < 1e-9 || median.distance(&end) < 1e-9 {
        return 0.0;
    }
    let entering = (median.y - start.y).atan2(median.x - start.x);
    let leaving = (end.y - median.y).atan2(end.x - median.x);
    wrap_angle(leaving - entering).abs()
}

fn window(values: &[f64], at: usize, reach: usize) -> &[f64] {
    &values[at.saturating_sub(reach)..(at + reach + 1).min(values.len())]
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, count), value| (sum + value, count + 1));
    sum / count.max(1) as f64
}

/// Largest less smallest, and the largest.
fn range(values: &[f64]) -> (f64, f64) {
    let lowest = values.iter().copied().fold(f64::INFINITY, f64::min);
    let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (highest - lowest, highest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose2;

    fn observation(x: f64, y: f64, density: f32) -> Observation {
        Observation {
            scan_seq: 0,
            timestamp_ns: 0,
            travel_m: 0.0,
            odom_from_robot: Pose2::new(x, y, 0.0),
            run_from_robot: Pose2::new(x, y, 0.0),
            densities: vec![density],
            is_hard: true,
            num_frontiers: 2,
        }
    }

    #[test]
    fn cuts_where_the_density_starts_and_stops_to_vary() {
        let config = SegmentationConfig { filter_reach: 0, variation_reach: 1, ..Default::default() };
        let densities = [0.4, 0.4, 0.4, 0.4, 0.5, 0.6, 0.5, 0.4, 0.4, 0.4, 0.4];
        let observations: Vec<Observation> =
            densities.iter().enumerate().map(|(idx, &d)| observation(idx as f64, 0.0, d)).collect();
        let cuts: Vec<(usize, usize)> =
            segments(&config, &observations).iter().map(|segment| segment.observations).collect();
        assert_eq!(cuts, [(0, 2), (3, 7), (8, 10)]);
        let bump = &segments(&config, &observations)[1];
        assert!((bump.density_variation - 0.2).abs() < 1e-6 && (bump.density_max - 0.6).abs() < 1e-6);
        assert_eq!((bump.mean_frontiers, bump.turn_rad, bump.len()), (2.0, 0.0, 5));
    }

    #[test]
    fn a_right_angle_turns_by_a_quarter() {
        let config = SegmentationConfig::default();
        let corner = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (2.0, 2.0)];
        let observations: Vec<Observation> = corner.iter().map(|&(x, y)| observation(x, y, 0.5)).collect();
        let found = segments(&config, &observations);
        assert_eq!(found.len(), 1);
        assert!((found[0].turn_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
        assert!(segments(&config, &[]).is_empty());
    }
}
