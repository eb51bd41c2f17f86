//! Figures 3.5 and 3.6: one particle filter, one drive, the error after every step.
//!
//! The caller makes the steps, so that it can time them; nothing here looks at a clock.

use super::{
    BeamComparison, BeamModel, BeamModelConfig, DensityModel, DensityModelConfig, FieldMap, ParticleFilter,
    ParticleFilterConfig, RecoveryConfig,
};
use crate::density_field::{DensityFieldConfig, KernelReading, observe};
use locution_engine::geometry::Pose2;
use locution_engine::grid::{LocalMap, LocalMapConfig};
use locution_engine::occupancy::GridMap;
use locution_engine::scan::{Scan, ScanGeometry};

/// What weighs the particles.
#[derive(Clone, Debug, PartialEq)]
pub enum FilterSensor {
    /// Free-space densities, compared as the map's fields were made.
    Densities(DensityFieldConfig),
    /// Sampled beams (**bb**) or the cosine of scans (**fcs**).
    Beams(BeamComparison),
}

/// What the robot knows after a step, whatever the filter that uses it.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensed {
    /// Odometry since the last step.
    pub previous_from_robot: Pose2,
    /// Its own densities, one per kernel; none for beams.
    pub readings: Vec<KernelReading>,
}

/// The robot's side of a localisation: odometry, local map and densities, the same for every seed.
#[derive(Clone, Debug)]
pub struct FilterSenses {
    fields: Option<DensityFieldConfig>,
    local_map: LocalMap,
    last_odom_from_robot: Option<Pose2>,
}

impl FilterSenses {
    /// A robot that has seen nothing yet.
    pub fn new(sensor: &FilterSensor, geometry: &ScanGeometry) -> Self {
        let fields = match sensor {
            FilterSensor::Densities(fields) => Some(fields.clone()),
            FilterSensor::Beams(_) => None,
        };
        let local_map = LocalMap::new(&LocalMapConfig::default(), geometry);
        Self { fields, local_map, last_odom_from_robot: None }
    }

    /// Takes a scan in: into the local map and the densities there, where densities are asked for.
    pub fn sense(&mut self, scan: &Scan) -> Sensed {
        let last = self.last_odom_from_robot.replace(scan.odom_from_robot);
        let previous_from_robot = last.map_or(Pose2::identity(), |last| last.between(&scan.odom_from_robot));
        let readings = self.fields.as_ref().map_or_else(Vec::new, |fields| {
            self.local_map.integrate_scan(&scan.ranges_m, &scan.odom_from_robot);
            let widest_m = fields.bandwidths_m.iter().copied().fold(0.0, f64::max);
            GridMap::around_robot(&self.local_map, widest_m + 0.5)
                .map(|around| observe(&around, &scan.odom_from_robot, fields))
                .unwrap_or_default()
        });
        Sensed { previous_from_robot, readings }
    }
}

/// A global localisation under way.
#[derive(Clone, Debug)]
pub struct FilterTrial<'a> {
    map: &'a FieldMap,
    geometry: ScanGeometry,
    sensor: FilterSensor,
    filter: ParticleFilter,
    beams: BeamModelConfig,
}

impl<'a> FilterTrial<'a> {
    /// Particles all over the map. As in section 3.3.2.1, a filter that diverges is not helped.
    pub fn new(
        map: &'a FieldMap,
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
        let filter = ParticleFilter::global(map, config, seed);
        Self { map, geometry: geometry.clone(), sensor, filter, beams: BeamModelConfig::default() }
    }

    /// One iteration of the filter: prediction, weights, resampling.
    pub fn step(&mut self, scan: &Scan, sensed: &Sensed) {
        let motion = &sensed.previous_from_robot;
        match &self.sensor {
            FilterSensor::Densities(_) => {
                let config = DensityModelConfig::default();
                let model = DensityModel::new(&self.map.density, &sensed.readings, &config);
                self.filter.update(self.map, motion, &model);
            }
            FilterSensor::Beams(comparison) => {
                let model =
                    BeamModel::new(&self.map.grid, &self.geometry, &scan.ranges_m, *comparison, &self.beams);
                self.filter.update(self.map, motion, &model);
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
    use crate::simulation::{SimulationConfig, Task, World, simulate_run};
    use locution_engine::geometry::Point2;
    use locution_engine::locate::LikelihoodFieldConfig;
    use locution_engine::occupancy::CellState;

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
        let map = FieldMap::build(grid, &fields, &LikelihoodFieldConfig::default());
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
                let mut senses = FilterSenses::new(&sensor, &run.geometry);
                let mut trial = FilterTrial::new(&map, &run.geometry, sensor.clone(), num_particles, 5);
                let step = |(scan, truth): (&Scan, &locution_engine::formats::TruthPose)| {
                    trial.step(scan, &senses.sense(scan));
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
