//! Weights by free-space density and its gradient (Eqs 3.3–3.6).
//!
//! Every test that a particle fails halves its weight, so a weight is the number of failed tests; the tests compare
//! bytes of the density field.

use std::f64::consts::TAU;

use pulp::{Arch, Simd, WithSimd};
use serde::{Deserialize, Serialize};

use super::particle_filter::SensorModel;
use super::particles::Particles;
use crate::density_field::{
    DensityField, EMPTY, FULL, KernelReading, MAX_KERNELS, STABLE, UNDEFINED, direction_code,
};
use crate::turns::{floor_to_u32, wrap_turns};
use locution_engine::config_error::ConfigError;

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
            let half = (config.direction_tolerance_rad / TAU * 128.0).floor() as u8;
            test.turn_span = (2 * half).min(127);
            // α_robot is heading − descent, and the robot's heading in its own frame is 0.
            let descent_turns = (f64::from(descent_rad) / TAU) as f32;
            test.turn_offset = half.wrapping_add(direction_code(wrap_turns(descent_turns))) & 127;
        }
        test
    }

    /// Failed tests of a particle of this heading (1/128 turns) on a cell of these codes.
    #[inline(always)]
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
    /// Weight of one, two, four and eight failed tests: the bits of their number.
    penalties: [f32; 4],
}

impl<'a> DensityModel<'a> {
    /// Weights for what the robot sees now, one reading per kernel of the field; missing readings pass everybody.
    pub fn new(field: &'a DensityField, readings: &[KernelReading], config: &DensityModelConfig) -> Self {
        let mut tests = [KernelTest::PASSES_ALL; MAX_KERNELS];
        for (test, reading) in tests.iter_mut().zip(readings).take(field.num_kernels()) {
            *test = KernelTest::new(reading, config);
        }
        let penalties = [1, 2, 4, 8].map(|num_failed| config.penalty.powi(num_failed) as f32);
        Self { field, tests, penalties }
    }
}

impl SensorModel for DensityModel<'_> {
    fn weigh(&self, particles: &mut Particles) {
        let arch = Arch::new();
        match self.field.stride() {
            1 => arch.dispatch(Weighing::<1>::new(self, particles)),
            2 => arch.dispatch(Weighing::<2>::new(self, particles)),
            _ => arch.dispatch(Weighing::<4>::new(self, particles)),
        }
    }
}

/// Particles weighed side by side.
const LANES: usize = 64;

/// The weighing of all particles with `STRIDE` kernels side by side, a loop for the widest vectors at hand.
struct Weighing<'a, const STRIDE: usize> {
    field: &'a DensityField,
    tests: [KernelTest; STRIDE],
    penalties: [f32; 4],
    particles: &'a mut Particles,
}

impl<'a, const STRIDE: usize> Weighing<'a, STRIDE> {
    fn new(model: &DensityModel<'a>, particles: &'a mut Particles) -> Self {
        let tests = std::array::from_fn(|kernel| model.tests[kernel]);
        Self { field: model.field, tests, penalties: model.penalties, particles }
    }

    /// Weighs some particles: first where their codes lie, then all codes, then all tests, so that no particle waits
    /// for another's memory.
    #[inline(always)]
    fn weigh_block(&self, [x_m, y_m, heading_turns]: [&[f32; LANES]; 3], weight: &mut [f32; LANES]) {
        let mut codes = [[0u16; STRIDE]; LANES];
        for (codes, start) in codes.iter_mut().zip(self.field.starts(x_m, y_m)) {
            *codes = self.field.codes_from(start);
        }
        let mut num_failed = [0u8; LANES];
        for ((failed, codes), turns) in num_failed.iter_mut().zip(&codes).zip(heading_turns) {
            let heading = floor_to_u32(turns * 128.0 + 128.5) as u8;
            for (test, code) in self.tests.iter().zip(codes) {
                let [density, direction] = code.to_le_bytes();
                *failed += test.num_failed(density, direction, heading);
            }
        }
        let [one, two, four, eight] = self.penalties;
        for ((weight, codes), &failed) in weight.iter_mut().zip(&codes).zip(&num_failed) {
            let for_bit = |bit: u8, penalty: f32| if failed & bit != 0 { penalty } else { 1.0 };
            let penalty = for_bit(1, one) * for_bit(2, two) * (for_bit(4, four) * for_bit(8, eight));
            // A robot stands on free cells only.
            *weight = if codes[0] == EMPTY { 0.0 } else { *weight * penalty };
        }
    }
}

impl<const STRIDE: usize> WithSimd for Weighing<'_, STRIDE> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Particles { x_m, y_m, heading_turns, mut weight } = std::mem::take(self.particles);
        let (x_blocks, x_rest) = x_m.as_chunks::<LANES>();
        let (y_blocks, y_rest) = y_m.as_chunks::<LANES>();
        let (heading_blocks, heading_rest) = heading_turns.as_chunks::<LANES>();
        let (weight_blocks, weight_rest) = weight.as_chunks_mut::<LANES>();
        let blocks = x_blocks.iter().zip(y_blocks).zip(heading_blocks).zip(weight_blocks);
        for (((x, y), heading), weight) in blocks {
            self.weigh_block([x, y, heading], weight);
        }
        let padded = |rest: &[f32]| {
            let mut block = [0.0; LANES];
            block[..rest.len()].copy_from_slice(rest);
            block
        };
        let mut last = padded(weight_rest);
        self.weigh_block([&padded(x_rest), &padded(y_rest), &padded(heading_rest)], &mut last);
        weight_rest.copy_from_slice(&last[..weight_rest.len()]);
        *self.particles = Particles { x_m, y_m, heading_turns, weight };
    }
}
