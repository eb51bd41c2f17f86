//! The density profile of a run: the densities of all kernels, sampled evenly along the travel.

use crate::text::Observation;

/// Samples of one run's densities at even distances of travel.
///
/// Densities are kept as eighths of a percent or so (256 steps), which is finer than they repeat, so that comparing is
/// integer arithmetic and sums do not depend on their order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RunProfile {
    /// For each kernel one value per sample, 255 for a density of 1.
    pub(super) channels: Vec<Vec<u8>>,
    /// The observation nearest to each sample.
    pub(super) observations: Vec<u32>,
}

impl RunProfile {
    /// Samples a run every `spacing_m` metres of travel, interpolating linearly between observations.
    ///
    /// Densities that are not numbers count as 0; observations that do not advance are passed over.
    pub fn from_observations(observations: &[Observation], spacing_m: f64) -> Self {
        let num_channels = observations.first().map_or(0, |first| first.densities.len());
        let mut profile = Self { channels: vec![Vec::new(); num_channels], observations: Vec::new() };
        let Some(start_m) = observations.first().map(|first| first.travel_m) else { return profile };
        profile.push(observations, 0, 0.0);
        for (idx, pair) in observations.windows(2).enumerate() {
            let length_m = pair[1].travel_m - pair[0].travel_m;
            if !(length_m > 0.0 && length_m.is_finite() && spacing_m > 0.0) {
                continue;
            }
            loop {
                let at_m = start_m + profile.observations.len() as f64 * spacing_m;
                let share = (at_m - pair[0].travel_m) / length_m;
                if share > 1.0 {
                    break;
                }
                profile.push(observations, idx, share.max(0.0));
            }
        }
        profile
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.observations.len()
    }

    /// True when the run has no observation.
    pub fn is_empty(&self) -> bool {
        self.observations.is_empty()
    }

    /// Index of the observation nearest to a sample.
    pub fn observation(&self, sample: usize) -> Option<u32> {
        self.observations.get(sample).copied()
    }

    /// The last sample at or before an observation.
    pub fn sample_at(&self, observation: u32) -> usize {
        self.observations.partition_point(|&at| at <= observation).saturating_sub(1)
    }

    fn push(&mut self, observations: &[Observation], idx: usize, share: f64) {
        let (before, after) = (&observations[idx], observations.get(idx + 1).unwrap_or(&observations[idx]));
        let density = |observation: &Observation, channel: usize| {
            let value = observation.densities.get(channel).copied().unwrap_or(0.0);
            if value.is_nan() { 0.0 } else { f64::from(value.clamp(0.0, 1.0)) }
        };
        for (channel, values) in self.channels.iter_mut().enumerate() {
            let value = density(before, channel) * (1.0 - share) + density(after, channel) * share;
            values.push((value * 255.0).round() as u8);
        }
        self.observations.push(idx as u32 + u32::from(share >= 0.5));
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::geometry::Pose2;

    /// A run whose densities are given, one observation every `step_m`.
    pub fn run_of(densities: &[Vec<f32>], step_m: f64) -> Vec<Observation> {
        let observation = |(idx, densities): (usize, &Vec<f32>)| Observation {
            scan_seq: idx as u64,
            timestamp_ns: 0,
            travel_m: 3.0 + idx as f64 * step_m,
            odom_from_robot: Pose2::identity(),
            run_from_robot: Pose2::identity(),
            densities: densities.clone(),
            is_hard: true,
            num_frontiers: 0,
        };
        densities.iter().enumerate().map(observation).collect()
    }

    #[test]
    fn samples_are_even_in_travel_and_interpolated() {
        let run = run_of(&[vec![0.0], vec![0.2], vec![0.4], vec![0.6], vec![0.8], vec![1.0]], 0.1);
        let profile = RunProfile::from_observations(&run, 0.25);
        assert_eq!(profile.channels, vec![vec![0, 128, 255]]);
        assert_eq!(profile.observations, vec![0, 3, 5]);
        assert_eq!((profile.sample_at(2), profile.sample_at(3), profile.sample_at(9)), (0, 1, 2));
    }

    #[test]
    fn standing_still_adds_no_sample() {
        let mut run = run_of(&[vec![0.5], vec![f32::NAN], vec![0.5]], 0.1);
        run[1].travel_m = run[0].travel_m;
        assert_eq!(RunProfile::from_observations(&run, 0.25).len(), 1);
        assert!(RunProfile::from_observations(&[], 0.25).is_empty());
    }
}
