//! Figures 3.5 and 3.6: one particle filter, one drive, the error after every step.
//!
//! The caller makes the steps, so that it can time them; nothing here looks at a clock.

use super::{
    BeamComparison, BeamModel, BeamModelConfig, DensityFieldConfig, DensityModel, DensityModelConfig,
    GridMap, ParticleFilter, ParticleFilterConfig, RecoveryConfig, ServedMap, observe,
};
use crate::geometry::Pose2;
use crate::grid::{LocalMap, LocalMapConfig};
use crate::scan::{Scan, ScanGeometry};

/// What weighs the particles.
#[derive(Clone, Debug, PartialEq)]
pub enum FilterSensor {
    /// Free-space densities, compared as the map's fields were made.
    Densities(DensityFieldConfig),
    /// Sampled beams (**bb**) or the cosine of scans (**fcs**).
    Beams(BeamComparison),
}

/// A global localisation under way.
#[derive(Clone, Debug)]
pub struct FilterTrial<'a> {
    map: &'a ServedMap,
    geometry: ScanGeometry,
    sensor: FilterSensor,
    filter: ParticleFilter,
    local_map: LocalMap,
    beams: BeamModelConfig,
    last_odom_from_robot: Option<Pose2>,
}

impl<'a> FilterTrial<'a> {
    /// Particles all over the map. As in section 3.3.2.1, a filter that diverges is not helped.
    pub fn new(
        map: &'a ServedMap,
        geometry: &ScanGeometry,
        sensor: FilterSensor,
        num_particles: usize,
        seed: u64,
    ) -> Self {
        let config = ParticleFilterConfig {
            num_particles,
            recovery: RecoveryConfig { fast: 0.0, ..Default::default() },
            ..Default::default()
        };
        Self {
            map,
            geometry: geometry.clone(),
            sensor,
            filter: ParticleFilter::global(map, config, seed),
            local_map: LocalMap::new(&LocalMapConfig::default(), geometry),
            beams: BeamModelConfig::default(),
            last_odom_from_robot: None,
        }
    }

    /// One iteration of the filter: local map, density where it is needed, prediction, weights, resampling.
    pub fn step(&mut self, scan: &Scan) {
        let last = self.last_odom_from_robot.replace(scan.odom_from_robot);
        let motion = last.map_or(Pose2::identity(), |last| last.between(&scan.odom_from_robot));
        match &self.sensor {
            FilterSensor::Densities(fields) => {
                self.local_map.integrate_scan(&scan.ranges_m, &scan.odom_from_robot);
                let widest_m = fields.bandwidths_m.iter().copied().fold(0.0, f64::max);
                let seen = GridMap::around_robot(&self.local_map, widest_m + 0.5)
                    .map(|around| observe(&around, &scan.odom_from_robot, fields))
                    .unwrap_or_default();
                let model = DensityModel::new(&self.map.density, &seen, &DensityModelConfig::default());
                self.filter.update(self.map, &motion, &model);
            }
            FilterSensor::Beams(comparison) => {
                let model =
                    BeamModel::new(&self.map.grid, &self.geometry, &scan.ranges_m, *comparison, &self.beams);
                self.filter.update(self.map, &motion, &model);
            }
        }
    }

    /// Mean distance of the particles from where the robot truly is, metres: it falls to nothing only when all of
    /// them have found the place.
    pub fn mean_error_m(&self, map_from_robot: &Pose2) -> f64 {
        let particles = self.filter.particles();
        let origin = self.map.grid.origin();
        let sum: f64 =
            (0..particles.len()).map(|index| particles.pose(index, &origin).distance(map_from_robot)).sum();
        sum / particles.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point2;
    use crate::localization::{CellState, LikelihoodFieldConfig};
    use crate::simulation::{SimulationConfig, Task, World, simulate_run};

    /// An L of two corridors of different width, 0.1 m cells.
    fn is_free(column: i64, row: i64) -> bool {
        let in_wide = (5..125).contains(&column) && (5..35).contains(&row);
        let in_narrow = (5..23).contains(&column) && (5..85).contains(&row);
        in_wide || in_narrow
    }

    #[test]
    fn every_sensor_can_be_tried_and_the_seed_repeats_it() {
        let cells: Vec<bool> = (0..130 * 90).map(|cell| is_free(cell % 130, cell / 130)).collect();
        let states =
            cells.iter().map(|&free| if free { CellState::Free } else { CellState::Occupied }).collect();
        let grid = GridMap::new(130, 0.1, Point2::default(), states).expect("the cells fill whole rows");
        let fields = DensityFieldConfig { bandwidths_m: vec![1.5, 3.0], ..Default::default() };
        let map = ServedMap::build(grid, &fields, &LikelihoodFieldConfig::default());
        let world = World::new(130, 90, 0.1, Point2::default(), cells).expect("there is floor");
        let route = [(11.5, 2.0), (1.4, 2.0), (1.4, 7.5)].map(|(x, y)| Point2::new(x, y));
        let run = simulate_run(&world, &Task::Route(route.to_vec()), &SimulationConfig::default(), 3)
            .expect("the route can be driven");
        let sensors = [
            (FilterSensor::Densities(fields), 4000),
            (FilterSensor::Beams(BeamComparison::Beams), 300),
            (FilterSensor::Beams(BeamComparison::Cosine), 300),
        ];
        for (sensor, num_particles) in sensors {
            let errors_of = || {
                let mut trial = FilterTrial::new(&map, &run.geometry, sensor.clone(), num_particles, 5);
                let step = |(scan, truth): (&Scan, &crate::formats::TruthPose)| {
                    trial.step(scan);
                    trial.mean_error_m(&truth.truth_from_robot)
                };
                run.scans.iter().zip(&run.truth).map(step).collect::<Vec<f64>>()
            };
            let errors = errors_of();
            if matches!(sensor, FilterSensor::Densities(_)) {
                let last = errors[errors.len() - 1];
                assert!(last < errors[0], "from {} to {last}", errors[0]);
            }
            assert!(errors.iter().all(|error| error.is_finite()), "{sensor:?}");
            assert_eq!(errors_of(), errors);
        }
    }
}
