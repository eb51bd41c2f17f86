//! The two rivals of the thesis' section 3.3.2.2: sampled beams with ray casting (**bb**, Fox et al. 1999) and the
//! exponentiated cosine similarity of scans (**fcs**, Eqs 3.7 and 3.8). Both cast every sampled beam for every
//! particle.

use serde::{Deserialize, Serialize};

use super::particle_filter::SensorModel;
use super::particles::Particles;
use locution_engine::geometry::Pose2;
use locution_engine::occupancy::cast_ray;
use locution_engine::occupancy::{CellState, GridMap};
use locution_engine::scan::ScanGeometry;

/// Sampling and noise of the beams.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BeamModelConfig {
    /// Angle between sampled beams, radians (thesis: 10°).
    pub beam_spacing_rad: f64,
    /// Beams are cut at this length, metres.
    pub range_max_m: f64,
    /// Deviation of a beam that meets what the map shows, metres.
    pub sigma_m: f64,
    /// Share of beams that do not.
    pub random_share: f64,
    /// Exponent of the cosine similarity (Eq 3.8).
    pub cosine_exponent: i32,
}

impl Default for BeamModelConfig {
    fn default() -> Self {
        Self {
            beam_spacing_rad: 10f64.to_radians(),
            range_max_m: 9.0,
            sigma_m: 0.3,
            random_share: 0.1,
            cosine_exponent: 4,
        }
    }
}

/// How the cast ranges are compared with the sensed ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BeamComparison {
    /// **bb**: every beam by itself, likelihoods multiplied.
    Beams,
    /// **fcs**: the fourth power of the cosine between the two vectors of ranges.
    Cosine,
}

/// A scan's sampled beams against the map.
#[derive(Clone, Debug)]
pub struct BeamModel<'a> {
    map: &'a GridMap,
    config: &'a BeamModelConfig,
    comparison: BeamComparison,
    robot_from_laser: Pose2,
    /// Angle in the laser's frame and range of every sampled beam, cut at the configured length.
    beams: Vec<(f64, f64)>,
}

impl<'a> BeamModel<'a> {
    /// Samples a scan.
    pub fn new(
        map: &'a GridMap,
        geometry: &ScanGeometry,
        ranges_m: &[f32],
        comparison: BeamComparison,
        config: &'a BeamModelConfig,
    ) -> Self {
        let spacing =
            (config.beam_spacing_rad / geometry.angle_increment_rad.abs()).round().max(1.0) as usize;
        let sample = |(beam_idx, &range_m): (usize, &f32)| {
            let range_m = if geometry.is_return(range_m) { f64::from(range_m) } else { config.range_max_m };
            (geometry.beam_angle_rad(beam_idx), range_m.min(config.range_max_m))
        };
        let beams = ranges_m.iter().enumerate().step_by(spacing).map(sample).collect();
        Self { map, config, comparison, robot_from_laser: geometry.robot_from_laser, beams }
    }

    /// Likelihood of the scan at a pose, not normalised; 0 off the free space.
    fn likelihood(&self, map_from_robot: &Pose2) -> f64 {
        let (column, row) = self.map.cell_at(&map_from_robot.position());
        if self.map.state(column, row) != CellState::Free {
            return 0.0;
        }
        let map_from_laser = map_from_robot.compose(&self.robot_from_laser);
        let expected = self.beams.iter().map(|&(angle, _)| {
            cast_ray(
                self.map,
                &map_from_laser.position(),
                map_from_laser.theta + angle,
                self.config.range_max_m,
            )
        });
        match self.comparison {
            BeamComparison::Beams => {
                expected.zip(&self.beams).map(|(cast, &(_, sensed))| self.beam(cast, sensed)).product()
            }
            BeamComparison::Cosine => self.cosine(expected),
        }
    }

    fn beam(&self, cast_m: f64, sensed_m: f64) -> f64 {
        let hit = (-0.5 * ((cast_m - sensed_m) / self.config.sigma_m).powi(2)).exp();
        (1.0 - self.config.random_share) * hit + self.config.random_share
    }

    fn cosine(&self, expected: impl Iterator<Item = f64>) -> f64 {
        let (mut dot, mut cast_square, mut sensed_square) = (0.0, 0.0, 0.0);
        for (cast, &(_, sensed)) in expected.zip(&self.beams) {
            dot += cast * sensed;
            cast_square += cast * cast;
            sensed_square += sensed * sensed;
        }
        let lengths: f64 = cast_square * sensed_square;
        if lengths > 0.0 { (dot / lengths.sqrt()).powi(self.config.cosine_exponent) } else { 0.0 }
    }
}

impl SensorModel for BeamModel<'_> {
    fn weigh(&self, particles: &mut Particles) {
        for index in 0..particles.len() {
            let pose = particles.pose(index, &self.map.origin());
            particles.weight[index] *= self.likelihood(&pose) as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn geometry() -> ScanGeometry {
        ScanGeometry {
            num_ranges: 3,
            angle_min_rad: -std::f64::consts::FRAC_PI_2,
            angle_increment_rad: std::f64::consts::FRAC_PI_2,
            range_max_m: 20.0,
            robot_from_laser: Pose2::identity(),
        }
    }

    #[test]
    fn the_right_place_weighs_most() {
        let map = GridMap::drawn(&["######", "#....#", "#....#", "#.####", "#.####", "######"], 0.5);
        let config = BeamModelConfig::default();
        // In the dead end below, looking up.
        let ranges_m = [0.25, 1.75, 0.25];
        for comparison in [BeamComparison::Beams, BeamComparison::Cosine] {
            let model = BeamModel::new(&map, &geometry(), &ranges_m, comparison, &config);
            let right = model.likelihood(&Pose2::new(0.75, 0.75, std::f64::consts::FRAC_PI_2));
            assert!((right - 1.0).abs() < 1e-9, "{comparison:?}: {right}");
            assert!(model.likelihood(&Pose2::new(1.75, 2.0, 0.0)) < right, "{comparison:?}");
            assert_eq!(model.likelihood(&Pose2::new(0.1, 0.1, 0.0)), 0.0, "{comparison:?}: in the wall");
        }
    }

    #[test]
    fn one_wrong_beam_costs_its_likelihood() {
        let map = GridMap::drawn(&["######", "#....#", "######"], 0.5);
        let config = BeamModelConfig { sigma_m: 0.5, random_share: 0.25, ..Default::default() };
        let model = BeamModel::new(&map, &geometry(), &[0.25, 1.25, 0.25], BeamComparison::Beams, &config);
        let half_a_meter_off = model.likelihood(&Pose2::new(0.75, 0.75, 0.0));
        assert!((half_a_meter_off - (0.75 * (-0.5f64).exp() + 0.25)).abs() < 1e-9, "{half_a_meter_off}");
    }
}
