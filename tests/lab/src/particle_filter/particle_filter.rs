//! Monte-Carlo localisation (Algorithm 2.1): predict, weigh, recover, resample; estimate when asked.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::field_map::FieldMap;
use super::hypotheses::{ClusterConfig, cluster};
use super::motion_model::OdometryMotionModel;
use super::noise::Noise;
use super::particles::Particles;
use super::resampling::Resampling;
use locution_engine::config_error::ConfigError;
use locution_engine::geometry::Pose2;
use locution_engine::locate::Hypothesis;

/// How a measurement judges particles.
pub trait SensorModel {
    /// Multiplies every particle's weight by the likelihood of the measurement at its pose.
    fn weigh(&self, particles: &mut Particles);
}

/// How a particle filter works.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ParticleFilterConfig {
    /// Number of particles (thesis: 40,000 in its largest scenario).
    pub num_particles: usize,
    /// Resample when the effective sample size falls to this share of the particles; 1 resamples at every update.
    pub resample_below: f64,
    /// Noise of the odometry.
    pub motion: OdometryMotionModel,
    /// When random particles come in.
    pub recovery: RecoveryConfig,
    /// What counts as one hypothesis.
    pub cluster: ClusterConfig,
}

impl Default for ParticleFilterConfig {
    fn default() -> Self {
        Self {
            num_particles: 40_000,
            resample_below: 1.0,
            motion: OdometryMotionModel::default(),
            recovery: RecoveryConfig::default(),
            cluster: ClusterConfig::default(),
        }
    }
}

impl ParticleFilterConfig {
    /// Checks every value; `path` leads to this struct in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        if !(1..=4_000_000).contains(&self.num_particles) {
            return Err(ConfigError::new(format!("{path}.num_particles"), "must lie in 1..=4000000"));
        }
        if !(0.0..=1.0).contains(&self.resample_below) {
            return Err(ConfigError::new(format!("{path}.resample_below"), "must lie in 0..=1"));
        }
        self.motion.validate(&format!("{path}.motion"))?;
        self.recovery.validate(&format!("{path}.recovery"))?;
        self.cluster.validate(&format!("{path}.cluster"))
    }
}

/// Recovery from kidnapping: when measurements fit worse lately than they used to, random particles come in
/// (augmented Monte-Carlo localisation, Probabilistic Robotics, table 8.3).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RecoveryConfig {
    /// Decay of the long-term mean weight, per update.
    pub slow: f64,
    /// Decay of the short-term mean weight, per update; 0 switches recovery off.
    pub fast: f64,
}

impl Default for RecoveryConfig {
    fn default() -> Self {
        Self { slow: 0.005, fast: 0.1 }
    }
}

impl RecoveryConfig {
    fn validate(&self, path: &str) -> Result<(), ConfigError> {
        for (name, value) in [("slow", self.slow), ("fast", self.fast)] {
            if !(0.0..=1.0).contains(&value) {
                return Err(ConfigError::new(format!("{path}.{name}"), "must lie in 0..=1"));
            }
        }
        Ok(())
    }
}

/// A particle filter over one map; the seed determines everything it does.
#[derive(Clone, Debug)]
pub struct ParticleFilter {
    config: ParticleFilterConfig,
    rng: ChaCha8Rng,
    particles: Particles,
    /// The other set, so that resampling need not allocate.
    spare: Particles,
    resampling: Resampling,
    /// Mean weight in the long and in the short run.
    mean_weights: Option<(f64, f64)>,
}

impl ParticleFilter {
    /// Particles all over the free space of a map.
    pub fn global(map: &FieldMap, config: ParticleFilterConfig, seed: u64) -> Self {
        let mut filter = Self::empty(config, seed);
        let num_particles = filter.config.num_particles;
        for pose in sow(map, num_particles, &mut filter.rng) {
            filter.particles.push(&pose, &map.grid.origin());
        }
        filter
    }

    /// Particles around poses, in equal shares, with the given deviations; places in walls are left to the weights.
    pub fn around(
        map: &FieldMap,
        poses: &[Pose2],
        (deviation_m, deviation_rad): (f64, f64),
        config: ParticleFilterConfig,
        seed: u64,
    ) -> Self {
        let mut filter = Self::empty(config, seed);
        let noises: [Noise; 3] = std::array::from_fn(|_| Noise::new(&mut filter.rng));
        let count = if poses.is_empty() { 0 } else { filter.config.num_particles };
        for index in 0..count {
            let normals = noises.map(|noise| f64::from(noise.normal(index as u32)));
            let pose = &poses[index * poses.len() / count];
            let off = Pose2::new(deviation_m * normals[0], deviation_m * normals[1], 0.0);
            let moved = Pose2::new(pose.x + off.x, pose.y + off.y, pose.theta + deviation_rad * normals[2]);
            filter.particles.push(&moved, &map.grid.origin());
        }
        filter
    }

    fn empty(config: ParticleFilterConfig, seed: u64) -> Self {
        Self {
            config,
            rng: ChaCha8Rng::seed_from_u64(seed),
            particles: Particles::default(),
            spare: Particles::default(),
            resampling: Resampling::default(),
            mean_weights: None,
        }
    }

    /// One step: the robot moved by `previous_from_robot` and measured.
    pub fn update(&mut self, map: &FieldMap, previous_from_robot: &Pose2, sensor: &impl SensorModel) {
        self.predict(previous_from_robot);
        let mean_before = self.particles.mean_weight();
        sensor.weigh(&mut self.particles);
        let num_random = self.num_to_recover(mean_before);
        self.resample();
        self.scatter(map, num_random);
    }

    /// Moves the particles without a measurement.
    pub fn predict(&mut self, previous_from_robot: &Pose2) {
        self.config.motion.predict(&mut self.particles, previous_from_robot, &mut self.rng);
    }

    /// Where the robot may be, most probable first.
    pub fn hypotheses(&self, map: &FieldMap) -> Vec<Hypothesis> {
        cluster(&self.particles, &map.grid.origin(), &self.config.cluster)
    }

    /// The particles as they stand.
    pub const fn particles(&self) -> &Particles {
        &self.particles
    }

    /// Follows the mean weight in the long and in the short run; says how many particles to draw anew.
    fn num_to_recover(&mut self, mean_before: f64) -> usize {
        let recovery = &self.config.recovery;
        let mean = if mean_before > 0.0 { self.particles.mean_weight() / mean_before } else { 0.0 };
        let (slow, fast) = self.mean_weights.unwrap_or((mean, mean));
        let (slow, fast) = (slow + recovery.slow * (mean - slow), fast + recovery.fast * (mean - fast));
        self.mean_weights = Some((slow, fast));
        let share = if slow > 0.0 && recovery.fast > 0.0 { (1.0 - fast / slow).clamp(0.0, 1.0) } else { 0.0 };
        (share * self.particles.len() as f64) as usize
    }

    /// Draws the next generation when the weights have become uneven enough.
    fn resample(&mut self) {
        let count = self.particles.len();
        let keeps = self.config.resample_below < 1.0
            && self.particles.effective_sample_size() > self.config.resample_below * count as f64;
        let start = self.rng.random_range(0.0..1.0);
        if keeps {
            return;
        }
        if self.resampling.draw_heirs(&self.particles, start, &mut self.spare) {
            std::mem::swap(&mut self.particles, &mut self.spare);
        } else {
            // Nobody stands where a robot can stand: the measurement says nothing about whom to keep.
            self.particles.weight.fill(1.0);
        }
    }

    /// Replaces `count` particles, spread evenly over the set, by random ones.
    fn scatter(&mut self, map: &FieldMap, count: usize) {
        let len = self.particles.len();
        for (number, pose) in sow(map, count, &mut self.rng).into_iter().enumerate() {
            self.particles.replace(number * len / count, &pose, &map.grid.origin());
        }
    }
}

/// `count` random poses, evenly over the free space and in the order of its cells; none when nothing is free.
fn sow(map: &FieldMap, count: usize, rng: &mut ChaCha8Rng) -> Vec<Pose2> {
    let cells = map.free_cells();
    let count = if cells.is_empty() { 0 } else { count };
    let side_m = map.grid.resolution_m();
    let [along, across, up, turn]: [Noise; 4] = std::array::from_fn(|_| Noise::new(rng));
    (0..count)
        .map(|number| {
            let uniform = |noise: Noise| f64::from(noise.uniform(number as u32));
            let place = (number as f64 + uniform(along)) * cells.len() as f64 / count as f64;
            let center = map.center_of(cells[(place as usize).min(cells.len() - 1)]);
            let (dx, dy) = ((uniform(across) - 0.5) * side_m, (uniform(up) - 0.5) * side_m);
            Pose2::new(center.x + dx, center.y + dy, (uniform(turn) - 0.5) * TAU)
        })
        .collect()
}
