//! The particle set, one array per coordinate.

use std::f64::consts::TAU;

use crate::turns::wrap_turns;
use locution_engine::geometry::{Point2, Pose2};

/// Pose hypotheses with their weights (Eq 2.2).
///
/// Positions are metres from the lower left corner of the map, so that single precision holds a tenth of a millimetre
/// anywhere in a building; headings are turns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Particles {
    pub(super) x_m: Vec<f32>,
    pub(super) y_m: Vec<f32>,
    pub(super) heading_turns: Vec<f32>,
    pub(super) weight: Vec<f32>,
}

impl Particles {
    /// Number of particles.
    pub fn len(&self) -> usize {
        self.x_m.len()
    }

    /// True when there is none.
    pub fn is_empty(&self) -> bool {
        self.x_m.is_empty()
    }

    /// Adds a particle of weight 1 at a pose of the map frame, whose lower left corner is `origin`.
    pub fn push(&mut self, map_from_robot: &Pose2, origin: &Point2) {
        self.x_m.push((map_from_robot.x - origin.x) as f32);
        self.y_m.push((map_from_robot.y - origin.y) as f32);
        self.heading_turns.push(wrap_turns((map_from_robot.theta / TAU) as f32));
        self.weight.push(1.0);
    }

    /// Replaces a particle and gives it weight 1.
    pub(super) fn replace(&mut self, index: usize, map_from_robot: &Pose2, origin: &Point2) {
        self.x_m[index] = (map_from_robot.x - origin.x) as f32;
        self.y_m[index] = (map_from_robot.y - origin.y) as f32;
        self.heading_turns[index] = wrap_turns((map_from_robot.theta / TAU) as f32);
        self.weight[index] = 1.0;
    }

    /// Pose of a particle in the map frame.
    pub fn pose(&self, index: usize, origin: &Point2) -> Pose2 {
        Pose2::new(
            origin.x + f64::from(self.x_m[index]),
            origin.y + f64::from(self.y_m[index]),
            f64::from(self.heading_turns[index]) * TAU,
        )
    }

    /// Weight of a particle, not normalised.
    pub fn weight(&self, index: usize) -> f32 {
        self.weight[index]
    }

    /// Mean weight, summed in a fixed order.
    pub fn mean_weight(&self) -> f64 {
        if self.is_empty() { 0.0 } else { total(&self.weight) / self.len() as f64 }
    }

    /// Number of particles that an unweighted set of the same information would have: (Σw)² / Σw².
    pub fn effective_sample_size(&self) -> f64 {
        let (sum, squares) = self.weight.iter().fold((0.0, 0.0), |(sum, squares), &weight| {
            let weight = f64::from(weight);
            (sum + weight, squares + weight * weight)
        });
        if squares > 0.0 { sum * sum / squares } else { 0.0 }
    }
}

/// Sum of weights, as eight running sums side by side: one after another they would wait for each other.
pub(super) fn total(weights: &[f32]) -> f64 {
    let (blocks, rest) = weights.as_chunks::<8>();
    let mut sums = [0.0f64; 8];
    for block in blocks {
        for (sum, &weight) in sums.iter_mut().zip(block) {
            *sum += f64::from(weight);
        }
    }
    sums.iter().sum::<f64>() + rest.iter().map(|&weight| f64::from(weight)).sum::<f64>()
}
