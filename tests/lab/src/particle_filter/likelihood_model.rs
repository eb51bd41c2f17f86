//! A scan against the likelihood field: how a robot that has been found is tracked.
//!
//! The beam ends are turned once per heading that particles have, in steps of [`TURN_STEPS`], and kept in fixed point: a
//! beam of a particle is then two sums, a few shifts and one byte of memory. First the places of many bytes are worked
//! out side by side, then the bytes are read, so that no beam waits for another's memory.

use std::f64::consts::TAU;

use pulp::{Arch, Simd, WithSimd};

use super::particle_filter::SensorModel;
use super::particles::Particles;
use crate::turns::floor_to_u32;
use locution_engine::geometry::Point2;
use locution_engine::locate::LikelihoodField;

/// A scan against a likelihood field: the sensor model of pose tracking.
#[derive(Clone, Debug)]
pub struct LikelihoodFieldModel<'a> {
    field: &'a LikelihoodField,
    /// Beam ends in the robot's frame, in cells.
    ends: Vec<(f64, f64)>,
}

impl<'a> LikelihoodFieldModel<'a> {
    /// The model of the beam ends `points`, in the robot's frame, metres; ends farther than any map is wide say nothing.
    pub fn new(field: &'a LikelihoodField, points: &[Point2]) -> Self {
        let ends = points
            .iter()
            .map(|point| (point.x / field.resolution_m(), point.y / field.resolution_m()))
            .filter(|(along, across)| along.hypot(*across) < f64::from(FARTHEST_CELLS))
            .collect();
        Self { field, ends }
    }

    /// Sum of the codes of all beam ends for every particle.
    fn scores(&self, particles: &Particles) -> Vec<u32> {
        let turned = TurnedEnds::new(&self.ends, &particles.heading_turns);
        Arch::new().dispatch(Scoring { field: self.field, turned, particles })
    }

    /// Weight by how far a score lags behind the best one, down to where it vanishes.
    fn weights_by_lag(&self) -> Vec<f32> {
        let unit = self.field.unit_of_evidence();
        let num_lags = ((30.0 / unit).ceil() as usize).min(255 * self.ends.len() + 1);
        (0..num_lags).map(|lag| (-unit * lag as f64).exp() as f32).collect()
    }
}

impl SensorModel for LikelihoodFieldModel<'_> {
    fn weigh(&self, particles: &mut Particles) {
        let scores = self.scores(particles);
        let best = scores.iter().copied().max().unwrap_or(0);
        let by_lag = self.weights_by_lag();
        for (weight, score) in particles.weight.iter_mut().zip(scores) {
            *weight *= by_lag.get((best - score) as usize).copied().unwrap_or(0.0);
        }
    }
}

/// Headings told apart: 0.09° off at most, 1.5 cm at ten metres.
const TURN_STEPS: u32 = 2048;
/// Fractions of a cell are kept to 2⁻¹².
const FRACTION_BITS: u32 = 12;
/// Positions and ends stay below this, so that their sums stay within fixed point.
const FARTHEST_CELLS: f32 = 200_000.0;
/// So far to the lower left that nothing is there, whatever it is seen from.
const NOWHERE: i32 = -(FARTHEST_CELLS as i32) << FRACTION_BITS;
/// Beam ends looked up side by side.
const LANES: usize = 32;

/// Columns and rows of some beam ends from the robot, in fixed point; lanes without an end lie [`NOWHERE`].
#[derive(Clone, Copy)]
struct Ends {
    columns: [i32; LANES],
    rows: [i32; LANES],
}

/// Cells in fixed point.
#[inline(always)]
fn fixed(cells: f64) -> i32 {
    /// Of a number plus this one, the low bits are the nearest integer.
    const SHIFT: f64 = 6_755_399_441_055_744.0;
    (cells * f64::from(1 << FRACTION_BITS) + SHIFT).to_bits() as i32
}

/// The step of a heading in turns.
#[inline(always)]
fn heading_step(heading_turns: f32) -> u32 {
    let steps = TURN_STEPS as f32;
    floor_to_u32(heading_turns * steps + (steps + 0.5)) % TURN_STEPS
}

/// Beam ends at every heading that occurs.
struct TurnedEnds {
    /// Ends of a heading, in blocks of [`LANES`].
    blocks_per_heading: usize,
    /// Where the blocks of a heading begin; `ABSENT` when no particle has it.
    starts: Vec<u32>,
    blocks: Vec<Ends>,
}

const ABSENT: u32 = u32::MAX;

impl TurnedEnds {
    fn new(ends: &[(f64, f64)], headings_turns: &[f32]) -> Self {
        let mut starts = vec![ABSENT; TURN_STEPS as usize];
        let mut blocks = Vec::new();
        for &turns in headings_turns {
            let heading = heading_step(turns);
            let start = &mut starts[heading as usize];
            if *start == ABSENT {
                *start = blocks.len() as u32;
                let rotation = (f64::from(heading) / f64::from(TURN_STEPS) * TAU).sin_cos();
                blocks.extend(ends.chunks(LANES).map(|ends| turned(ends, rotation)));
            }
        }
        Self { blocks_per_heading: ends.len().div_ceil(LANES), starts, blocks }
    }

    /// The ends at a heading that occurs.
    #[inline(always)]
    fn at(&self, heading: u32) -> &[Ends] {
        let start = self.starts[heading as usize] as usize;
        &self.blocks[start..start + self.blocks_per_heading]
    }
}

/// At most [`LANES`] ends, turned.
fn turned(ends: &[(f64, f64)], (sin, cos): (f64, f64)) -> Ends {
    let mut block = Ends { columns: [NOWHERE; LANES], rows: [NOWHERE; LANES] };
    for (((along, across), column), row) in ends.iter().zip(&mut block.columns).zip(&mut block.rows) {
        *column = fixed(cos * along - sin * across);
        *row = fixed(sin * along + cos * across);
    }
    block
}

/// The scores of all particles, a loop for the widest vectors at hand.
struct Scoring<'a> {
    field: &'a LikelihoodField,
    turned: TurnedEnds,
    particles: &'a Particles,
}

impl WithSimd for Scoring<'_> {
    type Output = Vec<u32>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<u32> {
        let Particles { x_m, y_m, heading_turns, .. } = self.particles;
        let scale = (1.0 / self.field.resolution_m()) as f32;
        // The codes begin with a border of one cell. What is so far off the map sees nothing of it.
        let position =
            |meters: f32| fixed(f64::from((meters * scale).clamp(-FARTHEST_CELLS, FARTHEST_CELLS)) + 1.0);
        let mut scores = vec![0; x_m.len()];
        for (score, ((&x, &y), &turns)) in scores.iter_mut().zip(x_m.iter().zip(y_m).zip(heading_turns)) {
            *score = self.score((position(x), position(y)), self.turned.at(heading_step(turns)));
        }
        scores
    }
}

impl Scoring<'_> {
    /// Sum of the codes of ends seen from a position, in fixed point from the corner of the border.
    #[inline(always)]
    fn score(&self, (column, row): (i32, i32), ends: &[Ends]) -> u32 {
        // Beyond the edge all cells are worth nothing, as those of the border are.
        let (right, top) = self.field.last_cell();
        let cell = |position: i32, last: u32| (position.max(0) as u32 >> FRACTION_BITS).min(last);
        let mut score = 0;
        for Ends { columns, rows } in ends {
            let mut places = [0; LANES];
            for ((place, along), up) in places.iter_mut().zip(columns).zip(rows) {
                *place = self.field.place(cell(column + along, right), cell(row + up, top));
            }
            for place in places {
                score += u32::from(self.field.code(place));
            }
        }
        score
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use locution_engine::geometry::{Pose2, angle_between};
    use locution_engine::locate::LikelihoodFieldConfig;
    use locution_engine::occupancy::{CellState, GridMap};

    #[test]
    fn particles_are_weighed_as_one_point_after_another() {
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let mut map = GridMap::unknown(90, 70, 0.1, Point2::new(-3.0, 2.0));
        for _ in 0..420 {
            map.set(rng.random_range(0..90), rng.random_range(0..70), CellState::Occupied);
        }
        let field = LikelihoodField::build(&map, &LikelihoodFieldConfig::default());
        for num_points in [1, 19, 32, 45] {
            let mut offset = || rng.random_range(-4.0..4.0);
            let points: Vec<Point2> = (0..num_points).map(|_| Point2::new(offset(), offset())).collect();
            let mut particles = Particles::default();
            for _ in 0..300 {
                let pose = Pose2::new(
                    rng.random_range(-4.0..7.0),
                    rng.random_range(1.0..10.0),
                    rng.random_range(-3.0..3.0),
                );
                particles.push(&pose, &map.origin());
            }
            let model = LikelihoodFieldModel::new(&field, &points);
            let scores = model.scores(&particles);
            let close = (0..300).filter(|&index| {
                let exact = particles.pose(index, &map.origin());
                let step = heading_step(particles.heading_turns[index]);
                let heading = f64::from(step) / f64::from(TURN_STEPS) * TAU;
                assert!(angle_between(exact.theta, heading) < 0.0016, "half a step at most");
                let pose = Pose2::new(exact.x, exact.y, heading);
                let slow = field.mean_code(&points, &pose) * points.len() as f64;
                // A point within a rounding error of a cell's edge may fall on either side.
                (f64::from(scores[index]) - slow).abs() < 0.5
            });
            assert!(close.count() >= 285);
            model.weigh(&mut particles);
            let best = particles.weight.iter().copied().fold(0.0, f32::max);
            assert_eq!(best, 1.0, "the best particle keeps its weight");
        }
    }

    #[test]
    fn far_away_nothing_is_seen() {
        let mut map = GridMap::unknown(4, 3, 0.1, Point2::new(0.0, 0.0));
        (0..4).for_each(|column| (0..3).for_each(|row| map.set(column, row, CellState::Occupied)));
        let field = LikelihoodField::build(&map, &LikelihoodFieldConfig::default());
        let model = LikelihoodFieldModel::new(&field, &[Point2::new(0.0, 0.0), Point2::new(1e9, 0.0)]);
        let mut particles = Particles::default();
        let places =
            [(0.15, 0.15), (-0.05, 0.1), (0.45, 0.1), (1e8, 0.1), (-1e8, -1e8), (0.1, -0.01), (0.1, 0.31)];
        places.iter().for_each(|&(x, y)| particles.push(&Pose2::new(x, y, 0.0), &map.origin()));
        assert_eq!(model.scores(&particles), [255, 0, 0, 0, 0, 0, 0]);
    }
}
