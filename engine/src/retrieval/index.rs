//! All profiles of a site, searched window by window.

use std::ops::Range;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::config::RetrievalConfig;
use super::profile::RunProfile;
use super::search::{best_places, window_costs};
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
    /// 1 when all densities are equal, 0 when all differ by the largest difference or more.
    pub resemblance: f64,
    /// How far the window's difference from this stretch lies below its mean difference from all stretches of the site
    /// in this direction, in standard deviations: higher is better, whatever the length of the window.
    pub score: f64,
    /// Score of the best candidate at a different stretch, in either direction, relative to this one's, in [0, 1]; 1
    /// is fully ambiguous. The same place driven twice before counts as two stretches.
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
    /// First sample of the earlier stretch and of the query window, and their length.
    earlier_start: usize,
    later_start: usize,
    length: usize,
    direction: Direction,
    cost: u16,
    score: f64,
}

impl Place {
    /// Same for all windows that pair the same observations: the shift between the stretches, doubled where they are
    /// read in opposite directions and only their centres count.
    fn diagonal(&self) -> i64 {
        match self.direction {
            Direction::Same => 2 * (self.earlier_start as i64 - self.later_start as i64),
            Direction::Opposite => 2 * (self.earlier_start + self.later_start + self.length) as i64,
        }
    }
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
    /// of travel, the best of each centre first.
    pub fn all_candidates(&self, later_run: usize) -> Vec<ProfileCandidate> {
        let Some(profile) = self.runs.get(later_run) else { return Vec::new() };
        let step = self.config.num_samples(self.config.query_step_m);
        let centers: Vec<usize> = (0..profile.len()).step_by(step).collect();
        let by_center: Vec<Vec<ProfileCandidate>> =
            centers.par_iter().map(|&center| self.candidates(later_run, center)).collect();
        by_center.into_iter().flatten().collect()
    }

    /// Candidates of the windows of a run around a sample, best first.
    pub fn candidates(&self, later_run: usize, center_sample: usize) -> Vec<ProfileCandidate> {
        let Some(profile) = self.runs.get(later_run) else { return Vec::new() };
        self.search(profile, later_run, center_sample)
    }

    /// Candidates among all runs of the windows around a sample of a profile that is not part of the site, best
    /// first; their later interval names the run after the last.
    pub fn candidates_of(&self, profile: &RunProfile, center_sample: usize) -> Vec<ProfileCandidate> {
        self.search(profile, self.runs.len(), center_sample)
    }

    fn search(&self, profile: &RunProfile, later_run: usize, center: usize) -> Vec<ProfileCandidate> {
        let suppression = 2 * self.config.num_samples(self.config.suppression_m) as u64;
        let mut lengths: Vec<usize> =
            self.config.windows_m.iter().map(|&window_m| self.config.num_samples(window_m)).collect();
        lengths.sort_unstable_by(|a, b| b.cmp(a));
        let mut places: Vec<Place> = Vec::new();
        for length in lengths {
            let Some(start) = center.checked_sub(length / 2) else { continue };
            if start + length > profile.len() {
                continue;
            }
            for direction in [Direction::Same, Direction::Opposite] {
                let found = self.best_of_window(profile, later_run, start..start + length, direction);
                // A longer window that pairs the same observations says more.
                let is_new = |place: &Place| {
                    places.iter().all(|known| {
                        known.direction != place.direction
                            || known.run_idx != place.run_idx
                            || known.diagonal().abs_diff(place.diagonal()) >= suppression
                    })
                };
                let found: Vec<Place> = found.into_iter().filter(is_new).collect();
                places.extend(found);
            }
        }
        places.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.key().cmp(&b.key())));
        (0..places.len())
            .filter_map(|idx| self.candidate(&places, idx, (profile, later_run), suppression))
            .collect()
    }

    fn best_of_window(
        &self,
        profile: &RunProfile,
        later_run: usize,
        window: Range<usize>,
        direction: Direction,
    ) -> Vec<Place> {
        let suppression = self.config.num_samples(self.config.suppression_m);
        let gap = (self.config.min_gap_m / self.config.sample_spacing_m).ceil() as usize;
        let mut places = Vec::new();
        let mut moments = Moments::default();
        for (run_idx, earlier) in self.runs.iter().enumerate().take(later_run + 1) {
            let mut costs =
                window_costs(profile, window.clone(), earlier, direction, self.config.largest_step());
            if run_idx == later_run {
                costs.truncate((window.start + 1).saturating_sub(window.len() + gap));
            }
            moments.add(&costs);
            for (earlier_start, cost) in best_places(&costs, self.config.candidates_per_window, suppression) {
                let (later_start, length) = (window.start, window.len());
                places.push(Place {
                    run_idx,
                    earlier_start,
                    later_start,
                    length,
                    direction,
                    cost,
                    score: 0.0,
                });
            }
        }
        places.sort_by_key(|place| (place.cost, place.run_idx, place.earlier_start));
        places.truncate(self.config.candidates_per_window);
        for place in &mut places {
            place.score = moments.deviations_below(place.cost);
        }
        places
    }

    fn candidate(
        &self,
        places: &[Place],
        idx: usize,
        (profile, later_run): (&RunProfile, usize),
        suppression: u64,
    ) -> Option<ProfileCandidate> {
        let place = places[idx];
        let interval = |profile: &RunProfile, run_idx: usize, first: usize| {
            let last = profile.observation(first + place.length - 1)?;
            Some(Interval { run_idx: run_idx as u32, first: profile.observation(first)?, last })
        };
        let center = |place: &Place| 2 * place.earlier_start + place.length;
        let is_elsewhere = |other: &&Place| {
            other.run_idx != place.run_idx || center(other).abs_diff(center(&place)) as u64 >= suppression
        };
        let rival = places.iter().find(is_elsewhere).map_or(0.0, |rival| rival.score);
        let worst = place.length * profile.channels.len() * usize::from(self.config.largest_step());
        Some(ProfileCandidate {
            earlier: interval(self.runs.get(place.run_idx)?, place.run_idx, place.earlier_start)?,
            later: interval(profile, later_run, place.later_start)?,
            direction: place.direction,
            resemblance: 1.0 - f64::from(place.cost) / worst.max(1) as f64,
            score: place.score,
            ambiguity: if place.score > 0.0 { (rival / place.score).clamp(0.0, 1.0) } else { 1.0 },
        })
    }
}

impl Place {
    /// Decides between equal scores.
    fn key(&self) -> (usize, usize, usize, Direction) {
        (self.run_idx, self.earlier_start, self.length, self.direction)
    }
}

/// Mean and spread of a window's costs over all places, by exact integer sums.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    count: u64,
    sum: u64,
    sum_of_squares: u64,
}

impl Moments {
    fn add(&mut self, costs: &[u16]) {
        self.count += costs.len() as u64;
        for &cost in costs {
            self.sum += u64::from(cost);
            self.sum_of_squares += u64::from(cost) * u64::from(cost);
        }
    }

    fn deviations_below(&self, cost: u16) -> f64 {
        let count = self.count.max(1) as f64;
        let mean = self.sum as f64 / count;
        let variance = self.sum_of_squares as f64 / count - mean * mean;
        // Sites with a place or two have no spread to speak of.
        (mean - f64::from(cost)) / variance.max(1.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::super::profile::tests::run_of;
    use super::*;

    /// Densities of a winding imaginary corridor at a distance from its beginning.
    fn densities_at(meter: f64) -> Vec<f32> {
        let wave =
            |rate: f64, phase: f64| 0.5 + 0.4 * (meter * rate + phase + (meter * 0.31).sin() * 2.0).sin();
        vec![wave(0.9, 0.0) as f32, wave(0.55, 1.0) as f32, wave(0.27, 2.0) as f32]
    }

    fn profile(meters: impl Iterator<Item = f64>) -> RunProfile {
        let densities: Vec<Vec<f32>> = meters.map(densities_at).collect();
        RunProfile::from_observations(&run_of(&densities, 0.1), 0.25)
    }

    #[test]
    fn a_corridor_driven_there_and_back_is_found_both_ways() {
        let there = profile((0..600).map(|idx| f64::from(idx) * 0.1));
        let back = profile((0..600).map(|idx| 60.0 - f64::from(idx) * 0.1));
        let index = ProfileIndex::build(vec![there.clone(), back], RetrievalConfig::default());
        let best = &index.candidates(1, 96)[0];
        assert_eq!(best.direction, Direction::Opposite);
        let centers = (best.earlier.first + best.earlier.last, best.later.first + best.later.last);
        assert!(centers.0.abs_diff(2 * (600 - 240)) < 8 && centers.1.abs_diff(2 * 240) < 8, "{best:?}");
        assert!(best.resemblance > 0.8 && best.ambiguity < 0.9, "{best:?}");

        let again = profile((0..200).map(|idx| 20.0 + f64::from(idx) * 0.1));
        let best = &index.candidates_of(&again, 40)[0];
        assert_eq!((best.direction, best.later.run_idx, best.earlier.run_idx), (Direction::Same, 2, 0));
        assert!(best.earlier.first.abs_diff(200 + best.later.first) < 4, "{best:?}");
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
        assert!(index.candidates(0, 0).is_empty() && index.candidates(1, 4).is_empty());
        assert!(index.candidates(7, 0).is_empty() && index.all_candidates(1).is_empty());
    }
}
