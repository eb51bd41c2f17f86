//! Weights by free-space density and its gradient (Eqs 3.3–3.6).
//!
//! Every test that a particle fails halves its weight, so a weight is the number of failed tests; the tests compare
//! bytes of the density field.

use serde::{Deserialize, Serialize};

use super::density_field::{
    DensityField, FULL, KernelReading, MAX_KERNELS, NOT_FREE, STABLE, UNDEFINED, direction_code,
};
use super::particle_filter::SensorModel;
use super::particles::Particles;
use crate::config::ConfigError;

/// Tolerances of the density weights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DensityModelConfig {
    /// ε_d: densities that differ more fail (Eq 3.4).
    pub density_tolerance: f64,
    /// ε_θ: directions that differ more fail, radians (Eq 3.5).
    pub direction_tolerance_rad: f64,
    /// Factor of a failed test, 0.5 in the thesis.
    pub penalty: f64,
}

impl Default for DensityModelConfig {
    fn default() -> Self {
        Self { density_tolerance: 0.2, direction_tolerance_rad: std::f64::consts::FRAC_PI_4, penalty: 0.5 }
    }
}

impl DensityModelConfig {
    /// Checks every value; `path` leads to this struct in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        let shares = [("density_tolerance", self.density_tolerance), ("penalty", self.penalty)];
        for (name, value) in shares {
            if !(value > 0.0 && value <= 1.0) {
                return Err(ConfigError::new(format!("{path}.{name}"), "must lie in 0..=1 and not be 0"));
            }
        }
        if !(self.direction_tolerance_rad > 0.0 && self.direction_tolerance_rad <= std::f64::consts::PI) {
            return Err(ConfigError::new(
                format!("{path}.direction_tolerance_rad"),
                "must lie in 0..=π and not be 0",
            ));
        }
        Ok(())
    }
}

/// The tests of one kernel, as bytes.
#[derive(Clone, Copy, Debug)]
struct KernelTest {
    /// Densities from here on pass …
    low: u8,
    /// … over this many codes more.
    span: u8,
    /// What to add to heading − direction so that all that passes lies at or below `turn_span`, in 1/128 turns.
    turn_offset: u8,
    turn_span: u8,
}

impl KernelTest {
    const PASSES_ALL: Self = Self { low: 0, span: u8::MAX, turn_offset: 0, turn_span: 127 };

    fn new(reading: &KernelReading, config: &DensityModelConfig) -> Self {
        let mut test = Self::PASSES_ALL;
        if let Some(density) = reading.density {
            let tolerance = config.density_tolerance as f32;
            test.low = ((density - tolerance) * FULL).ceil().max(0.0) as u8;
            test.span = ((density + tolerance) * FULL).floor().min(FULL) as u8 - test.low;
        }
        if let Some(descent_rad) = reading.descent_rad {
            let half = (config.direction_tolerance_rad / std::f64::consts::TAU * 128.0).floor() as u8;
            test.turn_span = (2 * half).min(127);
            // α_robot is heading − descent, and the robot's heading in its own frame is 0.
            test.turn_offset = half.wrapping_add(direction_code(descent_rad)) & 127;
        }
        test
    }

    /// Failed tests of a particle of this heading (1/128 turns) on a cell of these codes.
    #[inline]
    fn num_failed(&self, density: u8, direction: u8, heading: u8) -> u8 {
        let is_off = (density.wrapping_sub(self.low) > self.span) & (density != UNDEFINED);
        let turn = heading.wrapping_sub(direction).wrapping_add(self.turn_offset) & 127;
        let is_turned = (turn > self.turn_span) & (direction & STABLE != 0);
        u8::from(is_off) + u8::from(is_turned)
    }
}

/// The robot's densities against the map's.
#[derive(Clone, Debug)]
pub struct DensityModel<'a> {
    field: &'a DensityField,
    tests: [KernelTest; MAX_KERNELS],
    /// Weight by number of failed tests, and off the free space.
    weights: [f32; OFF_THE_FLOOR + 1],
}

/// Particles weighed side by side.
const LANES: usize = 16;
/// Place in the table of weights that no number of failed tests reaches.
const OFF_THE_FLOOR: usize = 2 * MAX_KERNELS + 1;

impl<'a> DensityModel<'a> {
    /// Weights for what the robot sees now, one reading per kernel of the field; missing readings pass everybody.
    pub fn new(field: &'a DensityField, readings: &[KernelReading], config: &DensityModelConfig) -> Self {
        let mut tests = [KernelTest::PASSES_ALL; MAX_KERNELS];
        for (test, reading) in tests.iter_mut().zip(readings).take(field.num_kernels()) {
            *test = KernelTest::new(reading, config);
        }
        let mut weights = std::array::from_fn(|failed| config.penalty.powi(failed as i32) as f32);
        weights[OFF_THE_FLOOR] = 0.0;
        Self { field, tests, weights }
    }

    fn weigh_by<const STRIDE: usize>(&self, particles: &mut Particles) {
        let tests: [KernelTest; STRIDE] = std::array::from_fn(|kernel| self.tests[kernel]);
        let (x_blocks, x_rest) = particles.x_m.as_chunks::<LANES>();
        let (y_blocks, y_rest) = particles.y_m.as_chunks::<LANES>();
        let (heading_blocks, heading_rest) = particles.heading_turns.as_chunks::<LANES>();
        let (weight_blocks, weight_rest) = particles.weight.as_chunks_mut::<LANES>();
        let blocks = x_blocks.iter().zip(y_blocks).zip(heading_blocks).zip(weight_blocks);
        for (((x, y), heading), weight) in blocks {
            self.weigh_block(&tests, [x, y, heading], weight);
        }
        let padded = |rest: &[f32]| {
            let mut block = [0.0; LANES];
            block[..rest.len()].copy_from_slice(rest);
            block
        };
        let mut weight = padded(weight_rest);
        self.weigh_block(&tests, [&padded(x_rest), &padded(y_rest), &padded(heading_rest)], &mut weight);
        weight_rest.copy_from_slice(&weight[..weight_rest.len()]);
    }

    /// Weighs some particles side by side: first where their codes lie, then all codes, then all tests, so that no
    /// particle waits for another's memory.
    #[inline]
    fn weigh_block<const STRIDE: usize>(
        &self,
        tests: &[KernelTest; STRIDE],
        [x_m, y_m, heading_turns]: [&[f32; LANES]; 3],
        weight: &mut [f32; LANES],
    ) {
        let starts = self.field.starts(x_m, y_m);
        let mut densities = [[0u8; LANES]; STRIDE];
        let mut directions = [[0u8; LANES]; STRIDE];
        for (lane, &start) in starts.iter().enumerate() {
            for (kernel, code) in self.field.codes_from::<STRIDE>(start).into_iter().enumerate() {
                [densities[kernel][lane], directions[kernel][lane]] = code.to_le_bytes();
            }
        }
        let headings = heading_turns.map(|turns| (turns * 128.0 + 128.5) as i32 as u8);
        let mut num_failed = [0u8; LANES];
        for ((test, densities), directions) in tests.iter().zip(&densities).zip(&directions) {
            let codes = densities.iter().zip(directions);
            for ((failed, (&density, &direction)), &heading) in
                num_failed.iter_mut().zip(codes).zip(&headings)
            {
                *failed += test.num_failed(density, direction, heading);
            }
        }
        // A robot stands on free cells only.
        for ((weight, &density), &failed) in weight.iter_mut().zip(&densities[0]).zip(&num_failed) {
            let is_free = density != NOT_FREE;
            *weight *= self.weights[if is_free { usize::from(failed) } else { OFF_THE_FLOOR }];
        }
    }
}

impl SensorModel for DensityModel<'_> {
    fn weigh(&self, particles: &mut Particles) {
        match self.field.stride() {
            1 => self.weigh_by::<1>(particles),
            2 => self.weigh_by::<2>(particles),
            _ => self.weigh_by::<4>(particles),
        }
    }
}
