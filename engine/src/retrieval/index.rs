//! All profiles of a site, searched window by window.

use std::ops::Range;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::config::RetrievalConfig;
use super::profile::RunProfile;
use super::search::{best_places, max_difference, window_costs};
use crate::text::{Direction, Interval};

/// A stretch of driving whose density profile resembles a query window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProfileCandidate {
    /// The stretch driven first (or in the run listed first).
    pub earlier: Interval,
    /// The query window.
    pub later: Interval,
    /// Which way the earlier stretch was driven.
    pub direction: Direction,
    /// Root mean square difference of the densities over window and kernels, in [0, 1]; large ones are cut off.
    pub rms_difference: f64,
    /// Resemblance, higher is better; comparable between windows of one site.
    pub score: f64,
    /// Evidence of the best candidate at a different stretch, in either direction, relative to this one's; 1 is fully
    /// ambiguous. The same place driven twice before counts as two stretches.
    pub ambiguity: f64,
}

/// The profiles of a site's runs.
#[derive(Clone, Debug)]
pub struct ProfileIndex {
    runs: Vec<RunProfile>,
    config: RetrievalConfig,
}

/// A place at which a window was compared, before it becomes a candidate.
#[derive(Clone, Copy, Debug)]
struct Place {
    run_idx: usize,
    sample: usize,
    direction: Direction,
    cost: u32,
}

impl ProfileIndex {
    /// Takes the runs in their order; sampling them is the caller's ([`RunProfile::from_observations`]).
    pub fn build(runs: Vec<RunProfile>, config: RetrievalConfig) -> Self {
        Self { runs, config }
    }

    /// The profiles, by run.
    pub fn runs(&self) -> &[RunProfile] {
        &self.runs
    }

    /// Candidates of every query window of a run among earlier runs and the earlier part of the run itself, in order
    /// of travel, each window's best first.
    pub fn all_candidates(&self, later_run: usize) -> Vec<ProfileCandidate> {
        let Some(profile) = self.runs.get(later_run) else { return Vec::new() };
        let length = self.config.num_samples(self.config.window_m);
        let starts: Vec<usize> = (0..(profile.len() + 1).saturating_sub(length))
            .step_by(self.config.num_samples(self.config.query_step_m))
            .collect();
        let by_window: Vec<Vec<ProfileCandidate>> =
            starts.par_iter().map(|&start| self.candidates(later_run, start)).collect();
        by_window.into_iter().flatten().collect()
    }

    /// Candidates of the window of a run that starts at a sample, best first.
    pub fn candidates(&self, later_run: usize, first_sample: usize) -> Vec<ProfileCandidate> {
        let Some(profile) = self.runs.get(later_run) else { return Vec::new() };
        let length = self.config.num_samples(self.config.window_m);
        self.search(profile, later_run, first_sample..first_sample + length)
    }

    /// Candidates among all runs of a window of a profile that is not part of the site, best first; their later
    /// interval names the run after the last.
    pub fn candidates_of(&self, profile: &RunProfile, window: Range<usize>) -> Vec<ProfileCandidate> {
        self.search(profile, self.runs.len(), window)
    }

    fn search(&self, profile: &RunProfile, later_run: usize, window: Range<usize>) -> Vec<ProfileCandidate> {
        if window.is_empty() || window.end > profile.len() {
            return Vec::new();
        }
        let suppression = self.config.num_samples(self.config.suppression_m);
        let limit = max_difference(profile.channels.len());
        let mut places: Vec<Place> = Vec::new();
        for direction in [Direction::Same, Direction::Opposite] {
            let mut found: Vec<Place> = Vec::new();
            for (run_idx, earlier) in self.runs.iter().enumerate().take(later_run + 1) {
                let mut costs = window_costs(profile, window.clone(), earlier, direction, limit);
                if run_idx == later_run {
                    let gap = (self.config.min_gap_m / self.config.sample_spacing_m).ceil() as usize;
                    costs.truncate((window.start + 1).saturating_sub(window.len() + gap));
                }
                let best = best_places(&costs, self.config.candidates_per_direction, suppression);
                found.extend(best.into_iter().map(|(sample, cost)| Place {
                    run_idx,
                    sample,
                    direction,
                    cost,
                }));
            }
            found.sort_by_key(|place| (place.cost, place.run_idx, place.sample));
            found.truncate(self.config.candidates_per_direction);
            places.extend(found);
        }
        places.sort_by_key(|place| (place.cost, place.run_idx, place.sample));
        let later = (profile, later_run, window);
        (0..places.len()).filter_map(|idx| self.candidate(&places, idx, &later)).collect()
    }

    fn candidate(
        &self,
        places: &[Place],
        idx: usize,
        (profile, later_run, window): &(&RunProfile, usize, Range<usize>),
    ) -> Option<ProfileCandidate> {
        let place = places[idx];
        let interval = |profile: &RunProfile, run_idx: usize, first: usize| {
            let last = profile.observation(first + window.len() - 1)?;
            Some(Interval { run_idx: run_idx as u32, first: profile.observation(first)?, last })
        };
        let suppression = self.config.num_samples(self.config.suppression_m);
        let is_elsewhere = |other: &&Place| {
            other.run_idx != place.run_idx || other.sample.abs_diff(place.sample) >= suppression
        };
        let rival = places.iter().find(is_elsewhere).map_or(f64::INFINITY, |rival| f64::from(rival.cost));
        let num_values = (window.len() * profile.channels.len().max(1)) as f64;
        let rms_difference = (f64::from(place.cost) / num_values).sqrt() / 255.0;
        Some(ProfileCandidate {
            earlier: interval(&self.runs[place.run_idx], place.run_idx, place.sample)?,
            later: interval(profile, *later_run, window.start)?,
            direction: place.direction,
            rms_difference,
            score: 1.0 - rms_difference,
            ambiguity: ((f64::from(place.cost) + 1.0) / (rival + 1.0)).min(1.0),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::profile::tests::run_of;
    use super::*;

    /// Densities of a winding imaginary corridor at a distance from its beginning.
    fn densities_at(metre: f64) -> Vec<f32> {
        let wave =
            |rate: f64, phase: f64| 0.5 + 0.4 * (metre * rate + phase + (metre * 0.31).sin() * 2.0).sin();
        vec![wave(0.9, 0.0) as f32, wave(0.55, 1.0) as f32, wave(0.27, 2.0) as f32]
    }

    fn profile(metres: impl Iterator<Item = f64>) -> RunProfile {
        let densities: Vec<Vec<f32>> = metres.map(densities_at).collect();
        RunProfile::from_observations(&run_of(&densities, 0.1), 0.25)
    }

    #[test]
    fn a_corridor_driven_there_and_back_is_found_both_ways() {
        let there = profile((0..600).map(|idx| f64::from(idx) * 0.1));
        let back = profile((0..600).map(|idx| 60.0 - f64::from(idx) * 0.1));
        let index = ProfileIndex::build(vec![there.clone(), back], RetrievalConfig::default());
        let best = &index.candidates(1, 80)[0];
        assert_eq!(best.direction, Direction::Opposite);
        assert!(best.earlier.first.abs_diff(400 - 80) < 4 && best.later.first.abs_diff(200) < 2, "{best:?}");
        assert!(best.rms_difference < 0.01 && best.ambiguity < 0.5);

        let again = profile((0..200).map(|idx| 20.0 + f64::from(idx) * 0.1));
        let best = &index.candidates_of(&again, 10..42)[0];
        assert_eq!((best.direction, best.later.run_idx, best.earlier.run_idx), (Direction::Same, 2, 0));
        assert!(best.earlier.first.abs_diff(225) < 4, "{best:?}");
    }

    #[test]
    fn a_run_does_not_find_the_place_it_has_just_left() {
        let run = profile((0..600).map(|idx| f64::from(idx) * 0.1));
        let index = ProfileIndex::build(vec![run], RetrievalConfig::default());
        for candidate in index.all_candidates(0) {
            assert!(candidate.earlier.last + 95 < candidate.later.first, "{candidate:?}");
        }
    }

    #[test]
    fn windows_that_do_not_fit_have_no_candidates() {
        let run = profile((0..30).map(|idx| f64::from(idx) * 0.1));
        let index = ProfileIndex::build(vec![run, RunProfile::default()], RetrievalConfig::default());
        assert!(index.candidates(0, 0).is_empty() && index.candidates(1, 0).is_empty());
        assert!(index.candidates(7, 0).is_empty() && index.all_candidates(1).is_empty());
    }
}
