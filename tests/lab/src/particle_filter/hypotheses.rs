//! From particles to hypotheses: neighbouring particles form a cluster, a cluster becomes a pose with its covariance
//! and probability.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use locution_engine::locate::Hypothesis;

use super::particles::Particles;
use locution_engine::config_error::ConfigError;
use locution_engine::geometry::{Point2, Pose2, wrap_angle};

/// What counts as one cluster.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ClusterConfig {
    /// Edge of the bins that particles are sorted into, metres.
    pub bin_m: f64,
    /// Bins of heading per full turn.
    pub num_heading_bins: usize,
    /// Clusters of less probability are not reported.
    pub min_probability: f64,
}

impl Default for ClusterConfig {
    fn default() -> Self {
        Self { bin_m: 0.5, num_heading_bins: 12, min_probability: 0.01 }
    }
}

impl ClusterConfig {
    /// Checks every value; `path` leads to this struct in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        if !(self.bin_m > 0.0 && self.bin_m.is_finite()) {
            return Err(ConfigError::new(format!("{path}.bin_m"), "must be above 0"));
        }
        if !(3..=360).contains(&self.num_heading_bins) {
            return Err(ConfigError::new(format!("{path}.num_heading_bins"), "must lie in 3..=360"));
        }
        if !(0.0..=1.0).contains(&self.min_probability) {
            return Err(ConfigError::new(format!("{path}.min_probability"), "must lie in 0..=1"));
        }
        Ok(())
    }
}

type Bin = (i32, i32, i32);

/// Clusters of touching bins, most probable first, ties by the lowest bin. Cost: a sort of the particles' bins.
pub(super) fn cluster(particles: &Particles, origin: &Point2, config: &ClusterConfig) -> Vec<Hypothesis> {
    let mut bins: BTreeMap<Bin, Vec<u32>> = BTreeMap::new();
    for index in (0..particles.len()).filter(|&index| particles.weight[index] > 0.0) {
        bins.entry(bin_of(particles, index, config)).or_default().push(index as u32);
    }
    let total: f64 = particles.weight.iter().map(|&weight| f64::from(weight)).sum();
    let mut hypotheses = Vec::new();
    while let Some((first, members)) = bins.pop_first() {
        let mut cluster = members;
        let mut open = vec![first];
        while let Some(bin) = open.pop() {
            for neighbor in neighbors(bin, config.num_heading_bins as i32) {
                if let Some(members) = bins.remove(&neighbor) {
                    cluster.extend(members);
                    open.push(neighbor);
                }
            }
        }
        let hypothesis = summarize(particles, &cluster, origin, total);
        if hypothesis.probability >= config.min_probability {
            hypotheses.push(hypothesis);
        }
    }
    hypotheses.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    hypotheses
}

fn bin_of(particles: &Particles, index: usize, config: &ClusterConfig) -> Bin {
    let cell = |meters: f32| (f64::from(meters) / config.bin_m).floor() as i32;
    let heading = (f64::from(particles.heading_turns[index]) * config.num_heading_bins as f64).floor() as i32;
    (
        cell(particles.x_m[index]),
        cell(particles.y_m[index]),
        heading.rem_euclid(config.num_heading_bins as i32),
    )
}

fn neighbors((x, y, heading): Bin, num_headings: i32) -> impl Iterator<Item = Bin> {
    (0..27).map(move |code| {
        let (dx, dy, turn) = (code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1);
        (x + dx, y + dy, (heading + turn).rem_euclid(num_headings))
    })
}

/// Weighted mean and covariance of some particles; headings are averaged around the direction of their sum.
fn summarize(particles: &Particles, members: &[u32], origin: &Point2, total: f64) -> Hypothesis {
    let (mut mass, mut x, mut y, mut sin, mut cos) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let coordinates = |member: u32| {
        let index = member as usize;
        let heading = f64::from(particles.heading_turns[index]) * TAU;
        (
            f64::from(particles.weight[index]),
            f64::from(particles.x_m[index]),
            f64::from(particles.y_m[index]),
            heading,
        )
    };
    for (weight, px, py, heading) in members.iter().map(|&member| coordinates(member)) {
        mass += weight;
        x += weight * px;
        y += weight * py;
        sin += weight * heading.sin();
        cos += weight * heading.cos();
    }
    let mean = Pose2::new(x / mass, y / mass, sin.atan2(cos));
    let mut covariance = [[0.0; 3]; 3];
    for (weight, px, py, heading) in members.iter().map(|&member| coordinates(member)) {
        let off = [px - mean.x, py - mean.y, wrap_angle(heading - mean.theta)];
        for (row, entries) in covariance.iter_mut().enumerate() {
            for (column, entry) in entries.iter_mut().enumerate() {
                *entry += weight / mass * off[row] * off[column];
            }
        }
    }
    Hypothesis {
        component: 0,
        map_from_robot: Pose2::new(mean.x + origin.x, mean.y + origin.y, mean.theta),
        covariance,
        probability: mass / total,
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn two_heaps_are_two_hypotheses() {
        let origin = Point2::new(10.0, 20.0);
        let mut particles = Particles::default();
        for step in 0..30 {
            let off = f64::from(step) * 0.01;
            // Headings on both sides of the half turn belong together.
            let theta = if step % 2 == 0 { PI - 0.05 } else { -PI + 0.05 };
            particles.push(&Pose2::new(12.0 + off, 25.0, theta), &origin);
        }
        (0..10).for_each(|_| particles.push(&Pose2::new(18.0, 25.0, 0.0), &origin));
        let found = cluster(&particles, &origin, &ClusterConfig::default());
        assert_eq!(found.len(), 2);
        assert!((found[0].probability - 0.75).abs() < 1e-9);
        assert!((found[0].map_from_robot.x - 12.145).abs() < 1e-3, "{:?}", found[0]);
        assert!(wrap_angle(found[0].map_from_robot.theta - PI).abs() < 1e-3);
        assert!((found[0].covariance[2][2].sqrt() - 0.05).abs() < 1e-3);
        assert!(found[1].covariance[0][0] < 1e-9);
    }
}
